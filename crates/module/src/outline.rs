//! Outline of a library as JSON in a section of its file: modules and requirements.
//! The compiler writes it, so that it can be read before any code of the library runs.

use slate_blackboard::interface::Descriptor;

use crate::port_list::PortList;
use crate::table::ABI;
use crate::{Module, Ports, Stage};
use slate_blackboard::interface::Interface;

/// Outline of a plugin, readable before it is opened.
#[derive(Debug)]
pub struct PluginOutline {
    /// Symbol of its [`PluginTable`](crate::PluginTable).
    pub symbol: &'static str,
    /// Name.
    pub name: &'static str,
    /// Version.
    pub version: &'static str,
    /// Effect of a panic: `unwind` or `abort`.
    pub panic: &'static str,
    /// Plugins that must be loaded before it.
    pub depends: &'static [&'static str],
    /// Kinds of modules.
    pub modules: &'static [ModuleOutline],
}

/// Outline of a kind of module, known before it is set up.
#[derive(Debug)]
pub struct ModuleOutline {
    name: &'static str,
    doc: &'static str,
    stage: Stage,
    ports: PortList,
    params: &'static Descriptor,
}

impl ModuleOutline {
    /// Returns the outline of a module.
    pub const fn of<M: Module>() -> Self {
        Self {
            name: M::NAME,
            doc: M::DOC,
            stage: M::STAGE,
            ports: M::Io::OUTLINE,
            params: <M::Params as Interface>::DESCRIPTOR,
        }
    }
}

/// Longest outline, bytes.
const OUTLINE_LIMIT: usize = 64 * 1024;

/// Text of a [`PluginOutline`].
#[derive(Debug)]
pub struct Outline {
    bytes: [u8; OUTLINE_LIMIT],
    length: usize,
}

impl Outline {
    /// Writes the outline as text, with a zero byte at its end.
    /// The zero separates several outlines in one section.
    pub const fn of(plugin: &PluginOutline) -> Self {
        let mut out = Self { bytes: [0; OUTLINE_LIMIT], length: 0 };
        out.raw("{\"abi\":");
        out.number(ABI as u64);
        out.member("symbol", plugin.symbol);
        out.member("name", plugin.name);
        out.member("version", plugin.version);
        out.member("panic", plugin.panic);
        out.raw(",\"depends\":[");
        let mut i = 0;
        while i < plugin.depends.len() {
            out.separator(i);
            out.text(plugin.depends[i]);
            i += 1;
        }
        out.raw("],\"modules\":[");
        let mut i = 0;
        while i < plugin.modules.len() {
            out.separator(i);
            out.module(&plugin.modules[i]);
            i += 1;
        }
        out.raw("]}\0");
        out
    }

    /// Bytes of the text.
    pub const fn length(&self) -> usize {
        self.length
    }

    /// Returns the text; `N` is its length.
    pub const fn bytes<const N: usize>(&self) -> [u8; N] {
        let mut bytes = [0; N];
        let mut i = 0;
        while i < N {
            bytes[i] = self.bytes[i];
            i += 1;
        }
        bytes
    }

    const fn module(&mut self, module: &ModuleOutline) {
        self.raw("{\"name\":");
        self.text(module.name);
        self.member("doc", module.doc);
        self.member("stage", module.stage.name());
        self.raw(",\"params\":{");
        self.interface(module.params);
        self.raw("},\"ports\":[");
        self.ports(&module.ports, 0);
        self.raw("]}");
    }

    /// Returns how many there are in all.
    const fn ports(&mut self, ports: &PortList, before: usize) -> usize {
        match ports {
            PortList::Ports(list) => {
                let mut i = 0;
                while i < list.len() {
                    self.separator(before + i);
                    self.raw("{\"name\":");
                    self.text(list[i].name);
                    self.member("direction", list[i].carries.0.name());
                    self.raw(",");
                    self.interface(list[i].carries.1);
                    self.raw("}");
                    i += 1;
                }
                before + list.len()
            }
            PortList::Both(first, second) => {
                let before = self.ports(first, before);
                self.ports(second, before)
            }
        }
    }

    const fn interface(&mut self, descriptor: &Descriptor) {
        self.raw("\"interface\":");
        self.text(descriptor.name);
        self.raw(",\"schema\":\"");
        let mut shift = 64;
        while shift > 0 {
            shift -= 4;
            self.byte(b"0123456789abcdef"[(descriptor.hash >> shift & 15) as usize]);
        }
        self.raw("\"");
    }

    const fn member(&mut self, name: &str, value: &str) {
        self.raw(",\"");
        self.raw(name);
        self.raw("\":");
        self.text(value);
    }

    const fn separator(&mut self, index: usize) {
        if index > 0 {
            self.byte(b',');
        }
    }

    const fn number(&mut self, number: u64) {
        if number > 9 {
            self.number(number / 10);
        }
        self.byte(b'0' + (number % 10) as u8);
    }

    /// Writes a JSON string.
    const fn text(&mut self, text: &str) {
        self.byte(b'"');
        let bytes = text.as_bytes();
        let mut i = 0;
        while i < bytes.len() {
            match bytes[i] {
                byte @ (b'"' | b'\\') => {
                    self.byte(b'\\');
                    self.byte(byte);
                }
                0..0x20 => self.byte(b' '),
                byte => self.byte(byte),
            }
            i += 1;
        }
        self.byte(b'"');
    }

    const fn raw(&mut self, text: &str) {
        let bytes = text.as_bytes();
        let mut i = 0;
        while i < bytes.len() {
            self.byte(bytes[i]);
            i += 1;
        }
    }

    const fn byte(&mut self, byte: u8) {
        assert!(
            self.length < OUTLINE_LIMIT,
            "the plugin's outline is too long: shorten the documentation of its modules"
        );
        self.bytes[self.length] = byte;
        self.length += 1;
    }
}

//! Outline of a library: its modules and requirements, without running its code.
//! It is read from a section of the file.

use std::fs::File;
use std::path::Path;

use object::elf;
use object::read::elf::FileHeader;
use object::{Endianness, Object, ObjectSection, ObjectSymbol, ReadCache, ReadRef};
use serde::{Deserialize, Serialize};
use slate_blackboard::interface::Descriptor;
use slate_module::table::ABI;
use slate_module::{Description, ModuleKind, PortDescription, Setup};

use super::{LibraryError, checksum, elf_headers};

/// Outline of a plugin, from its file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct LibraryOutline {
    /// Version of the plugin interface for which it was built.
    pub abi: u32,
    /// Symbol of its table.
    pub symbol: String,
    /// Name of the plugin.
    pub name: String,
    /// Version of the plugin.
    #[serde(default)]
    pub version: String,
    /// Effect of a panic: `unwind`, `abort`, or empty for languages without panics.
    #[serde(default)]
    pub panic: String,
    /// Plugins that must be loaded before it.
    #[serde(default)]
    pub depends: Vec<String>,
    /// Kinds of modules.
    pub modules: Vec<ModuleOutline>,
}

/// Outline of a kind of module.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct ModuleOutline {
    /// Name by which configuration finds it.
    pub name: String,
    /// Description of the module.
    #[serde(default)]
    pub doc: String,
    /// Stage of the main loop.
    #[serde(default)]
    pub stage: String,
    /// Parameters.
    #[serde(default)]
    pub params: Option<InterfaceOutline>,
    /// Ports, as far as they do not depend on its configuration.
    #[serde(default)]
    pub ports: Vec<PortOutline>,
}

impl ModuleOutline {
    fn of_description(kind: &ModuleKind, description: &Description) -> Self {
        let port = |port: &PortDescription| PortOutline {
            name: port.name.clone(),
            direction: port.direction.name().into(),
            carries: InterfaceOutline::of(port.descriptor),
        };
        Self {
            name: kind.name().into(),
            doc: kind.doc().into(),
            stage: description.stage.name().into(),
            params: Some(InterfaceOutline::of(description.params)),
            ports: description.ports.iter().map(port).collect(),
        }
    }
}

impl InterfaceOutline {
    fn of(descriptor: &Descriptor) -> Self {
        Self { interface: descriptor.name.into(), schema: format!("{:016x}", descriptor.hash) }
    }
}

/// Interface by name and schema.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct InterfaceOutline {
    /// Name of the interface.
    pub interface: String,
    /// Schema hash, hexadecimal; empty if the author omitted it.
    #[serde(default)]
    pub schema: String,
}

/// Outline of a port.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct PortOutline {
    /// Name.
    pub name: String,
    /// Direction.
    pub direction: String,
    /// Interface.
    #[serde(flatten)]
    pub carries: InterfaceOutline,
}

/// Section with the outline.
const SECTION: &str = ".slate";

/// Returns the remedy for a missing library.
fn build_help(file: &Path) -> String {
    let is_in = |folder: &str| file.components().any(|part| part.as_os_str() == folder);
    let built = is_in("target");
    match std::env::var_os("CARGO_TARGET_DIR").filter(|folder| built && !folder.is_empty()) {
        _ if is_in("build") => "build it with `cmake --build build`".into(),
        _ if !built => "give the path of a plugin's library".into(),
        Some(folder) => format!(
            "build it with `cargo build`; CARGO_TARGET_DIR is {}, so the library is there and not in `target`: name that \
             file, or build with CARGO_TARGET_DIR=target",
            Path::new(&folder).display()
        ),
        None => "build it with `cargo build`".into(),
    }
}

impl LibraryOutline {
    /// Reads the outline of a library without opening it.
    ///
    /// # Errors
    /// When the file can't be read, is not a whole library for this machine, or is not a plugin.
    pub fn read(file: &Path) -> Result<Self, LibraryError> {
        let refuse =
            |problem: String, help: &str| LibraryError { file: file.into(), problem, help: help.into() };
        const PATH: &str = "give the path of a plugin's library";
        let unreadable = |error: std::io::Error| {
            let is_missing = error.kind() == std::io::ErrorKind::NotFound;
            let help = if is_missing { build_help(file) } else { PATH.into() };
            LibraryError { file: file.into(), problem: format!("can't be read: {error}"), help }
        };
        // Reading a pipe or a device may take for ever.
        if !std::fs::metadata(file).map_err(unreadable)?.is_file() {
            return Err(refuse("is not a file".into(), PATH));
        }
        // A library may have hundreds of megabytes, of which little is looked at. It is not mapped, as truncating it
        // meanwhile would end this process.
        let mut opened = File::open(file).map_err(unreadable)?;
        if !checksum::matches_seal(&mut opened).map_err(unreadable)? {
            return Err(refuse(
                "is damaged: it is not as it was sealed".into(),
                "build or copy it again; one that was changed on purpose is sealed anew after it was built",
            ));
        }
        let parts = ReadCache::new(opened);
        Self::from_bytes(&parts).map_err(|(problem, help)| refuse(problem, help))
    }

    fn from_bytes<'d>(bytes: impl ReadRef<'d>) -> Result<Self, (String, &'static str)> {
        const LIBRARY: &str = "build it as a shared library for this machine: crate-type = [\"cdylib\"]";
        const TRUNCATED: &str = "build or copy it again";
        let header = elf::FileHeader64::<Endianness>::parse(bytes)
            .map_err(|_| ("is not a shared library (ELF, 64 bits)".to_owned(), LIBRARY))?;
        let endian = header.endian().map_err(|error| (format!("has no byte order: {error}"), LIBRARY))?;
        let (found, expected) = (header.e_machine(endian), machine());
        if header.e_type(endian) != elf::ET_DYN
            || found != expected
            || header.is_big_endian() != cfg!(target_endian = "big")
        {
            let problem = format!(
                "is not a shared library for this machine: it has type {} and machine {}, expected {} and {}",
                header.e_type(endian).0,
                found.0,
                elf::ET_DYN.0,
                expected.0
            );
            return Err((problem, LIBRARY));
        }
        elf_headers::check(header, bytes).map_err(|problem| (problem, TRUNCATED))?;
        let parsed =
            object::File::parse(bytes).map_err(|error| (format!("is damaged: {error}"), TRUNCATED))?;
        let section = parsed.section_by_name(SECTION).ok_or_else(|| {
            (
                "is a library but no plugin: it has no section `.slate`".to_owned(),
                "add a `plugin!` line to the crate",
            )
        })?;
        let text = section.data().map_err(|error| (format!("is damaged: {error}"), TRUNCATED))?;
        // Crates that were linked in may be plugins too; the library exports the table of its own.
        let mut first = None;
        for part in text.split(|byte| *byte == 0).filter(|part| !part.is_empty()) {
            let outline: Self = serde_json::from_slice(part)
                .map_err(|error| (format!("the section `.slate` can't be read: {error}"), TRUNCATED))?;
            let exported = parsed.dynamic_symbols().any(|symbol| {
                symbol.is_definition() && symbol.name().is_ok_and(|name| name == outline.symbol)
            });
            if exported {
                return outline.validate();
            }
            first.get_or_insert(outline.symbol);
        }
        let problem = match first {
            Some(symbol) => format!("exports no symbol `{symbol}`"),
            None => "has an empty section `.slate`".to_owned(),
        };
        Err((problem, "export the plugin's table under that name"))
    }

    /// Returns the outline of modules that describe themselves, as those in Python do.
    pub(crate) fn of_kinds(name: &str, kinds: &[ModuleKind]) -> Result<Self, (String, &'static str)> {
        let modules = kinds.iter().map(|kind| {
            let setup = Setup { name: kind.name(), seed: 0, period: 20_000_000, section: None, params: None };
            let description = kind.describe(&setup);
            let description = description.map_err(|refusal| {
                (format!("has a module `{}` that is invalid: {refusal}", kind.name()), "correct it")
            })?;
            Ok(ModuleOutline::of_description(kind, &description))
        });
        let modules = modules.collect::<Result<_, _>>()?;
        let (symbol, version, panic) = Default::default();
        Self { abi: ABI, symbol, name: name.into(), version, panic, depends: Vec::new(), modules }.validate()
    }

    fn validate(self) -> Result<Self, (String, &'static str)> {
        if self.abi != ABI {
            return Err((
                format!(
                    "was built for version {} of the plugin interface, this agent has version {ABI}",
                    self.abi
                ),
                "build it with the slate-plugin of this agent's version",
            ));
        }
        let is_name = |name: &&String| {
            !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'))
        };
        let modules = self.modules.iter().map(|module| &module.name);
        let bad = [&self.name].into_iter().chain(modules).find(|name| !is_name(name)).cloned();
        if let Some(name) = bad {
            let problem = format!("has `{name}` for a name");
            return Err((problem, "name plugins and kinds of modules with letters, digits, `_` and `-`"));
        }
        Ok(self)
    }
}

/// Returns the ELF code of the machine for which this program was built.
fn machine() -> elf::Machine {
    match std::env::consts::ARCH {
        "x86_64" => elf::EM_X86_64,
        "aarch64" => elf::EM_AARCH64,
        "riscv64" => elf::EM_RISCV,
        _ => elf::EM_NONE,
    }
}

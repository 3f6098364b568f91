//! Opening a library, and closing it.

use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use libloading::os::unix;
use slate_module::table::ABI;
use slate_module::{ModuleKind, ModuleTable, Plugin, PluginTable};

use super::{LibraryError, LibraryOutline};

/// A library that is open. It is a copy under a name of its own, as the system takes a file of a known name for the
/// one that it has already, and as the original may be built anew while the copy is in use.
struct Library {
    handle: Option<unix::Library>,
    copy: PathBuf,
    residence: Arc<AtomicU8>,
}

/// What became of a library's memory.
#[derive(Clone, Debug, Default)]
pub struct Residence(Arc<AtomicU8>);

/// Until then it is open.
const UNMAPPED: u8 = 1;
const RESIDENT: u8 = 2;

impl Residence {
    /// In words. That a library stays resident is no fault: the system keeps one that gave a thread something to
    /// clean up.
    pub fn describe(&self) -> &'static str {
        match self.0.load(Ordering::Acquire) {
            UNMAPPED => "unmapped",
            RESIDENT => "resident",
            _ => "open",
        }
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        let closed = self.handle.take().map(unix::Library::close);
        // SAFETY: asks only whether it is there; no code of it runs.
        let resident = unsafe { unix::Library::open(Some(&self.copy), unix::RTLD_LAZY | RTLD_NOLOAD) };
        let state = if resident.is_ok() || !matches!(closed, Some(Ok(()))) { RESIDENT } else { UNMAPPED };
        self.residence.store(state, Ordering::Release);
        // What can't be removed is in a folder for temporary files.
        let _ = std::fs::remove_file(&self.copy);
        let _ = self.copy.parent().map(std::fs::remove_dir);
    }
}

/// Opens only what is open already (Linux and others).
const RTLD_NOLOAD: i32 = 4;

/// Opens a plugin's library, after its outline was checked.
///
/// # Errors
/// What does not fit, with what was expected.
pub fn load(file: &Path) -> Result<(Plugin, LibraryOutline, Residence), LibraryError> {
    let refuse = |problem: String, help: &str| LibraryError { file: file.into(), problem, help: help.into() };
    let outline = LibraryOutline::read(file)?;
    // A language without panics says nothing.
    if !matches!(outline.panic.as_str(), "" | "unwind") {
        return Err(refuse(
            format!(
                "was built with panic = \"{}\", so a panic in it would end the whole agent",
                outline.panic
            ),
            "build it with panic = \"unwind\", or run its modules with `isolated = true`",
        ));
    }
    let residence = Residence::default();
    let copy = private_copy(file).map_err(|error| {
        refuse(format!("can't be copied to {}: {error}", std::env::temp_dir().display()), "make room there")
    })?;
    let mut library = Library { handle: None, copy, residence: Arc::clone(&residence.0) };
    // SAFETY: opening runs the library's initialisers, which is what loading a plugin means; it was checked to be a
    // whole library for this machine that says it is a plugin.
    let handle = unsafe { unix::Library::open(Some(&library.copy), unix::RTLD_NOW | unix::RTLD_LOCAL) }
        .map_err(|error| {
            refuse(
                format!("can't be opened: {}", in_full(&error, &library.copy)),
                "see which symbol or library it misses",
            )
        })?;
    // SAFETY: the outline says that the symbol is a plugin's table, which is constant.
    let table = unsafe {
        let symbol = handle.get::<*const PluginTable>(outline.symbol.as_bytes());
        symbol.map(|symbol| *symbol.into_raw().cast::<PluginTable>())
    };
    library.handle = Some(handle);
    let table = table.map_err(|error| {
        refuse(
            format!("has no symbol `{}`: {}", outline.symbol, in_full(&error, &library.copy)),
            "export the plugin's table under that name",
        )
    })?;
    if table.abi != ABI || table.module_size as usize != size_of::<ModuleTable>() {
        return Err(refuse(
            format!(
                "has a table of version {} with entries of {} bytes, expected version {ABI} with {} bytes",
                table.abi,
                table.module_size,
                size_of::<ModuleTable>()
            ),
            "build it with the slate-plugin of this agent's version",
        ));
    }
    for module in 0..if table.modules.is_null() { 0 } else { table.module_count } {
        // SAFETY: the table's version and size were checked, so it has so many entries.
        if let Some(call) = unsafe { missing_call(table.modules.add(module)) } {
            let problem = format!("leaves the call `{call}` out of the table of its module {}", module + 1);
            return Err(refuse(problem, "give every call of the table"));
        }
    }
    let library: Arc<dyn std::any::Any + Send + Sync> = Arc::new(library);
    // SAFETY: the table's version and size were checked; its modules stay as long as the library is open.
    let kinds: Vec<ModuleKind> = unsafe {
        let count = if table.modules.is_null() { 0 } else { table.module_count };
        let modules = if count == 0 { &[] } else { std::slice::from_raw_parts(table.modules, count) };
        modules.iter().map(|module| ModuleKind::from_table(*module, Some(Arc::clone(&library)))).collect()
    };
    let said: Vec<_> = outline.modules.iter().map(|module| module.name.as_str()).collect();
    let brought: Vec<_> = kinds.iter().map(ModuleKind::name).collect();
    if said != brought {
        return Err(refuse(
            format!("says that it brings {}, but brings {}", said.join(", "), brought.join(", ")),
            "make its section `.slate` and its table agree",
        ));
    }
    let depends: Vec<_> = outline.depends.iter().map(String::as_str).collect();
    let plugin = Plugin::new(&outline.name, kinds).version(&outline.version).depends(&depends);
    Ok((plugin, outline, residence))
}

/// The first call of a module that is null, which no function of Rust may be.
///
/// # Safety
/// There is a table, but for its calls.
unsafe fn missing_call(module: *const ModuleTable) -> Option<&'static str> {
    let calls = [
        ("describe", offset_of!(ModuleTable, describe)),
        ("create", offset_of!(ModuleTable, create)),
        ("tick", offset_of!(ModuleTable, tick)),
        ("save", offset_of!(ModuleTable, save)),
        ("restore", offset_of!(ModuleTable, restore)),
        ("may_unload", offset_of!(ModuleTable, may_unload)),
        ("destroy", offset_of!(ModuleTable, destroy)),
    ];
    // SAFETY: each is a pointer within the table.
    let is_null = |offset: usize| unsafe { (*module.byte_add(offset).cast::<*const ()>()).is_null() };
    calls.into_iter().find(|(_, offset)| is_null(*offset)).map(|(name, _)| name)
}

/// What the system says, which is the source of the error; the name of the copy helps nobody.
fn in_full(error: &libloading::Error, copy: &Path) -> String {
    let text = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    text.replace(&format!("{}: ", copy.display()), "")
}

/// Counts copies.
static COPIES: AtomicU64 = AtomicU64::new(1);

/// Copies the file into a folder of its own, so that debuggers find it under its name.
fn private_copy(file: &Path) -> std::io::Result<PathBuf> {
    let number = COPIES.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("slate-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let copy = folder.join(file.file_name().unwrap_or("plugin.so".as_ref()));
    std::fs::copy(file, &copy)?;
    Ok(copy)
}

//! Opening a library, and closing it.

use std::io;
use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use libloading::os::unix;
use slate_module::table::{ABI, RobotCall};
use slate_module::{ModuleKind, ModuleTable, Plugin, PluginTable, read_robot};
use slate_sorted::SortedMap;

use super::copy::PrivateCopy;
use super::runtime_of_cpp::CppRuntime;
use super::{LibraryError, LibraryOutline};

/// Open library, a copy under a name of its own.
/// The system takes a file of a known name for the one that it has already, and the original may be built anew while
/// the copy is in use.
pub(crate) struct Library {
    handle: Option<unix::Library>,
    copy: PathBuf,
    /// File that was copied; `None` if another process did.
    source: Option<PathBuf>,
    /// Interfaces of the agent, for modules in Python.
    interfaces: SortedMap<String, Vec<u8>>,
    /// Hash of the file; `None` if the copy belongs to another process.
    code: Option<u64>,
    /// Private copy, dropped after the library; `None` if another process owns it.
    _own: Option<PrivateCopy>,
    residence: Arc<AtomicU8>,
}

impl Library {
    /// Copies a library without opening it.
    ///
    /// # Errors
    /// When there is no room for the copy, or the file can't be read.
    pub(crate) fn copied(file: &Path, residence: &Residence) -> io::Result<Self> {
        let copy = PrivateCopy::create(file)?;
        let code = Some(copy.hash()?);
        let residence = Arc::clone(&residence.0);
        let source = Some(std::path::absolute(file)?);
        let (interfaces, file) = (SortedMap::new(), copy.file().into());
        Ok(Self { handle: None, copy: file, source, interfaces, code, _own: Some(copy), residence })
    }

    /// Returns the file that is opened.
    pub(crate) fn copy(&self) -> &Path {
        &self.copy
    }

    /// Sets the interfaces of the agent, for modules in Python.
    pub(crate) fn with_interfaces(mut self, interfaces: SortedMap<String, Vec<u8>>) -> Self {
        self.interfaces = interfaces;
        self
    }

    /// Returns the interfaces of the agent, by their names.
    pub(crate) fn interfaces(&self) -> &SortedMap<String, Vec<u8>> {
        &self.interfaces
    }

    /// Returns the file that was copied.
    pub(crate) fn source(&self) -> &Path {
        self.source.as_deref().unwrap_or(&self.copy)
    }
}

/// State of a library's memory after it was closed.
#[derive(Clone, Debug, Default)]
pub struct Residence(Arc<AtomicU8>);

/// State after unmapping; before, the library is open.
const UNMAPPED: u8 = 1;
const RESIDENT: u8 = 2;

impl Residence {
    /// Describes the state in words.
    /// A library that stays resident is no fault: the system keeps one that gave a thread something to clean up.
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
        // One that was never opened is not there either.
        let closed = self.handle.take().map_or(Ok(()), unix::Library::close);
        // SAFETY: asks only whether it is there; no code of it runs.
        let resident = unsafe { unix::Library::open(Some(&self.copy), unix::RTLD_LAZY | RTLD_NOLOAD) };
        let state = if resident.is_ok() || closed.is_err() { RESIDENT } else { UNMAPPED };
        self.residence.store(state, Ordering::Release);
    }
}

/// Flag to open only a library that is open already (Linux and others).
const RTLD_NOLOAD: i32 = 4;

/// Opens a copy that another process made, and leaves it where it is.
///
/// # Errors
/// As [`load`].
pub fn open_in_place(copy: &Path) -> Result<Plugin, LibraryError> {
    let outline = LibraryOutline::read(copy)?;
    let residence = Residence::default().0;
    let library = Library {
        handle: None,
        copy: copy.into(),
        source: None,
        interfaces: SortedMap::new(),
        code: None,
        _own: None,
        residence,
    };
    open(copy, library, &outline)
}

/// Returns the hash of a kind's library; `None` for linked code.
pub fn code_of(kind: &ModuleKind) -> Option<u64> {
    library_of(kind)?.code
}

/// Returns the library of a kind; `None` for linked code.
pub(crate) fn library_of(kind: &ModuleKind) -> Option<&Library> {
    kind.library()?.downcast_ref()
}

/// Opens a library, and makes a plugin of its modules.
///
/// # Errors
/// A library that does not fit, with the expected state.
pub(crate) fn open(
    file: &Path,
    mut library: Library,
    outline: &LibraryOutline,
) -> Result<Plugin, LibraryError> {
    let refuse = |problem: String, help: &str| LibraryError { file: file.into(), problem, help: help.into() };
    let _runtime = CppRuntime::open(&library.copy);
    // SAFETY: opening runs the library's initializers, which is what loading a plugin means; it was checked to be a
    // whole library for this machine that says it is a plugin.
    let handle = unsafe { unix::Library::open(Some(&library.copy), unix::RTLD_NOW | unix::RTLD_LOCAL) }
        .map_err(|error| {
            refuse(
                format!("can't be opened: {}", system_message(&error, &library.copy)),
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
            format!("has no symbol `{}`: {}", outline.symbol, system_message(&error, &library.copy)),
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
    make(file, kinds, outline)
}

/// Makes a plugin of a library's modules, which must agree with its outline.
pub(crate) fn make(
    file: &Path,
    kinds: Vec<ModuleKind>,
    outline: &LibraryOutline,
) -> Result<Plugin, LibraryError> {
    let declared: Vec<_> = outline.modules.iter().map(|module| module.name.as_str()).collect();
    let provided: Vec<_> = kinds.iter().map(ModuleKind::name).collect();
    if declared != provided {
        return Err(LibraryError {
            file: file.into(),
            problem: format!("declares {}, but contains {}", declared.join(", "), provided.join(", ")),
            help: "make its section `.slate` and its table agree".into(),
        });
    }
    let depends: Vec<_> = outline.depends.iter().map(String::as_str).collect();
    Ok(Plugin::new(&outline.name, kinds).version(&outline.version).depends(&depends))
}

/// Returns the robot configuration in a library, if any.
///
/// # Errors
/// The robot is invalid.
pub(crate) fn robot_text(
    file: &Path,
    plugin: &Plugin,
    outline: &LibraryOutline,
) -> Result<Option<String>, LibraryError> {
    let library = plugin.kinds().first().and_then(library_of);
    let Some(handle) = library.and_then(|library| library.handle.as_ref()) else { return Ok(None) };
    let symbol = outline.symbol.replacen("slate_plugin_", "slate_robot_", 1);
    // SAFETY: a plugin exports nothing else under that name.
    let Ok(call) = (unsafe { handle.get::<RobotCall>(symbol.as_bytes()) }) else { return Ok(None) };
    // SAFETY: the sink lives during the call, and the library is open.
    let text = read_robot(|sink| unsafe { call(sink) });
    text.map(Some).map_err(|refusal| LibraryError {
        file: file.into(),
        problem: format!("brings a robot that is invalid: {refusal}"),
        help: "correct the robot in its source, and build it again".into(),
    })
}

/// Returns the first call of a module that is null.
/// No function of Rust may be null.
///
/// # Safety
/// The table exists, without its calls.
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

/// Returns the system's message, which is the source of the error.
/// The copy's name is removed, as it is useless.
fn system_message(error: &libloading::Error, copy: &Path) -> String {
    let text = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    text.replace(&format!("{}: ", copy.display()), "")
}

//! Run-time libraries of C++, which plugins share.

use std::fs::File;
use std::path::Path;

use libloading::os::unix;
use object::{Object, ReadCache};

/// Beginnings of the names of run-time libraries of C++: GCC's and LLVM's.
const NAMES: [&str; 3] = ["libstdc++.so.", "libc++.so.", "libc++abi.so."];

/// Open run-time libraries of C++ that a plugin's library needs.
/// They stay while the plugin is open, also when these handles are dropped.
///
/// Each is opened on its own, before the plugin. One that comes with the plugin looks for its symbols there first, so it
/// takes a template of `std` that the plugin happens to contain. As it is never closed, neither is the plugin.
pub(super) struct CppRuntime {
    _libraries: Vec<unix::Library>,
}

impl CppRuntime {
    /// Opens what the library in a file needs.
    /// One that is not found is left to the plugin, whose error names it. So are all if the library has a search path of
    /// its own, as these would be others.
    pub fn open(file: &Path) -> Self {
        let flags = unix::RTLD_LAZY | unix::RTLD_LOCAL;
        // SAFETY: the plugin is opened next, which opens the same library of the system and runs its initializers.
        let open = |name| unsafe { unix::Library::open(Some(name), flags) };
        Self { _libraries: needed(file).into_iter().filter_map(|name| open(name).ok()).collect() }
    }
}

/// Returns the names of the run-time libraries of C++ that a library needs.
/// They are those of the system's search path.
fn needed(file: &Path) -> Vec<String> {
    let Ok(opened) = File::open(file) else { return Vec::new() };
    let bytes = ReadCache::new(opened);
    let Ok(parsed) = object::read::elf::ElfFile64::<object::Endianness, _>::parse(&bytes) else {
        return Vec::new();
    };
    let has_search_path = parsed.elf_dynamic_table().is_ok_and(|table| {
        table.iter().any(|entry| matches!(entry.tag, object::elf::DT_RPATH | object::elf::DT_RUNPATH))
    });
    let Ok(libraries) = parsed.import_libraries() else { return Vec::new() };
    let names = libraries.flatten().filter_map(|library| String::from_utf8(library.name().to_vec()).ok());
    names.filter(|name| !has_search_path && NAMES.iter().any(|begin| name.starts_with(begin))).collect()
}

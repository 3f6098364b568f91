//! Modules in Python: their source files, and the interpreter that runs them.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use slate_blackboard::interface::{Descriptor, Kind};
use slate_module::encode_interface;
use slate_sorted::SortedMap;

use crate::library::Library;

/// Source file of modules in Python.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PythonSource {
    /// Path of the author's file, for messages and imports of files beside it.
    pub file: PathBuf,
    /// Copy that is read, as the file may be edited meanwhile.
    pub copy: PathBuf,
    /// Interfaces of the agent's other modules, by name.
    /// `encode_interface` has written them.
    pub interfaces: SortedMap<String, Vec<u8>>,
}

/// Encodes interfaces, with those inside them, by their names.
pub(crate) fn encode_interfaces(descriptors: &[&'static Descriptor]) -> SortedMap<String, Vec<u8>> {
    let mut encoded = SortedMap::new();
    descriptors.iter().for_each(|descriptor| add_interface(descriptor, &mut encoded));
    encoded
}

fn add_interface(descriptor: &'static Descriptor, encoded: &mut SortedMap<String, Vec<u8>>) {
    if encoded.contains_key(descriptor.name) {
        return;
    }
    // One that has no text for its names can't be named either.
    if let Ok(bytes) = encode_interface(descriptor) {
        encoded.insert(descriptor.name.into(), bytes);
    }
    descriptor.fields.iter().for_each(|field| add_nested(&field.kind, encoded));
}

fn add_nested(kind: &Kind, encoded: &mut SortedMap<String, Vec<u8>>) {
    match kind {
        Kind::Nested(descriptor) => add_interface(descriptor, encoded),
        Kind::Optional(item) | Kind::Array(item, _) | Kind::Sequence(item, _) | Kind::Tail(item) => {
            add_nested(item, encoded);
        }
        Kind::Primitive(_) | Kind::Enumeration(_) | Kind::Text(_) => {}
    }
}

/// Returns the source that a library file is.
pub(super) fn python_source(library: &Library) -> PythonSource {
    let interfaces = library.interfaces().clone();
    PythonSource { file: library.source().into(), copy: library.copy().into(), interfaces }
}

/// Returns true if a plugin's file has modules in Python.
pub fn is_python(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "py")
}

/// Environment variable that names the interpreter.
const VARIABLE: &str = "SLATE_PYTHON";

/// Returns the interpreter of modules in Python.
/// It is that of `SLATE_PYTHON`, the one beside this program, as in an environment of pip, or that of the path.
fn interpreter() -> OsString {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
        return named;
    }
    let beside = std::env::current_exe().ok().map(|program| program.with_file_name("python3"));
    beside.filter(|python| python.is_file()).map_or_else(|| "python3".into(), Into::into)
}

/// Returns the command that starts an interpreter for a module.
pub(super) fn command() -> Command {
    let mut command = Command::new(interpreter());
    // Not from the working folder, whose files may have names of Python's modules; without buffers, as the process may
    // be killed; the order of sets is the same in each run.
    command.args(["-P", "-u", "-m", "slate.host"]).env("PYTHONHASHSEED", "0");
    command
}

/// Returns what helps when an interpreter can't run modules.
pub fn help() -> String {
    format!(
        "`{} -m slate.host` runs modules in Python: install the package slate-robotics {} there (`python/build`, then \
         `pip install` of its wheel), with Python 3.11 or newer, or name another interpreter in {VARIABLE}",
        interpreter().display(),
        env!("CARGO_PKG_VERSION")
    )
}

/// Returns the command that runs a source file without an agent.
pub(super) fn run_alone(file: &Path) -> String {
    format!("`{} {}`", interpreter().display(), file.display())
}

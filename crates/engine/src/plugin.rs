//! Plugins as shared libraries: outlines of files, and loading with checks.
//! The outline is read before the file is opened, as the code of others needs care.

use std::any::Any;
use std::path::Path;
use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::Plugin;

use crate::isolation;
use crate::library::{Library, make, open, robot_text};

pub use crate::library::{
    InterfaceOutline, KnownLibraries, LibraryError, LibraryOutline, ModuleOutline, PortOutline, Residence,
    code_of, seal,
};

/// Opens a plugin's library, after its outline was checked.
///
/// # Errors
/// A library that does not fit, with the expected state.
pub fn load(file: &Path) -> Result<(Plugin, LibraryOutline, Residence), LibraryError> {
    load_for(file, None, Vec::new, |_| false)
}

/// Returns the robot configuration that a library contains beside its modules.
/// `None` if it contains none.
///
/// # Errors
/// As [`load`], or the robot is invalid.
pub fn robot_of(file: &Path) -> Result<Option<(Plugin, String)>, LibraryError> {
    let (plugin, outline, _) = load(file)?;
    Ok(robot_text(file, &plugin, &outline)?.map(|text| (plugin, text)))
}

/// Acts as [`load`], and leaves unloadable code to the processes of its modules.
/// A library that must not be opened here is left to them if all its modules `are_isolated`; `program` runs them.
/// Modules in Python may name the `interfaces`.
pub fn load_for(
    file: &Path,
    program: Option<&Path>,
    interfaces: impl FnOnce() -> Vec<&'static Descriptor>,
    are_isolated: impl FnOnce(&LibraryOutline) -> bool,
) -> Result<(Plugin, LibraryOutline, Residence), LibraryError> {
    if isolation::is_python(file) {
        return load_python(file, &interfaces());
    }
    let refuse = |problem: String, help: &str| LibraryError { file: file.into(), problem, help: help.into() };
    let outline = LibraryOutline::read(file)?;
    // A language without panics says nothing.
    let outside = !matches!(outline.panic.as_str(), "" | "unwind");
    if outside && !are_isolated(&outline) {
        return Err(refuse(
            format!(
                "was built with panic = \"{}\", so a panic in it would end the whole agent",
                outline.panic
            ),
            "build it with panic = \"unwind\", or run its modules with `isolated = true`",
        ));
    }
    let residence = Residence::default();
    let library = copied(file, &residence)?;
    let plugin = if outside {
        let copy = library.copy().to_owned();
        let library: Arc<dyn Any + Send + Sync> = Arc::new(library);
        let kinds = isolation::external_kinds(program, &copy, &library);
        let kinds = kinds.map_err(|refusal| {
            refuse(format!("can't be opened by another process: {refusal}"), "see why it ends")
        })?;
        make(file, kinds, &outline)?
    } else {
        isolation::probe(program, library.copy()).map_err(|end| {
            refuse(
                format!("can't be opened: a process that tried it first {end}"),
                "build or copy it again; or see what it does when it is opened or describes its modules",
            )
        })?;
        open(file, library, &outline)?
    };
    Ok((plugin, outline, residence))
}

/// Reads the outline of a plugin.
/// It is in a library's file; for modules in Python, an interpreter runs the file, which may name the `interfaces`.
///
/// # Errors
/// As [`LibraryOutline::read`], or a file that Python can't run.
pub fn outline(
    file: &Path,
    interfaces: impl FnOnce() -> Vec<&'static Descriptor>,
) -> Result<LibraryOutline, LibraryError> {
    if isolation::is_python(file) {
        Ok(load_python(file, &interfaces())?.1)
    } else {
        LibraryOutline::read(file)
    }
}

/// Copies a library, which may be built anew while it is in use.
fn copied(file: &Path, residence: &Residence) -> Result<Library, LibraryError> {
    Library::copied(file, residence).map_err(|error| {
        let folder = std::env::temp_dir();
        let problem = format!("can't be copied to {}: {error}", folder.display());
        LibraryError { file: file.into(), problem, help: "make room there".into() }
    })
}

/// Loads modules in Python, which run in processes of their own.
/// The plugin has the name of the file.
fn load_python(
    file: &Path,
    interfaces: &[&'static Descriptor],
) -> Result<(Plugin, LibraryOutline, Residence), LibraryError> {
    let refuse = |problem: String, help: String| LibraryError { file: file.into(), problem, help };
    let unreadable =
        |error| refuse(format!("can't be read: {error}"), "give the path of a file in Python".into());
    std::fs::File::open(file).map_err(unreadable)?;
    let residence = Residence::default();
    let library = copied(file, &residence)?.with_interfaces(isolation::encode_interfaces(interfaces));
    let kinds = isolation::python_kinds(library)
        .map_err(|(refusal, help)| refuse(format!("can't be run by Python: {refusal}"), help))?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let outline =
        LibraryOutline::of_kinds(&name, &kinds).map_err(|(problem, help)| refuse(problem, help.into()))?;
    Ok((Plugin::new(&name, kinds), outline, residence))
}

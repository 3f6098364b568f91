//! Plugins as shared libraries: outlines of files, and loading with checks.
//! The outline is read before the file is opened, as the code of others needs care.

use std::any::Any;
use std::path::Path;
use std::sync::Arc;

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
    load_for(file, None, |_| false)
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
pub fn load_for(
    file: &Path,
    program: Option<&Path>,
    are_isolated: impl FnOnce(&LibraryOutline) -> bool,
) -> Result<(Plugin, LibraryOutline, Residence), LibraryError> {
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
    let library = Library::copied(file, &residence).map_err(|error| {
        refuse(format!("can't be copied to {}: {error}", std::env::temp_dir().display()), "make room there")
    })?;
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

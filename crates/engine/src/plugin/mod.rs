//! Plugins as shared libraries: what a file says of itself before it is opened, and opening it.

mod copy;
mod known;
mod library;
mod outline;
mod seal;
mod whole;

use std::path::PathBuf;

pub use known::KnownLibraries;
pub use library::{Residence, load};
pub use library::{code_of, file_of, load_for, open_as_it_is};
pub use outline::{InterfaceOutline, LibraryOutline, ModuleOutline, PortOutline};
pub use seal::seal;

/// Why a file can't be used as a plugin.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("{}: {problem}", slate_configuration::printable(.file))]
#[diagnostic(help("{help}"))]
pub struct LibraryError {
    /// The file.
    pub file: PathBuf,
    /// What was found, and what was expected.
    pub problem: String,
    /// What to do.
    pub help: String,
}

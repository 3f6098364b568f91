//! Libraries of plugins: reading the outline of a file, and opening it.

mod checksum;
mod copy;
mod elf_headers;
mod known;
mod open;
mod outline;
mod runtime_of_cpp;
mod seal;

use std::path::PathBuf;

pub use known::KnownLibraries;
pub(crate) use open::{Library, library_of, make, open, robot_text};
pub use open::{Residence, code_of, open_in_place};
pub use outline::{InterfaceOutline, LibraryOutline, ModuleOutline, PortOutline};
pub use seal::seal;

/// Reason why a file can't be used as a plugin.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("{}: {problem}", slate_configuration::printable(.file))]
#[diagnostic(help("{help}"))]
pub struct LibraryError {
    /// Path of the file.
    pub file: PathBuf,
    /// Problem found, and the expected state.
    pub problem: String,
    /// Remedy.
    pub help: String,
}

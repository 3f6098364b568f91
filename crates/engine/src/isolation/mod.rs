//! Isolation of modules in processes of their own, which a fault can't leave.
//!
//! The process is the same program, started once more. The host alone pins inputs, commits outputs and keeps
//! everything that others trust; the other process reads the values of a tick and writes drafts in memory that both
//! map. So an isolated module has the same code, ports, links, log and place in lockstep, and a fault of its code
//! corrupts nothing but its outputs.

mod arena;
mod arenas;
mod child;
mod launcher;
mod library;
mod mirror;
mod process;
mod process_record;
mod proxy;
mod python;
mod spans;
mod supervisor;
mod wire;

pub use arena::Arena;
use arena::length;
pub use arenas::Arenas;
pub use child::{enter, serve_python};
pub(crate) use library::python_kinds;
pub use library::{kinds as external_kinds, probe};
pub use process::describe;
pub use proxy::{Isolation, Proxy};
pub(crate) use python::encode_interfaces;
pub use python::{PythonSource, is_python};
pub use slate_composition::own::ModuleProcess;
pub use supervisor::Supervisor;

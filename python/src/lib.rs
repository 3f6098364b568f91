//! Agents, simulations, recordings and modules, for the Python package `slate`.
//!
//! Values of a connection cross as JSON text, which Python's own module reads; the package gives them their shape.

mod columns;
mod connection;
mod driven_input;
mod host;
mod probe;
mod recording;
mod simulation;
mod worker;

use pyo3::prelude::*;

/// Extension module of the package `slate`.
#[pymodule(gil_used = true)]
mod _slate {
    #[pymodule_export]
    use super::connection::{AgentError, AgentUnreachable, Connection, NoAgent, Refused, VersionMismatch};
    #[pymodule_export]
    use super::driven_input::DrivenInput;
    #[pymodule_export]
    use super::host::{
        CommandPort, DebugPort, Fixture, InboxPort, InputPort, OutboxPort, OutputPort, QueuePort, Received,
        Stamp, Tick, Value, encode_value, interface, interfaces, is_stage, nanoseconds, serve_module,
    };
    #[pymodule_export]
    use super::probe::Probe;
    #[pymodule_export]
    use super::recording::RecordingFile;
    #[pymodule_export]
    use super::simulation::{ConfigurationError, SteppedAgent};

    use pyo3::prelude::*;
    use slate_runtime::directory;

    /// Names of the agents that run on this machine.
    #[pyfunction]
    fn agents() -> Vec<String> {
        directory::agents()
    }

    /// Name of the agent that a process runs; None if it runs none.
    #[pyfunction]
    fn agent_of(process: u32) -> Option<String> {
        let holder =
            |name: &String| directory::Lock::holder(&directory::folder().join(format!("{name}.lock")));
        directory::agents().into_iter().find(|name| holder(name) == Some(process))
    }

    /// Version of this package, which is that of the program `slate`.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

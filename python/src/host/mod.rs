//! Modules in Python: the process that runs one for an agent.
//!
//! An agent starts the interpreter and speaks with it as with the process of any isolated module: the engine has the
//! protocol, and this is what a module's table calls.

mod fixture;
mod kind;
mod memory;
mod plain;
mod ports;
mod tick;
mod value;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use slate_module::blackboard::interface::Descriptor;
use slate_module::{Refusal, decode_interface, encode_interface, parse_duration};
use slate_runtime::isolation::{PythonSource, serve_python};
use slate_sorted::SortedMap;

pub use fixture::Fixture;
pub use kind::is_stage;
use memory::Block;
pub use ports::{
    CommandPort, DebugPort, InboxPort, InputPort, OutboxPort, OutputPort, QueuePort, Received, Stamp,
};
pub use tick::Tick;
pub use value::Value;

/// Runs a module for the agent that has started this process, until its end.
/// `load` takes a file and its copy, and returns its classes of modules.
#[pyfunction]
pub fn serve_module(py: Python<'_>, load: Py<PyAny>) -> PyResult<()> {
    let open = |source: &PythonSource| {
        Python::attach(|py| {
            known().clone_from(&source.interfaces);
            SOURCE.get_or_init(|| source.file.clone());
            let classes = load.bind(py).call1((&source.file, &source.copy));
            let classes = classes.and_then(|classes| classes.extract::<Vec<Bound<'_, PyAny>>>());
            let classes = classes.map_err(|error| kind::shown_refusal(py, &error))?;
            classes.iter().map(kind::kind).collect::<Result<_, Refusal>>()
        })
    };
    py.detach(|| serve_python(open))
        .map_err(|error| PyOSError::new_err(format!("{error}: an agent starts this program for its modules")))
}

/// Source file that this process runs for an agent; empty in other programs.
static SOURCE: OnceLock<PathBuf> = OnceLock::new();

/// Interfaces of the agent that runs the module, by their names.
static KNOWN: Mutex<SortedMap<String, Vec<u8>>> = Mutex::new(SortedMap::new());

fn known() -> MutexGuard<'static, SortedMap<String, Vec<u8>>> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Fields of an interface that is well-known or of the agent.
/// They are as in a description of a module; None for an unknown name.
#[pyfunction]
pub fn interface(py: Python<'_>, name: &str) -> PyResult<Option<Py<PyAny>>> {
    let well_known = slate_interfaces::ALL.iter().find(|descriptor| descriptor.name == name);
    let of_agent = known().get(name).cloned();
    let Some(encoded) = of_agent.map(Ok).or_else(|| well_known.map(|known| encode_interface(known))) else {
        return Ok(None);
    };
    let table = encoded.and_then(|bytes| plain::decode(py, &bytes));
    table.map(Some).map_err(|refusal| wrong(&refusal))
}

/// Names of the interfaces that are well-known or of the agent.
#[pyfunction]
pub fn interfaces() -> BTreeSet<String> {
    let well_known = slate_interfaces::ALL.iter().map(|descriptor| descriptor.name.into());
    well_known.chain(known().keys().cloned()).collect()
}

/// Bytes of a value of an interface without a tail, such as a safe value.
#[pyfunction]
pub fn encode_value(interface: &Bound<'_, PyAny>, value: &Bound<'_, PyAny>) -> PyResult<Py<PyBytes>> {
    let encoded = plain::encode(interface)?;
    let descriptor: &'static Descriptor = decode_interface(&encoded).map_err(|refusal| wrong(&refusal))?;
    let block = Block::new(descriptor.size);
    value::write::write_dict(descriptor, block.data(), 0, value)?;
    // SAFETY: there are at least so many bytes, all of which are initialized.
    let bytes = unsafe { std::slice::from_raw_parts(block.data(), descriptor.size) };
    Ok(PyBytes::new(interface.py(), bytes).unbind())
}

/// Nanoseconds of a duration such as "200ms"; None for other text.
#[pyfunction]
pub fn nanoseconds(text: &str) -> Option<u64> {
    parse_duration(text)
}

fn wrong(refusal: &Refusal) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(refusal.0.clone())
}

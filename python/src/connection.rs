//! Connection to an agent, by its socket or over TCP.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use serde_json::Value as Json;
use slate_control::client::{Access, Address, RequestError};
use slate_control::{Client, ClientError};

use crate::worker::{Job, Worker};

create_exception!(slate, AgentError, PyException, "Error of a request to an agent.");
create_exception!(slate, NoAgent, AgentError, "No agent of that name runs on this machine.");
create_exception!(slate, AgentUnreachable, AgentError, "The agent does not answer, or the connection broke.");
create_exception!(slate, VersionMismatch, AgentError, "The agent has another version of the operations.");
create_exception!(slate, Refused, AgentError, "The agent refuses; `help`, `code` and `report` say more.");

/// Address of an agent.
enum Target {
    /// Name of an agent of this machine.
    Local(String),
    Remote(Access),
}

/// Connection to an agent; several threads may use it at the same time.
#[pyclass(frozen, module = "slate._slate")]
pub struct Connection {
    target: Target,
    /// Connections without a request.
    idle: Mutex<Vec<Worker>>,
    /// Process that opened it.
    process: u32,
}

#[pymethods]
impl Connection {
    /// Connects to an agent of this machine.
    #[staticmethod]
    fn local(py: Python<'_>, name: String) -> PyResult<Self> {
        Self::open(py, Target::Local(name))
    }

    /// Connects to an address with the secret of a role.
    /// An address is `https://robot.local:7878`.
    #[staticmethod]
    #[pyo3(signature = (address, token, certificate=None))]
    fn remote(py: Python<'_>, address: &str, token: String, certificate: Option<PathBuf>) -> PyResult<Self> {
        let address: Address = address.parse().map_err(|reason| {
            PyValueError::new_err(format!("`{address}` is not an address of an agent: {reason}"))
        })?;
        let browser = address.to_string();
        Self::open(py, Target::Remote(Access { address, browser, token, certificate }))
    }

    /// Carries out an operation of the HTTP API.
    /// `path` stands behind `/api/v1`, body and answer are JSON.
    #[pyo3(signature = (method, path, body=None))]
    fn call(&self, py: Python<'_>, method: String, path: String, body: Option<&str>) -> PyResult<String> {
        let body = body
            .map(serde_json::from_str::<Json>)
            .transpose()
            .map_err(|error| PyValueError::new_err(format!("the body is no JSON: {error}")))?;
        self.carry_out(
            py,
            Box::new(move |client| {
                client.call::<Json>(&method, &path, body.as_ref()).map(|answer| answer.to_string())
            }),
        )
    }

    /// Stops all actuators, past whatever the agent is busy with.
    fn stop(&self, py: Python<'_>, reason: String) -> PyResult<()> {
        let name = match &self.target {
            Target::Local(name) => name.clone(),
            Target::Remote(_) => {
                return self
                    .carry_out(py, Box::new(move |client| client.stop(&reason).map(|()| String::new())))
                    .map(drop);
            }
        };
        py.detach(|| Client::stop_at_once(&name, &reason)).map_err(|error| exception(py, &error))
    }
}

impl Connection {
    fn open(py: Python<'_>, target: Target) -> PyResult<Self> {
        let first = connect(py, &target)?;
        Ok(Self { target, idle: Mutex::new(vec![first]), process: std::process::id() })
    }

    fn idle(&self) -> std::sync::MutexGuard<'_, Vec<Worker>> {
        // The list is whole whatever has panicked.
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn carry_out(&self, py: Python<'_>, job: Job) -> PyResult<String> {
        if std::process::id() != self.process {
            return Err(AgentError::new_err(
                "this connection was opened before a fork, and its threads are in the other process: connect again in this one",
            ));
        }
        let idle = self.idle().pop();
        let worker = idle.map_or_else(|| connect(py, &self.target), Ok)?;
        match worker.call(py, job)? {
            Some(Ok(answer)) => {
                self.idle().push(worker);
                Ok(answer)
            }
            Some(Err(error)) => {
                if matches!(error, ClientError::Refused(_)) {
                    self.idle().push(worker);
                }
                Err(exception(py, &error))
            }
            None => Err(AgentUnreachable::new_err("the thread of the connection has ended")),
        }
    }
}

fn connect(py: Python<'_>, target: &Target) -> PyResult<Worker> {
    let client = py.detach(|| match target {
        Target::Local(name) => Client::connect(name).map_err(OpenError::Client),
        Target::Remote(access) => Client::at(access).map_err(OpenError::Request),
    });
    let client = client.map_err(|error| match error {
        OpenError::Client(error) => exception(py, &error),
        OpenError::Request(RequestError::HttpRefusal(denied)) => {
            refusal(py, denied.detail, denied.help, denied.code, denied.report)
        }
        OpenError::Request(RequestError::AccessFailure(failure)) => {
            AgentUnreachable::new_err(failure.to_string())
        }
    })?;
    Ok(Worker::start(client)?)
}

/// Error of opening a connection.
enum OpenError {
    Client(ClientError),
    Request(RequestError),
}

/// Exception of an error, with what the agent says about it.
fn exception(py: Python<'_>, error: &ClientError) -> PyErr {
    match error {
        ClientError::Refused(refused) => refusal(
            py,
            refused.message.clone(),
            refused.help.clone(),
            refused.code.clone(),
            refused.report.clone(),
        ),
        ClientError::NoAgent { running, .. } => {
            let others = match &running[..] {
                [] => "none runs: start one with `slate run exp1`".to_owned(),
                names => format!("running: {}", names.join(", ")),
            };
            NoAgent::new_err(format!("{error}; {others}"))
        }
        ClientError::Version { .. } => {
            let help = "install the version of slate-robotics that the agent has";
            VersionMismatch::new_err(format!(
                "{error} (slate-robotics {}): {help}",
                env!("CARGO_PKG_VERSION")
            ))
        }
        ClientError::InvalidAnswer { .. } => AgentError::new_err(error.to_string()),
        ClientError::Lost { .. } => AgentUnreachable::new_err(error.to_string()),
    }
}

/// Exception of a refusal, with its advice, code and report.
pub fn refusal(
    py: Python<'_>,
    message: String,
    help: String,
    code: Option<String>,
    report: Option<String>,
) -> PyErr {
    let text = match (&report, help.is_empty()) {
        (Some(report), _) => report.clone(),
        (None, true) => message,
        (None, false) => format!("{message}\nhelp: {help}"),
    };
    let error = Refused::new_err(text);
    let value = error.value(py);
    let attributes = [("help", Some(help)), ("code", code), ("report", report)];
    for (name, content) in attributes {
        // An exception takes any attribute.
        let _ = value.setattr(name, content);
    }
    error
}

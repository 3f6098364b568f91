//! Connections to agents.

use std::ffi::{CString, c_char};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value as Json;
use slate_control::Client;
use slate_control::client::{Access, Address};
use slate_runtime::directory;

use crate::boundary::{SlateSample, attempt, borrow, json, optional, text};
use crate::error::{ClientFailure, SlateError};
use crate::text::give;

/// Way to an agent.
#[derive(Clone, Debug)]
pub(crate) enum AgentTarget {
    /// Name of an agent of this machine.
    Local(String),
    Remote(Access),
}

impl AgentTarget {
    /// Opens a connection.
    pub(crate) fn connect(&self) -> Result<Client, ClientFailure> {
        match self {
            Self::Local(name) => Ok(Client::connect(name)?),
            Self::Remote(access) => Ok(Client::at(access)?),
        }
    }
}

/// Connection to an agent, until `slate_agent_free`.
/// Several threads may use it at the same time; their calls take turns.
#[derive(Debug)]
pub struct SlateAgent {
    pub(crate) target: AgentTarget,
    name: CString,
    client: Mutex<Client>,
}

impl SlateAgent {
    fn open(target: AgentTarget) -> Result<*mut Self, ClientFailure> {
        let client = target.connect()?;
        // SAFETY: `give` has just made it, and nobody else has it.
        let name = unsafe { CString::from_raw(give(client.name().to_owned())) };
        Ok(Box::into_raw(Box::new(Self { target, name, client: Mutex::new(client) })))
    }

    fn client(&self) -> MutexGuard<'_, Client> {
        // A request is whole or its connection is lost, whatever has panicked.
        self.client.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the name in the environment, or of the only agent of this machine.
fn default_name() -> Result<String, ClientFailure> {
    if let Some(name) = std::env::var("SLATE_AGENT").ok().filter(|name| !name.is_empty()) {
        return Ok(name);
    }
    let mut running = directory::agents();
    match running.len() {
        1 => Ok(running.remove(0)),
        0 => Err(ClientFailure::no_agent("no agent runs here".into(), &running)),
        _ => Err(ClientFailure::no_agent("several agents run here, and no name was given".into(), &running)),
    }
}

/// Connects to the agent of that name on this machine.
/// NULL or an empty name is that in the variable SLATE_AGENT, or the only agent that runs.
/// Returns NULL on an error.
///
/// # Safety
/// The texts end with a zero byte; `error` is null or a place for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_connect(
    name: *const c_char,
    error: *mut *mut SlateError,
) -> *mut SlateAgent {
    let connect = || {
        // SAFETY: passed on to the caller.
        let name = unsafe { optional(name, "the name") }?;
        SlateAgent::open(AgentTarget::Local(name.map_or_else(default_name, |name| Ok(name.to_owned()))?))
    };
    // SAFETY: passed on to the caller.
    unsafe { attempt(error, connect) }.unwrap_or(std::ptr::null_mut())
}

/// Connects to an agent elsewhere with the secret of a role.
/// The address is one such as `https://robot.local:7878`. `certificate` is the file of the certificates to trust; NULL for those that the system trusts.
/// Returns NULL on an error.
///
/// # Safety
/// As for `slate_agent_connect`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_connect_remote(
    address: *const c_char,
    token: *const c_char,
    certificate: *const c_char,
    error: *mut *mut SlateError,
) -> *mut SlateAgent {
    let connect = || {
        // SAFETY: passed on to the caller.
        let (place, token, certificate) = unsafe {
            (
                text(address, "the address")?,
                text(token, "the token")?,
                optional(certificate, "the certificate")?,
            )
        };
        let address: Address = place.parse().map_err(|reason| {
            ClientFailure::invalid(
                format!("`{place}` is not an address of an agent: {reason}"),
                "pass one such as http://127.0.0.1:7878 or https://robot.local:7878",
            )
        })?;
        let (browser, token) = (address.to_string(), token.to_owned());
        SlateAgent::open(AgentTarget::Remote(Access {
            address,
            browser,
            token,
            certificate: certificate.map(PathBuf::from),
        }))
    };
    // SAFETY: passed on to the caller.
    unsafe { attempt(error, connect) }.unwrap_or(std::ptr::null_mut())
}

/// Closes a connection; null is allowed.
///
/// # Safety
/// `agent` is null, or came from this library, was not freed, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_free(agent: *mut SlateAgent) {
    if !agent.is_null() {
        // SAFETY: `open` has made it as a box.
        drop(unsafe { Box::from_raw(agent) });
    }
}

/// Returns the name of an agent, until its connection is freed.
///
/// # Safety
/// The agent came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_name(agent: *const SlateAgent) -> *const c_char {
    // SAFETY: passed on to the caller.
    unsafe { (*agent).name.as_ptr() }
}

/// Carries out an operation of the HTTP API, and returns the answer as JSON.
/// `path` stands behind `/api/v1`, such as `/modules`; `body` is JSON, or NULL for none. Returns NULL on an error; free
/// the answer with `slate_text_free`.
///
/// # Safety
/// The agent came from this library and was not freed; otherwise as for `slate_agent_connect`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_call(
    agent: *const SlateAgent,
    method: *const c_char,
    path: *const c_char,
    body: *const c_char,
    error: *mut *mut SlateError,
) -> *mut c_char {
    let call = || {
        // SAFETY: passed on to the caller.
        let (agent, method, path) =
            unsafe { (borrow(agent, "agent")?, text(method, "the method")?, text(path, "the path")?) };
        // SAFETY: as above.
        let body = if body.is_null() { None } else { Some(unsafe { json(body, "the body") }?) };
        let answer: Json = agent.client().call(method, path, body.as_ref())?;
        Ok(give(answer.to_string()))
    };
    // SAFETY: as above.
    unsafe { attempt(error, call) }.unwrap_or(std::ptr::null_mut())
}

/// Reads the newest value of a property or a field.
/// The URL is one such as `/r2/pose` or `/r2/pose/x`. Before the first write the JSON of the sample is NULL. Returns false on an error.
///
/// # Safety
/// `sample` is a place for a sample; otherwise as for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_read(
    agent: *const SlateAgent,
    url: *const c_char,
    sample: *mut SlateSample,
    error: *mut *mut SlateError,
) -> bool {
    let read = || {
        // SAFETY: passed on to the caller.
        let (agent, url) = unsafe { (borrow(agent, "agent")?, text(url, "the URL")?) };
        let reading = agent.client().read(url)?;
        let read = reading.map_or(SlateSample::NONE, |reading| SlateSample::new(&reading, 0));
        // SAFETY: as above.
        unsafe { sample.write(read) };
        Ok(())
    };
    // SAFETY: as above.
    unsafe { attempt(error, read) }.is_some()
}

/// Reads the newest value of a field that is a number.
/// It is NaN before the first write, and for infinity and NaN. Returns false on an error, also if it is not a number.
///
/// # Safety
/// `value` is a place for a number; otherwise as for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_read_number(
    agent: *const SlateAgent,
    url: *const c_char,
    value: *mut f64,
    error: *mut *mut SlateError,
) -> bool {
    let read = || {
        // SAFETY: passed on to the caller.
        let (agent, url) = unsafe { (borrow(agent, "agent")?, text(url, "the URL")?) };
        let number = match agent.client().read(url)?.map(|reading| reading.value) {
            None | Some(Json::Null) => f64::NAN,
            Some(Json::Bool(truth)) => f64::from(u8::from(truth)),
            Some(other) => other.as_f64().ok_or_else(|| {
                ClientFailure::invalid(
                    format!("expected a number at `{url}`, found {other}"),
                    "name a field of it, such as `/r2/pose/x`",
                )
            })?,
        };
        // SAFETY: as above.
        unsafe { value.write(number) };
        Ok(())
    };
    // SAFETY: as above.
    unsafe { attempt(error, read) }.is_some()
}

/// Sets a parameter, an input without a link, or fields of one.
/// The value is JSON; fields that it does not name keep theirs. Returns false on an error.
///
/// # Safety
/// As for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_set(
    agent: *const SlateAgent,
    url: *const c_char,
    value: *const c_char,
    error: *mut *mut SlateError,
) -> bool {
    let set = || {
        // SAFETY: passed on to the caller.
        let (agent, url, value) =
            unsafe { (borrow(agent, "agent")?, text(url, "the URL")?, json(value, "the value")?) };
        agent.client().set_property(url, &value)?;
        Ok(())
    };
    // SAFETY: as above.
    unsafe { attempt(error, set) }.is_some()
}

/// Sets a setting of the configuration.
/// Path and value are those that `slate run --set PATH=VALUE` takes. Returns false on an error.
///
/// # Safety
/// As for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_configure(
    agent: *const SlateAgent,
    path: *const c_char,
    value: *const c_char,
    error: *mut *mut SlateError,
) -> bool {
    let set = || {
        // SAFETY: passed on to the caller.
        let (agent, path, value) =
            unsafe { (borrow(agent, "agent")?, text(path, "the path")?, text(value, "the value")?) };
        agent.client().set(&[(path.to_owned(), value.to_owned())])?;
        Ok(())
    };
    // SAFETY: as above.
    unsafe { attempt(error, set) }.is_some()
}

/// Sends a message to an inbox, and returns the outcome, such as `done`.
/// The message is JSON. Returns NULL on an error; free the outcome with `slate_text_free`.
///
/// # Safety
/// As for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_send(
    agent: *const SlateAgent,
    url: *const c_char,
    message: *const c_char,
    error: *mut *mut SlateError,
) -> *mut c_char {
    let send = || {
        // SAFETY: passed on to the caller.
        let (agent, url, message) =
            unsafe { (borrow(agent, "agent")?, text(url, "the URL")?, json(message, "the message")?) };
        Ok(give(agent.client().send(url, message, false)?))
    };
    // SAFETY: as above.
    unsafe { attempt(error, send) }.unwrap_or(std::ptr::null_mut())
}

/// Stops all actuators until they are reset and armed.
/// It works while the agent is busy. Returns false on an error.
///
/// # Safety
/// As for `slate_agent_call`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_stop(
    agent: *const SlateAgent,
    reason: *const c_char,
    error: *mut *mut SlateError,
) -> bool {
    let stop = || {
        // SAFETY: passed on to the caller.
        let (agent, reason) = unsafe { (borrow(agent, "agent")?, text(reason, "the reason")?) };
        match &agent.target {
            AgentTarget::Local(name) => Client::stop_at_once(name, reason)?,
            // A connection of its own, as the other one may wait for an answer.
            AgentTarget::Remote(_) => agent.target.connect()?.stop(reason)?,
        }
        Ok(())
    };
    // SAFETY: as above.
    unsafe { attempt(error, stop) }.is_some()
}

//! Errors of calls, with the help text of the agent.

use std::ffi::{CString, c_char};

use slate_control::ClientError;
use slate_control::client::RequestError;

use crate::text::give;

/// Kind of an error.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlateErrorKind {
    /// An argument of the call is invalid.
    InvalidArgument,
    /// No agent of that name runs on this machine.
    NoAgent,
    /// The agent does not answer, or the connection broke.
    Unreachable,
    /// The agent has another version of the operations.
    VersionMismatch,
    /// The agent refuses.
    Refused,
    /// The agent's answer makes no sense.
    InvalidAnswer,
    /// Defect of this library.
    Internal,
}

/// Error of a call, until `slate_error_free`.
#[derive(Debug)]
pub struct SlateError {
    kind: SlateErrorKind,
    message: CString,
    help: CString,
    code: CString,
}

/// Error before it is given to the caller.
#[derive(Debug)]
pub(crate) struct ClientFailure {
    kind: SlateErrorKind,
    message: String,
    help: String,
    code: String,
}

impl ClientFailure {
    fn new(kind: SlateErrorKind, message: String, help: String) -> Self {
        Self { kind, message, help, code: String::new() }
    }

    /// Returns the error of an invalid argument.
    pub(crate) fn invalid(message: String, help: &str) -> Self {
        Self::new(SlateErrorKind::InvalidArgument, message, help.to_owned())
    }

    /// Returns the error of a defect.
    pub(crate) fn internal(message: &str) -> Self {
        Self::new(SlateErrorKind::Internal, message.to_owned(), "report it with what was called".to_owned())
    }

    /// Returns the error of an agent that is not found.
    pub(crate) fn no_agent(message: String, running: &[String]) -> Self {
        let help = match running {
            [] => "no agent runs here: start one with `slate run exp1`".to_owned(),
            names => format!("running: {}", names.join(", ")),
        };
        Self::new(SlateErrorKind::NoAgent, message, help)
    }
}

impl From<ClientError> for ClientFailure {
    fn from(error: ClientError) -> Self {
        let message = error.to_string();
        match error {
            ClientError::NoAgent { running, .. } => Self::no_agent(message, &running),
            ClientError::Refused(refusal) => {
                let text = refusal.report.unwrap_or(message);
                let mut failure = Self::new(SlateErrorKind::Refused, text, refusal.help);
                failure.code = refusal.code.unwrap_or_default();
                failure
            }
            ClientError::Version { .. } => {
                let help = "link libslate of the version that the agent has".to_owned();
                Self::new(SlateErrorKind::VersionMismatch, message, help)
            }
            ClientError::InvalidAnswer { .. } => {
                Self::new(SlateErrorKind::InvalidAnswer, message, String::new())
            }
            ClientError::Lost { .. } => {
                let help = "look whether it still runs: `slate ps`".to_owned();
                Self::new(SlateErrorKind::Unreachable, message, help)
            }
        }
    }
}

impl From<RequestError> for ClientFailure {
    fn from(error: RequestError) -> Self {
        let message = error.to_string();
        match error {
            RequestError::AccessFailure(failure) => {
                Self::new(SlateErrorKind::Unreachable, message, failure.help())
            }
            RequestError::HttpRefusal(refusal) => {
                let mut failure = Self::new(SlateErrorKind::Refused, message, refusal.help);
                failure.code = refusal.code.unwrap_or_default();
                failure
            }
        }
    }
}

impl SlateError {
    pub(crate) fn new(failure: ClientFailure) -> Self {
        // SAFETY: `give` has just made it, and nobody else has it.
        let own = |text: String| unsafe { CString::from_raw(give(text)) };
        Self {
            kind: failure.kind,
            message: own(failure.message),
            help: own(failure.help),
            code: own(failure.code),
        }
    }
}

/// Returns the kind of an error.
///
/// # Safety
/// The error came from a call and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_error_kind(error: *const SlateError) -> SlateErrorKind {
    // SAFETY: passed on to the caller.
    unsafe { (*error).kind }
}

/// Returns what is wrong, until the error is freed.
///
/// # Safety
/// As for `slate_error_kind`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_error_message(error: *const SlateError) -> *const c_char {
    // SAFETY: passed on to the caller.
    unsafe { (*error).message.as_ptr() }
}

/// Returns what to do, until the error is freed; empty without advice.
///
/// # Safety
/// As for `slate_error_kind`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_error_help(error: *const SlateError) -> *const c_char {
    // SAFETY: passed on to the caller.
    unsafe { (*error).help.as_ptr() }
}

/// Returns the code of an error, such as `S004`, until the error is freed.
/// `slate explain` describes it; empty without one.
///
/// # Safety
/// As for `slate_error_kind`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_error_code(error: *const SlateError) -> *const c_char {
    // SAFETY: passed on to the caller.
    unsafe { (*error).code.as_ptr() }
}

/// Frees an error; null is allowed.
///
/// # Safety
/// `error` is null, or came from a call and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_error_free(error: *mut SlateError) {
    if !error.is_null() {
        // SAFETY: a call has made it as a box.
        drop(unsafe { Box::from_raw(error) });
    }
}

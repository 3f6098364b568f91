//! Answers of the agent, and why it refuses.

use std::path::Path;

use serde::Serialize;
use slate_blackboard::{BoardError, Stamp, interface};
use slate_runtime::configuration::{Diagnostic, Report};
use slate_runtime::recording::RecordingRefusal;
use slate_runtime::snapshot::SnapshotError;
use slate_runtime::{ControlsError, ErrorCode, Message, PluginError};

use crate::entries::{Reading, Refusal};

/// Result of a call.
pub type Done = Result<serde_json::Value, Refusal>;

/// Hint on where to find the names that are known.
pub(crate) const KNOWN: &str = "`slate list` shows the properties; ports, params, enabled, state and timing of modules are below their names";

pub(super) fn result(value: impl Serialize) -> Done {
    serde_json::to_value(value)
        .map_err(|error| refusal(format!("the answer can't be written: {error}"), "ask for less of it"))
}

/// Returns an absolute path, or refuses a relative one.
/// The agent's own folder is not that of the tool.
pub(crate) fn absolute(file: &Path) -> Result<&Path, Refusal> {
    if file.is_absolute() {
        return Ok(file);
    }
    Err(refusal(format!("{} is a relative path", slate_runtime::printable(file)), "give its absolute path"))
}

pub(crate) fn no_playback() -> Refusal {
    refusal("the agent plays no recording", "start one that does: slate replay FILE; or name it with --agent")
}

pub(crate) fn no_recorder() -> Refusal {
    let help = "`slate run` has one; a program gives its agent one with `Options::recording`";
    refusal("this agent has nothing that records", help)
}

pub(crate) fn refusal(message: impl Into<Message>, help: &str) -> Refusal {
    let Message { text, error_code } = message.into();
    Refusal { message: text, help: help.into(), code: code(error_code), report: None }
}

fn code(error_code: Option<ErrorCode>) -> Option<String> {
    error_code.map(|error_code| error_code.code().to_owned())
}

/// Creates the refusal of an unknown name.
/// `help` applies if no known name is similar either.
pub(super) fn unknown(what: &str, name: &str, names: &[String], help: &str) -> Refusal {
    let near = slate_blackboard::nearest_names(name, names.iter().map(String::as_str)).join(" or ");
    let help = if near.is_empty() { help.into() } else { format!("did you mean {near}?") };
    refusal(ErrorCode::Name.of(format!("no {what} is called `{name}`")), &help)
}

impl From<Report> for Refusal {
    fn from(report: Report) -> Self {
        let diagnostics = report.diagnostics();
        // Of several, each has its help beside it.
        let line = |one: &Diagnostic| match one.help_text() {
            Some(help) => format!("{} ({help})", one.placed()),
            None => one.placed(),
        };
        let (message, help) = match diagnostics {
            [one] => (one.placed(), one.help_text().unwrap_or_default().to_owned()),
            several => (several.iter().map(line).collect::<Vec<_>>().join("\n"), String::new()),
        };
        let is_written = diagnostics.iter().any(Diagnostic::is_written);
        let report_text = is_written.then(|| report.render(false));
        Self { message, help, code: code(report.error_code()), report: report_text }
    }
}

impl From<PluginError> for Refusal {
    fn from(error: PluginError) -> Self {
        match error {
            PluginError::Unfit(report) => report.into(),
            other => {
                let help = miette::Diagnostic::help(&other).map(|help| help.to_string());
                let message = Message { text: other.to_string(), error_code: other.error_code() };
                refusal(message, &help.unwrap_or_default())
            }
        }
    }
}

impl From<ControlsError> for Refusal {
    fn from(error: ControlsError) -> Self {
        let (error_code, help) = match &error {
            ControlsError::Unknown { .. } => (ErrorCode::Name, "name one of them"),
            ControlsError::Taken { .. } => {
                (ErrorCode::Held, "wait until they are released; `slate api GET /leases` shows the holders")
            }
        };
        refusal(error_code.of(error.to_string()), help)
    }
}

impl From<RecordingRefusal> for Refusal {
    fn from(refused: RecordingRefusal) -> Self {
        refusal(refused.message, &refused.help)
    }
}

impl From<SnapshotError> for Refusal {
    fn from(error: SnapshotError) -> Self {
        match error {
            SnapshotError::Configuration(report) => report.into(),
            other => {
                let help = miette::Diagnostic::help(&other).map(|help| help.to_string());
                refusal(other.to_string(), &help.unwrap_or_default())
            }
        }
    }
}

impl From<BoardError> for Refusal {
    fn from(error: BoardError) -> Self {
        refusal(
            Message::from(&error),
            "name a module of the agent; one that a link switches can't be switched by hand",
        )
    }
}

pub(super) fn reading((value, stamp): (interface::Value, Stamp)) -> Reading {
    let value = serde_json::to_value(value).unwrap_or_default();
    Reading { value, sequence: stamp.sequence, time: stamp.time }
}

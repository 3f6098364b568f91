//! Errors on stderr, for people and for programs.

use std::io::IsTerminal;

use serde_json::{Value, json};
use slate_runtime::ErrorCode;
use slate_runtime::configuration::Report;

use crate::finding::ConfigurationFinding;
use crate::output;

/// Printed error: message, advice, code and exit code.
pub struct PrintedError<'a> {
    /// Message.
    pub message: String,
    /// Advice; may be empty.
    pub help: Option<String>,
    /// Error code, which `slate explain` describes.
    pub error_code: Option<ErrorCode>,
    /// Exit code of the program.
    pub exit: u8,
    /// Errors of a configuration, which are printed in place of the message.
    pub report: Option<&'a Report>,
}

impl PrintedError<'_> {
    /// Prints the error to stderr: message, place and help.
    pub fn print(&self) {
        if output::is_json() {
            return eprintln!("{}", self.document());
        }
        if let Some(report) = self.report {
            return eprint!("{}", report.render(output::has_color(&std::io::stderr())));
        }
        eprintln!("error: {}", output::harmless(&self.message));
        if let Some(help) = self.help.as_ref().filter(|help| !help.is_empty()) {
            eprintln!("  help: {}", output::harmless(help));
        }
        if let Some(error_code) = self.error_code.filter(|_| std::io::stderr().is_terminal()) {
            eprintln!("  more: slate explain {}", error_code.code());
        }
    }

    /// Returns the error as a JSON document.
    fn document(&self) -> Value {
        let diagnostics = self.report.map(Report::diagnostics).unwrap_or_default();
        let findings: Vec<_> =
            diagnostics.iter().map(|one| ConfigurationFinding::new("error", one)).collect();
        let help = match self.report {
            Some(_) => findings.iter().find_map(|one| one.help.clone()),
            None => self.help.clone(),
        };
        json!({
            "schema": "slate.error/1", "code": self.error_code.map(ErrorCode::code), "message": self.message,
            "help": help.filter(|help| !help.is_empty()), "exit": self.exit, "findings": findings,
        })
    }
}

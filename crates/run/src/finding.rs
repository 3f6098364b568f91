//! Findings about a configuration, as JSON shows them.

use serde::Serialize;
use slate_runtime::ErrorCode;
use slate_runtime::configuration::Diagnostic;

/// Error or a warning about a configuration.
#[derive(Debug, Serialize)]
pub struct ConfigurationFinding {
    /// `error` or `warning`.
    pub severity: &'static str,
    /// Code that `slate explain` describes; empty for none.
    pub code: &'static str,
    /// Message.
    pub message: String,
    /// Advice.
    pub help: Option<String>,
    /// File of the setting.
    pub file: Option<String>,
    /// Line in the file, from 1.
    pub line: Option<usize>,
}

impl ConfigurationFinding {
    /// Returns a diagnostic as a finding of that severity.
    pub fn new(severity: &'static str, diagnostic: &Diagnostic) -> Self {
        Self {
            severity,
            code: diagnostic.error_code().map_or("", ErrorCode::code),
            message: diagnostic.message().into(),
            help: diagnostic.help_text().map(String::from),
            file: diagnostic.source_name().map(String::from),
            line: diagnostic.line(),
        }
    }
}

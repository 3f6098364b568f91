//! Findings about a configuration, as JSON shows them.

use serde::Serialize;
use slate::runtime::Mistake;
use slate::runtime::configuration::Diagnostic;

/// An error or a warning about a configuration.
#[derive(Debug, Serialize)]
pub struct ConfigurationFinding {
    pub severity: &'static str,
    pub code: &'static str,
    pub message: String,
    pub help: Option<String>,
    pub file: Option<String>,
    pub line: Option<usize>,
}

impl ConfigurationFinding {
    /// Returns a diagnostic as a finding of that severity.
    pub fn new(severity: &'static str, diagnostic: &Diagnostic) -> Self {
        Self {
            severity,
            code: diagnostic.mistake().map_or("", Mistake::code),
            message: diagnostic.message().into(),
            help: diagnostic.help_text().map(String::from),
            file: diagnostic.source_name().map(String::from),
            line: diagnostic.line(),
        }
    }
}

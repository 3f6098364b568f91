//! Error of making links now.

use slate_configuration::{Diagnostic, Report};

/// Error of links that differ from the configuration.
pub(in crate::agent) struct Unlinked {
    pub report: Report,
    /// Module, or the main loop, that has not returned, if that is the only cause.
    pub late: Option<String>,
}

impl From<Report> for Unlinked {
    fn from(report: Report) -> Self {
        Self { report, late: None }
    }
}

impl Unlinked {
    pub fn late(name: &str) -> Self {
        let message = format!("`{name}` has not returned from its last call, so no link can change now");
        let help = "try again when it has; `slate module list` shows how it is";
        Self { report: Diagnostic::without_place(message, Some(help.into())).into(), late: Some(name.into()) }
    }

    /// Returns the reason for which a link is not made yet.
    pub fn reason(&self) -> String {
        match &self.late {
            Some(name) => format!("`{name}` has not returned from its last call"),
            None => self.report.to_string(),
        }
    }
}

//! Why links can't be made now.

use slate_configuration::{Diagnostic, Report};

/// Why the links are not those of the configuration.
pub(in crate::agent) struct Unlinked {
    pub report: Report,
    /// What has not returned, if that is all: a module, or the main loop.
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

    /// Why a link is not made yet.
    pub fn reason(&self) -> String {
        match &self.late {
            Some(name) => format!("`{name}` has not returned from its last call"),
            None => self.report.to_string(),
        }
    }
}

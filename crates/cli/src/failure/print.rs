//! Errors on stderr, for people and for programs.

use slate::control::{ClientError, Refusal};
use slate_run::PrintedError;

use super::{Failure, usage};
use crate::output;

impl Failure {
    /// Prints the failure to stderr: message, place and help.
    pub fn print(&self) {
        match self {
            Self::Words(error) if !output::is_json() => {
                // A closed stderr leaves no place to report to.
                let _ = error.print();
                if let Some(help) = usage::suggested_verb(error) {
                    eprintln!("  help: {help}");
                }
            }
            Self::Agent(ClientError::Refused(Refusal { report: Some(report), .. })) if !output::is_json() => {
                eprint!("{report}");
            }
            #[cfg(feature = "missions")]
            Self::Golog(error) if !output::is_json() => eprintln!("error: {}", error.render()),
            other => other.printed().print(),
        }
    }

    fn printed(&self) -> PrintedError<'_> {
        let report = match self {
            Self::Configuration(report) => Some(report),
            _ => None,
        };
        let (message, help) = (self.to_string(), self.help());
        PrintedError { message, help, error_code: self.error_code(), exit: self.code(), report }
    }
}

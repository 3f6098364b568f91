//! Errors on stderr, for people and for programs.

use std::io::IsTerminal;

use serde_json::{Value, json};
use slate::control::{ClientError, Refusal};
use slate::runtime::Mistake;

use super::{Failure, usage};
use crate::finding::ConfigurationFinding;
use crate::output;

impl Failure {
    /// Prints to stderr what is wrong, where, and what to do.
    pub fn print(&self) {
        if output::is_json() {
            return eprintln!("{}", self.document());
        }
        let colour = output::has_colour(&std::io::stderr());
        match self {
            Self::Words(error) => {
                // A closed stderr leaves no place to report to.
                let _ = error.print();
                if let Some(help) = usage::instead(error) {
                    eprintln!("  help: {help}");
                }
            }
            Self::Configuration(report) => eprint!("{}", report.render(colour)),
            Self::Agent(ClientError::Refused(Refusal { report: Some(report), .. })) => eprint!("{report}"),
            other => {
                eprintln!("error: {}", output::harmless(other));
                if let Some(help) = other.help().filter(|help| !help.is_empty()) {
                    eprintln!("  help: {}", output::harmless(help));
                }
                if let Some(mistake) = other.mistake().filter(|_| std::io::stderr().is_terminal()) {
                    eprintln!("  more: slate explain {}", mistake.code());
                }
            }
        }
    }

    /// Returns the error as a JSON document.
    fn document(&self) -> Value {
        let (mut help, mut findings) = (self.help(), Vec::new());
        if let Self::Configuration(report) = self {
            findings.extend(report.diagnostics().iter().map(|one| ConfigurationFinding::new("error", one)));
            help = findings.iter().find_map(|one| one.help.clone());
        }
        json!({
            "schema": "slate.error/1", "code": self.mistake().map(Mistake::code), "message": self.to_string(),
            "help": help.filter(|help| !help.is_empty()), "exit": self.code(), "findings": findings,
        })
    }
}

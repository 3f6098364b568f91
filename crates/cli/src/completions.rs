//! Shell's side of completion.

use clap::{CommandFactory, ValueEnum};
use clap_complete::env::{CompleteEnv, Shells};

use crate::arguments::Arguments;
use crate::complete::Shell;
use crate::failure::Failure;
use crate::output;

/// Variable by which a shell asks this program for candidates.
const COMPLETION_VARIABLE: &str = "SLATE_COMPLETE";

/// Answers a shell's completion request, and ends the process.
/// Returns if no shell asks.
pub fn answer() {
    CompleteEnv::with_factory(Arguments::command).var(COMPLETION_VARIABLE).complete();
}

/// Prints the script that makes a shell request candidates.
pub fn completions(shell: Shell) -> Result<bool, Failure> {
    let name = shell.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
    let (shells, mut script) = (Shells::builtins(), Vec::new());
    let failed = |source| Failure::File { path: "completions".into(), source };
    if let Some(completer) = shells.completer(&name) {
        completer
            .write_registration(COMPLETION_VARIABLE, "slate", "slate", "slate", &mut script)
            .map_err(failed)?;
    }
    output::line(String::from_utf8_lossy(&script).trim_end());
    Ok(true)
}

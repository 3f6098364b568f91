//! Reading of all agents that a file describes.

use slate_sorted::SortedSet;

use super::files::Files;
use super::read::{Main, ReadOutcome, ReadRequest, layers, read};
use super::{Diagnostic, Options, Report, report};

/// Reads a configuration, and checks the file's other agents.
/// These may be started on other machines.
pub(super) fn read_all(main: &Main, options: &Options) -> ReadOutcome {
    let mut read_one = read(&ReadRequest::new(main, options), Files::default());
    let mut said = SortedSet::new();
    let mut diagnostics: Vec<Diagnostic> = Vec::new();
    let mut add = |report: &Report| {
        // An error outside of `agents` is one of all of them.
        let new = report.diagnostics().iter().filter(|diagnostic| said.insert(diagnostic.in_a_line()));
        diagnostics.extend(new.cloned());
    };
    if let Err(report) = &read_one.result {
        add(report);
    }
    for other in &read_one.others {
        // The command line and the file of this machine are for the one that is started here.
        let options = Options { agent: Some(other.clone()), sets: Vec::new(), host: None, ..options.clone() };
        let request = ReadRequest { elsewhere: true, ..ReadRequest::new(main, &options) };
        match (read(&request, read_one.files.clone()).result, &read_one.result) {
            (Err(report), _) => add(&report),
            (Ok(configuration), Ok(own)) if configuration.agent_name() == own.agent_name() => {
                let message = format!("two agents are called `{}`", own.agent_name());
                let help = "an agent is found by its name; leave `agent.name` out, and each is called like its table";
                let name = &configuration.agent.name;
                add(&configuration.diagnostic(name.span, message, Some(help.into())).into());
            }
            _ => {}
        }
    }
    if !diagnostics.is_empty() {
        read_one.result = Err(diagnostics.into());
    }
    read_one
}

/// Returns the names of the agents that a file describes.
pub(super) fn names(main: &Main, options: &Options) -> Result<Vec<String>, Report> {
    let layers = layers(&ReadRequest::new(main, options), Files::default());
    if layers.incomplete {
        return Err(report(&layers.sources, layers.problems));
    }
    Ok(layers.agents.known.into_keys().collect())
}

//! Verb that runs an application.

use slate::runtime::snapshot::Snapshot;
use slate_run::{Application, RunContext, Supervision};

use crate::deployment::{self, SupervisorConnection, end_later};
use crate::examples;
use crate::failure::Failure;
use crate::run_options::RunVerb;

/// Runs an application once, or all agents of a file; returns the exit code.
pub fn run(verb: &RunVerb) -> Result<u8, Failure> {
    let options = &verb.options;
    let agents = match &verb.name {
        Some(name) => examples::agents(name, options.common.host.as_deref())?,
        None => Vec::new(),
    };
    if verb.agent.is_none() && !agents.is_empty() {
        return deployment::run(verb, &agents);
    }
    let supervisor_connection = verb.supervised.then(SupervisorConnection::new).transpose()?;
    let supervision = supervisor_connection.map(|mut supervisor_connection| Supervision {
        wait: Box::new(move || supervisor_connection.wait()),
        end_later,
    });
    let snapshot = options.resume.as_ref().map(Snapshot::read).transpose()?;
    let application = application(verb, snapshot.as_ref())?;
    let context =
        RunContext { snapshot, has_team: !agents.is_empty(), is_watched: verb.watched, supervision };
    Ok(slate_run::run(application, options, context)?)
}

/// Finds the application to run.
/// It is an example, a configuration file, or the application of a snapshot.
fn application(verb: &RunVerb, snapshot: Option<&Snapshot>) -> Result<Application, Failure> {
    let RunVerb { name, agent, options, .. } = verb;
    let (defaults, sets) = (options.defaults(), options.sets());
    let found = match (name, snapshot) {
        // The snapshot has what suited the terminal of the other run.
        (None, Some(snapshot)) => examples::of(snapshot, [defaults, sets].concat()),
        (name, _) => {
            let (name, host) = (name.as_deref().unwrap_or_default(), options.common.host.as_deref());
            examples::find(name, agent.as_deref(), defaults, sets, host)
        }
    };
    Ok(found?)
}

//! Agents of this machine.

use serde::Serialize;
use serde_json::json;
use slate::control::{Client, ClientError};

use crate::failure::Failure;
use crate::gates::HeldActuators;
use crate::local_agents::query_all;
use crate::process::ProcessInfo;
use crate::{duration, output};

/// Agent that runs here.
#[derive(Debug, Serialize)]
struct AgentRow {
    agent: String,
    process: Option<ProcessInfo>,
    /// Number of modules, and of those in an unintended state.
    modules: Option<(usize, usize)>,
    /// Cycles of the main loop.
    cycles: Option<u64>,
    /// End of its run; none while it runs.
    over: Option<String>,
    /// Actuators that let no command through.
    #[serde(flatten)]
    held: HeldActuators,
    /// Reason why it can't be queried.
    trouble: Option<String>,
}

/// State that an agent reports.
#[derive(Default)]
struct AgentStatus {
    modules: Option<(usize, usize)>,
    cycles: Option<u64>,
    over: Option<String>,
    held: HeldActuators,
}

/// Lists them.
pub fn ps(json: bool) -> Result<bool, Failure> {
    let rows: Vec<_> =
        query_all(|name| Client::connect(name).and_then(|mut client| agent_status(&mut client)))
            .into_iter()
            .map(|(agent, answer)| {
                let process = ProcessInfo::of(&agent);
                let (answer, trouble) = match answer {
                    Some(Ok(answer)) => (answer, None),
                    Some(Err(error)) => (AgentStatus::default(), Some(error.to_string())),
                    None => (AgentStatus::default(), Some("no answer".into())),
                };
                let AgentStatus { modules, cycles, over, held } = answer;
                AgentRow { agent, process, modules, cycles, over, held, trouble }
            })
            .collect();
    if json {
        output::json(&json!({"schema": "slate.ps/1", "agents": rows}));
        return Ok(true);
    }
    if rows.is_empty() {
        eprintln!("no agent of this user runs on this machine; `slate run exp1` starts one");
        return Ok(true);
    }
    let dash = || "-".to_owned();
    let head = ["agent", "process", "memory", "up", "cycles", "modules", "state"].map(String::from);
    let row = |row: &AgentRow| {
        let process = row.process.as_ref();
        [
            row.agent.clone(),
            process.map_or_else(dash, |process| process.id.to_string()),
            process
                .and_then(|process| process.memory)
                .map_or_else(dash, |bytes| duration::bytes(bytes as f64)),
            process.and_then(|process| process.uptime).map_or_else(dash, |time| format!("{time:.0} s")),
            row.cycles.map_or_else(dash, |cycles| cycles.to_string()),
            row.modules.map_or_else(dash, |(all, _)| all.to_string()),
            state(row),
        ]
    };
    output::columns([head].into_iter().chain(rows.iter().map(row)));
    Ok(true)
}

/// Returns the state of an agent in words.
fn state(row: &AgentRow) -> String {
    if let Some(trouble) = &row.trouble {
        return trouble.clone();
    }
    let ill = row.modules.map_or(0, |(_, ill)| ill);
    let ill = (ill > 0).then(|| format!("{ill} faulty"));
    // The actuators of a run that is over have no driver any more.
    let words: Vec<_> = match &row.over {
        Some(how) => vec![format!("run over: {how}")],
        None => row.held.words().into_iter().chain(ill).collect(),
    };
    if words.is_empty() { "ok".into() } else { words.join("; ") }
}

fn agent_status(client: &mut Client) -> Result<AgentStatus, ClientError> {
    let modules = client.modules()?;
    let ill = modules.iter().filter(|module| !matches!(module.condition.as_str(), "WORKING" | "INACTIVE"));
    let cycles = client.read("/loop/histogram/count")?;
    Ok(AgentStatus {
        modules: Some((modules.len(), ill.count())),
        cycles: cycles.and_then(|reading| reading.value.as_u64()),
        over: client.run_end()?,
        held: HeldActuators::of(client)?,
    })
}

//! The agents of this machine.

use serde::Serialize;
use serde_json::json;
use slate::control::{Client, ClientError};

use crate::connection::ask_all;
use crate::failure::Failure;
use crate::process::Process;
use crate::{duration, output};

/// An agent that runs here.
#[derive(Debug, Serialize)]
struct Row {
    agent: String,
    process: Option<Process>,
    /// How many modules it has, and how many of them are not as intended.
    modules: Option<(usize, usize)>,
    /// Cycles of the main loop.
    cycles: Option<u64>,
    /// Why it can't be asked.
    trouble: Option<String>,
}

/// Lists them.
pub fn ps(json: bool) -> Result<bool, Failure> {
    let rows: Vec<_> = ask_all(|name| Client::connect(name).and_then(|mut client| look(&mut client)))
        .into_iter()
        .map(|(agent, answer)| {
            let process = Process::of(&agent);
            let (modules, cycles, trouble) = match answer {
                Some(Ok((modules, cycles))) => (Some(modules), cycles, None),
                Some(Err(error)) => (None, None, Some(error.to_string())),
                None => (None, None, Some("it does not answer".into())),
            };
            Row { agent, process, modules, cycles, trouble }
        })
        .collect();
    if json {
        output::json(&json!({"schema": "slate.ps/1", "agents": rows}));
        return Ok(true);
    }
    if rows.is_empty() {
        eprintln!("no agent of this user runs here");
        return Ok(true);
    }
    let dash = || "-".to_owned();
    let head = ["agent", "process", "memory", "up", "cycles", "modules", "state"].map(String::from);
    let row = |row: &Row| {
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
            match (&row.trouble, row.modules) {
                (Some(trouble), _) => trouble.clone(),
                (None, Some((_, ill))) if ill > 0 => format!("{ill} not as intended"),
                _ => "ok".into(),
            },
        ]
    };
    output::columns([head].into_iter().chain(rows.iter().map(row)));
    Ok(true)
}

fn look(client: &mut Client) -> Result<((usize, usize), Option<u64>), ClientError> {
    let modules = client.modules()?;
    let ill = modules.iter().filter(|module| !matches!(module.condition.as_str(), "WORKING" | "INACTIVE"));
    let cycles = client.read("/loop/histogram/count")?;
    Ok(((modules.len(), ill.count()), cycles.and_then(|reading| reading.value.as_u64())))
}

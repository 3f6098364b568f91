use std::path::PathBuf;

use clap::Subcommand;
use serde_json::json;
use slate::control::SnapshotEntry;
use slate::runtime::snapshot::Snapshot;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum SnapshotVerb {
    /// Save the state of an agent, to be loaded or resumed
    Save {
        /// File
        file: PathBuf,
        /// Save the newest values of a peer's properties as JSON instead,
        /// such as `slate://robot/**`
        #[arg(long, value_name = "URL")]
        of: Option<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Restore an agent from its snapshot; real actuators are disarmed
    Load {
        /// File
        file: PathBuf,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Show the contents of a snapshot
    Info {
        /// File
        file: PathBuf,
        /// Print as JSON
        #[arg(long, conflicts_with = "configuration")]
        json: bool,
        /// Print the configuration
        #[arg(long)]
        configuration: bool,
    },
}

/// Runs the command; returns true, as a refusal is a failure.
pub fn snapshot(verb: &SnapshotVerb) -> Result<bool, Failure> {
    match verb {
        SnapshotVerb::Save { file, of: Some(url), agent } => {
            let saved = agent.connect_beside(url)?.save_remote(url, &agent.file(file)?)?;
            let unavailable = match saved.unavailable {
                0 => String::new(),
                unavailable => format!("; {unavailable} could not be read, the file says why"),
            };
            output::line(format_args!(
                "{} has {} values of {} properties of agent {}{unavailable}",
                file.display(),
                saved.values,
                saved.properties,
                saved.agent
            ));
        }
        SnapshotVerb::Save { file, of: None, agent } => {
            let saved = agent.connect()?.save_snapshot(&agent.file(file)?)?;
            output::line(format_args!("{} has {}", file.display(), moment(&saved)));
        }
        SnapshotVerb::Load { file, agent } => {
            let loaded = agent.connect()?.load_snapshot(&agent.file(file)?)?;
            output::line(format_args!("restored {}", moment(&loaded)));
        }
        SnapshotVerb::Info { file, json, configuration } => {
            let snapshot = Snapshot::read(file)?;
            match (json, configuration) {
                (_, true) => output::line(snapshot.configuration_text().trim_end()),
                (true, _) => output::document("slate.snapshot/1", &value(&snapshot)),
                _ => show(&snapshot),
            }
        }
    }
    Ok(true)
}

fn moment(entry: &SnapshotEntry) -> String {
    let seconds = entry.time as f64 * 1e-9;
    format!("agent {} at {seconds:.3} s, after cycle {}", entry.agent, entry.cycle)
}

fn value(snapshot: &Snapshot) -> serde_json::Value {
    let plugins: Vec<_> = snapshot.plugins().iter().map(|plugin| json!(plugin)).collect();
    let modules: Vec<_> = snapshot
        .modules()
        .map(|(name, kind, ticks)| json!({ "name": name, "kind": kind, "ticks": ticks }))
        .collect();
    json!({
        "agent": snapshot.agent(),
        "time": snapshot.time(),
        "cycle": snapshot.cycle(),
        "plugins": plugins,
        "modules": modules,
        "properties": snapshot.properties(),
        "messages": snapshot.messages(),
    })
}

fn show(snapshot: &Snapshot) {
    let seconds = snapshot.time() as f64 * 1e-9;
    output::line(format_args!("agent       {}", snapshot.agent()));
    output::line(format_args!("time        {seconds:.3} s, after cycle {}", snapshot.cycle()));
    output::line(format_args!("properties  {}", snapshot.properties()));
    output::line(format_args!("messages    {} that wait", snapshot.messages()));
    output::line("");
    let head = ["plugin", "version", "hash", "library"].map(String::from);
    let plugins = snapshot.plugins().iter().map(|plugin| {
        let library = plugin.file.as_ref().map_or("linked in".into(), |file| file.display().to_string());
        [plugin.name.clone(), plugin.version.clone(), format!("{:016x}", plugin.hash), library]
    });
    output::columns([head].into_iter().chain(plugins));
    output::line("");
    let head = ["module", "kind", "ticks"].map(String::from);
    let modules = snapshot.modules().map(|(name, kind, ticks)| [name.into(), kind.into(), ticks.to_string()]);
    output::columns([head].into_iter().chain(modules));
}

use clap::Subcommand;
use serde_json::json;
use slate::control::{Changed, ClientError, Different};
use slate::runtime::configuration::{SaveTo, parse_change};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum ConfigVerb {
    /// Shows settings of a running agent, and where each is written.
    Get {
        /// A path, such as `modules.follower` or `robots.r2`; everything unless given.
        path: Option<String>,
        /// Prints the settings as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Changes settings while the agent runs, all or none of them.
    Set {
        /// Settings, such as `modules.follower.params.gain=2.5`.
        #[arg(value_name = "PATH=VALUE", required = true)]
        settings: Vec<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Takes back what was changed while the agent ran and not saved.
    Revert {
        /// A path, such as `modules.follower.params`; all changes unless given.
        path: Option<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Shows what holds and is not what the files say.
    Diff {
        /// Prints the differences as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Writes what was changed while the agent ran into its files; comments and order stay.
    Save {
        /// Writes all of it into the file of this computer, which `slate run --host` named.
        #[arg(long)]
        host: bool,
        /// Writes the links too that nobody has written, as types and roles leave no choice.
        #[arg(long)]
        expanded: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Does what is asked; true, as what is refused is a failure.
pub fn config(verb: &ConfigVerb) -> Result<bool, Failure> {
    match verb {
        ConfigVerb::Get { path, json, agent } => get(agent, path.as_deref().unwrap_or_default(), *json)?,
        ConfigVerb::Set { settings, agent } => set(agent, settings)?,
        ConfigVerb::Revert { path, agent } => {
            show_changes(&agent.connect()?.revert(path.as_deref().unwrap_or_default())?);
        }
        ConfigVerb::Diff { json, agent } => diff(agent, *json)?,
        ConfigVerb::Save { host, expanded, agent } => save(agent, *host, *expanded)?,
    }
    Ok(true)
}

fn get(agent: &AgentOption, path: &str, json: bool) -> Result<(), Failure> {
    let settings = agent.connect()?.settings(path)?;
    if json {
        output::document("slate.config/1", &json!({ "settings": settings }));
        return Ok(());
    }
    let row = |setting: slate::control::SettingEntry| {
        [format!("{} = {}", setting.path, setting.text), format!("# {}", setting.origin)]
    };
    output::columns(settings.into_iter().map(row));
    Ok(())
}

fn set(agent: &AgentOption, settings: &[String]) -> Result<(), Failure> {
    // What can't be read is the caller's mistake, not the agent's refusal.
    let changes = settings.iter().map(|setting| parse_change(setting)).collect::<Result<Vec<_>, _>>()?;
    show_changes(&agent.connect()?.set(&changes)?);
    Ok(())
}

/// Says what has changed.
pub fn show_changes(changed: &[Changed]) {
    if changed.is_empty() {
        output::line("nothing changes: all is as it should be");
    }
    for Changed { path, before, after, default, needs_reload, .. } in changed {
        let text = |value: &Option<String>| {
            let default = default.as_ref().map(|default| format!("{default} (default)"));
            value.clone().or(default).unwrap_or_else(|| "none".into())
        };
        output::line(format_args!("{path}: {} -> {}", text(before), text(after)));
        if let Some(plugin) = needs_reload {
            crate::module::show_reload(plugin);
        }
    }
}

fn diff(agent: &AgentOption, json: bool) -> Result<(), Failure> {
    let mut client = agent.connect()?;
    let differences = client.differences()?;
    if json {
        output::document("slate.config.diff/1", &json!({ "differences": differences }));
    } else {
        differences.iter().for_each(show);
    }
    if let Some(refusal) = client.refused_edit()? {
        eprintln!("a file was edited and is refused; what it said before goes on:");
        return Err(ClientError::Refused(refusal).into());
    }
    Ok(())
}

fn show(difference: &Different) {
    let Different { path, file, present, origin, default } = difference;
    match (file, default) {
        (Some(file), _) => output::line(format_args!("- {path} = {file}")),
        (None, Some(default)) => output::line(format_args!("- {path} = {default}  # default")),
        (None, None) => {}
    }
    match (present, default) {
        (Some(present), _) => {
            let origin = origin.as_deref().unwrap_or_default();
            output::line(format_args!("+ {path} = {present}  # {origin}"));
        }
        (None, Some(default)) => output::line(format_args!("+ {path} = {default}  # default")),
        (None, None) => {}
    }
}

fn save(agent: &AgentOption, host: bool, expanded: bool) -> Result<(), Failure> {
    let mut client = agent.connect()?;
    if expanded {
        for link in client.links()?.into_iter().filter(|link| link.inferred) {
            client.link(&link.to, &link.from, &[], false)?;
            output::line(format_args!("\"/{}\" = \"{}\"", link.to, link.from));
        }
    }
    let saved = client.save(if host { SaveTo::Host } else { SaveTo::Origin })?;
    if saved.files.is_empty() {
        output::line("nothing to save: the files say it all");
    }
    saved.files.iter().for_each(|file| output::line(slate::runtime::printable(file)));
    Ok(())
}

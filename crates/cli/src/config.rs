use clap::Subcommand;
use serde_json::json;
use slate::control::{ClientError, SettingDifference};
use slate::runtime::configuration::{SaveTo, parse_change, robot_setting};

use crate::changes::show_changes;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum ConfigVerb {
    /// Show settings and their origin
    Get {
        /// Path, such as `modules.follower` or `robots.r2` [default: all]
        path: Option<String>,
        /// Print the settings as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Change settings of the running agent, all or none
    Set {
        /// Settings, such as `modules.follower.params.gain=2.5`
        #[arg(value_name = "PATH=VALUE", required = true)]
        settings: Vec<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Revert unsaved changes
    Revert {
        /// Path, such as `modules.follower.params` [default: all changes]
        path: Option<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Show the differences from the files
    Diff {
        /// Print the differences as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Save changes into the files; comments and order are kept
    Save {
        /// Save all changes into the file that `slate run --host` named
        #[arg(long)]
        host: bool,
        /// Also save the links that were inferred from types and roles
        #[arg(long)]
        expanded: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Runs the command; returns true, as a refusal is a failure.
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
    // An unreadable value is the caller's error, not the agent's refusal.
    let changes = settings.iter().map(|setting| parse_change(setting)).collect::<Result<Vec<_>, _>>()?;
    show_changes(&agent.connect()?.set(&changes)?);
    Ok(())
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
        eprintln!("an edited file is refused; its previous settings stay in force:");
        return Err(ClientError::Refused(refusal).into());
    }
    Ok(())
}

fn show(difference: &SettingDifference) {
    let SettingDifference { path, file, present, origin, default } = difference;
    let path = robot_setting(path);
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
        output::line("nothing to save: the files are up to date");
    }
    saved.files.iter().for_each(|file| output::line(slate::runtime::printable(file)));
    Ok(())
}

use clap::Subcommand;
use clap_complete::ArgValueCompleter;
use serde_json::json;
use slate::control::{Client, ClientError, Refusal};
use slate::runtime::ErrorCode;

use crate::changes::show_enable_result;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, output};

#[derive(Debug, Subcommand)]
pub enum ModuleVerb {
    /// List the modules with their state, ticks, overruns and crashes
    List {
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Show the documentation of a module, its ports and its parameters
    Describe {
        /// Name, such as `r2/planner`
        #[arg(add = ArgValueCompleter::new(complete::of_modules))]
        name: String,
        /// Print the documentation as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Enable a module
    Enable {
        /// Name, such as `r2/planner`
        #[arg(add = ArgValueCompleter::new(complete::of_modules))]
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Disable a module: it stops ticking, and its outputs take their safe values
    Disable {
        /// Name, such as `r2/planner`
        #[arg(add = ArgValueCompleter::new(complete::of_modules))]
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Runs the command; returns true, as a refusal is a failure.
pub fn module(verb: &ModuleVerb) -> Result<bool, Failure> {
    match verb {
        ModuleVerb::List { json, agent } => list(agent, *json)?,
        ModuleVerb::Describe { name, json, agent } => describe(agent, name, *json)?,
        ModuleVerb::Enable { name, agent } => switch(agent, name, true)?,
        ModuleVerb::Disable { name, agent } => switch(agent, name, false)?,
    }
    Ok(true)
}

fn switch(agent: &AgentOption, name: &str, on: bool) -> Result<(), Failure> {
    let mut client = agent.connect()?;
    let switched = client.enable(name, on).map_err(|error| unknown(&mut client, name, error))?;
    show_enable_result(name, on, switched);
    Ok(())
}

fn describe(agent: &AgentOption, name: &str, json: bool) -> Result<(), Failure> {
    let mut client = agent.connect()?;
    let module = client.describe(name).map_err(|error| unknown(&mut client, name, error))?;
    if json {
        output::document("slate.module.describe/1", &module);
        return Ok(());
    }
    output::line(&module.name);
    if !module.doc.is_empty() {
        output::line(format_args!("  {}", module.doc));
    }
    let ports = module
        .ports
        .into_iter()
        .map(|port| [format!("  {}", port.direction.to_lowercase()), port.name, port.interface, port.doc]);
    let parameters = module
        .parameters
        .into_iter()
        .map(|parameter| ["  parameter".into(), parameter.name, parameter.unit, parameter.doc]);
    output::columns(ports.chain(parameters));
    Ok(())
}

/// Returns the error of an unknown module, with the known ones.
fn unknown(client: &mut Client, name: &str, error: ClientError) -> Failure {
    let is_name = |refusal: &Refusal| refusal.code.as_deref() == Some(ErrorCode::Name.code());
    match error {
        ClientError::Refused(refusal) if is_name(&refusal) => match names(client) {
            Ok(known) => Failure::UnknownModule { name: name.trim_start_matches('/').into(), known },
            Err(_) => ClientError::Refused(refusal).into(),
        },
        other => other.into(),
    }
}

/// Returns the names of an agent's modules.
pub fn names(client: &mut Client) -> Result<Vec<String>, ClientError> {
    Ok(client.modules()?.into_iter().map(|module| module.name).collect())
}

fn list(agent: &AgentOption, json: bool) -> Result<(), Failure> {
    let modules = agent.connect()?.modules()?;
    if json {
        output::document("slate.module/1", &json!({ "modules": modules }));
        return Ok(());
    }
    let head = ["module", "condition", "ticks", "late", "crashes", "plugin", "shadow"].map(String::from);
    let row = |module: &slate::control::ModuleEntry| {
        let [ticks, misses, crashes] = [module.ticks, module.misses, module.panics].map(|n| n.to_string());
        let shadow = if module.has_shadow { "new code beside it" } else { "" };
        let [name, plugin] = [&module.name, &module.plugin].map(Clone::clone);
        let condition = match &module.waiting_for {
            Some(port) => format!("{} for {port}", module.condition),
            None => module.condition.clone(),
        };
        [name, condition, ticks, misses, crashes, plugin, shadow.into()]
    };
    output::columns([head].into_iter().chain(modules.iter().map(row)));
    Ok(())
}

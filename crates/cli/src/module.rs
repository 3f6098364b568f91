use clap::Subcommand;
use clap_complete::ArgValueCompleter;
use serde_json::json;
use slate::control::Switched;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, output};

#[derive(Debug, Subcommand)]
pub enum ModuleVerb {
    /// Lists the modules of a running agent, how they are, and how often they ticked, came late and crashed.
    List {
        /// Prints the list as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Switches a module on.
    Enable {
        /// Its name, such as `r2/planner`.
        #[arg(add = ArgValueCompleter::new(complete::of_modules))]
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Switches a module off: it ticks no more, and its outputs take their safe values.
    Disable {
        /// Its name, such as `r2/planner`.
        #[arg(add = ArgValueCompleter::new(complete::of_modules))]
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Does what is asked; true, as what is refused is a failure.
pub fn module(verb: &ModuleVerb) -> Result<bool, Failure> {
    match verb {
        ModuleVerb::List { json, agent } => list(agent, *json)?,
        ModuleVerb::Enable { name, agent } => switch(agent, name, true)?,
        ModuleVerb::Disable { name, agent } => switch(agent, name, false)?,
    }
    Ok(true)
}

fn switch(agent: &AgentOption, name: &str, on: bool) -> Result<(), Failure> {
    let switched = agent.connect()?.enable(name, on)?;
    show_switched(name, on, switched);
    Ok(())
}

/// Says how a module was switched.
fn show_switched(name: &str, on: bool, switched: Switched) {
    let (state, already) = (if on { "on" } else { "off" }, if switched.changed { "" } else { " already" });
    output::line(format_args!("{name} is {state}{already}"));
    if let Some(plugin) = switched.needs_reload {
        show_reload(&plugin);
    }
}

/// Says how a module begins again that has failed for good.
pub fn show_reload(plugin: &str) {
    output::line(format_args!(
        "it has failed for good, so it begins when its plugin is reloaded: slate plugin reload {plugin}"
    ));
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

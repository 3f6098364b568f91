mod info;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use serde_json::json;
use slate::runtime::remote::{LoadedPlugin, PluginEntry, Reloaded};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::new::{self, Template};
use crate::output;

#[derive(Debug, Subcommand)]
pub enum PluginVerb {
    /// Writes a crate with a module, its test, and a configuration that runs it in the simulator.
    New {
        /// What it is called; a folder of that name is made here.
        name: String,
        /// The folder of Slate's sources; found by itself when this program was built there.
        #[arg(long, value_name = "PATH")]
        slate: Option<PathBuf>,
    },
    /// Shows what a plugin's library offers and needs; the library is not opened.
    Info {
        /// The library, such as `target/debug/libfollower.so`.
        file: PathBuf,
        /// Prints it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Seals a plugin's library with a checksum, for its way to a robot: no agent opens it when a byte of it has changed.
    Seal {
        /// The library.
        file: PathBuf,
    },
    /// Lists the plugins of a running agent.
    List {
        /// Prints the list as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Loads a plugin of the configuration, or a library, into a running agent.
    Load {
        /// A plugin or a list of plugins of the configuration, or the file of a library.
        #[arg(value_name = "NAME|FILE")]
        plugin: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Unloads a plugin: its modules end, and their outputs take their safe values.
    Unload {
        /// Its name, or that of a list of plugins.
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Exchanges the code of a plugin between two ticks; states are carried over where they fit.
    Reload {
        /// Its name.
        name: String,
        /// The library with the new code; that which it came from unless given.
        file: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Runs new code beside that of a plugin: it makes the same steps, and what it writes is compared and thrown away.
    /// Without a file, shows how the new code compares.
    Shadow {
        /// Its name.
        name: String,
        /// The library with the new code.
        file: Option<PathBuf>,
        /// Ends the new code.
        #[arg(long, conflicts_with = "file")]
        end: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Lets the new code beside a plugin take over, with the states that it has by now.
    Promote {
        /// Its name.
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Does what is asked; true, as what is refused is a failure.
pub fn plugin(verb: &PluginVerb) -> Result<bool, Failure> {
    match verb {
        PluginVerb::New { name, slate } => {
            new::write(name, Template::Plugin, slate.as_deref())?;
            new::tell(name, Template::Plugin);
        }
        PluginVerb::Info { file, json } => info::info(file, *json)?,
        PluginVerb::Seal { file } => {
            let is_new = slate::runtime::plugin::seal(file)?;
            let what = if is_new { "is sealed" } else { "was sealed already, and is as it was then" };
            output::line(format_args!("{} {what}", slate::runtime::printable(file)));
        }
        PluginVerb::List { json, agent } => list(agent, *json)?,
        PluginVerb::Load { plugin, agent } => load(agent, plugin)?,
        PluginVerb::Unload { name, agent } => {
            for unloaded in agent.connect()?.unload(name)? {
                output::line(format_args!(
                    "{} is unloaded; its library is {}",
                    unloaded.name, unloaded.library
                ));
            }
        }
        PluginVerb::Reload { name, file, agent } => reload(agent, name, file.as_deref())?,
        PluginVerb::Shadow { name, end: true, agent, .. } => {
            agent.connect()?.end_shadow(name)?;
            output::line(format_args!("{name} runs alone again"));
        }
        PluginVerb::Shadow { name, file, agent, .. } => shadow(agent, name, file.as_deref())?,
        PluginVerb::Promote { name, agent } => say(&agent.connect()?.promote(name)?),
    }
    Ok(true)
}

fn list(agent: &AgentOption, json: bool) -> Result<(), Failure> {
    let plugins = agent.connect()?.plugins()?;
    if json {
        output::document("slate.plugin/1", &json!({ "plugins": plugins }));
        return Ok(());
    }
    let head = ["plugin", "version", "library", "modules", "shadow"].map(String::from);
    let rows = |plugin: &PluginEntry| {
        let library = match (&plugin.file, plugin.loaded) {
            (file, false) => format!("not loaded; {}", code(file.as_deref())),
            (file, true) => code(file.as_deref()),
        };
        let shadow = plugin.shadow.as_deref().map(slate::runtime::printable).unwrap_or_default();
        let mut modules = wrapped(&plugin.modules).into_iter();
        let first = modules.next().unwrap_or_default();
        let row = [plugin.name.clone(), plugin.version.clone(), library, first, shadow];
        let more = modules.map(|modules| ["".into(), "".into(), "".into(), modules, "".into()]);
        [row].into_iter().chain(more).collect::<Vec<_>>()
    };
    output::columns([head].into_iter().chain(plugins.iter().flat_map(rows)));
    Ok(())
}

/// How wide a list of names gets.
const WIDTH: usize = 40;

/// Names with commas, in as many lines as they need.
fn wrapped(names: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let comma = if i + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 2 <= WIDTH => *line += &format!(" {name}{comma}"),
            _ => lines.push(format!("{name}{comma}")),
        }
    }
    lines
}

fn load(agent: &AgentOption, plugin: &str) -> Result<(), Failure> {
    let path = Path::new(plugin);
    // No plugin's name has a slash or a dot.
    let is_file = plugin.contains(['/', '.']) || path.is_file();
    let file = if is_file { Some(agent.library(path)?) } else { None };
    let mut client = agent.connect()?;
    let loaded = match file {
        Some(file) => client.load_library(&file)?,
        None => client.load(plugin)?,
    };
    for LoadedPlugin { name, file } in &loaded.plugins {
        output::line(format_args!("{name} is loaded; its code: {}", code(file.as_deref())));
    }
    let modules = if loaded.modules.is_empty() { "none".into() } else { loaded.modules.join(", ") };
    output::line(format_args!("modules: {modules}"));
    Ok(())
}

/// Where code comes from.
fn code(file: Option<&Path>) -> String {
    file.map_or_else(|| "linked in".into(), slate::runtime::printable)
}

fn reload(agent: &AgentOption, name: &str, file: Option<&Path>) -> Result<(), Failure> {
    let file = file.map(|file| agent.library(file)).transpose()?;
    say(&agent.connect()?.reload(name, file.as_deref())?);
    Ok(())
}

fn shadow(agent: &AgentOption, name: &str, file: Option<&Path>) -> Result<(), Failure> {
    let mut client = agent.connect()?;
    if let Some(file) = file {
        for (module, path) in client.shadow(name, &agent.library(file)?)? {
            output::line(format_args!("{module}: new code runs beside it, see {path}"));
        }
        return Ok(());
    }
    let plugins = client.plugins()?;
    let Some(plugin) = plugins.iter().find(|plugin| plugin.name == name && plugin.loaded) else {
        return Err(Failure::NotLoaded { name: name.into() });
    };
    let head = ["module", "steps", "different", "skipped", "panics", "first difference"].map(String::from);
    let mut rows = vec![head];
    for module in &plugin.modules {
        let Ok(Some(reading)) = client.read(&format!("/{module}/shadow")) else { continue };
        let number = |field: &str| reading.value[field].as_u64().unwrap_or(0);
        let first = match number("first_difference") {
            0 => String::new(),
            tick => format!("{} in tick {tick}", reading.value["port"].as_str().unwrap_or_default()),
        };
        let counts = ["ticks", "differences", "skipped", "panics"].map(|field| number(field).to_string());
        let [ticks, differences, skipped, panics] = counts;
        rows.push([module.clone(), ticks, differences, skipped, panics, first]);
    }
    if rows.len() == 1 {
        output::line(format_args!("no new code runs beside {name}; name a library's file to begin"));
        return Ok(());
    }
    output::columns(rows);
    Ok(())
}

/// What a reload came to.
fn say(reloaded: &Reloaded) {
    let name = &reloaded.plugin;
    let how =
        if reloaded.in_place { "between two ticks" } else { "with other ports, so its modules were away" };
    output::line(format_args!("{name} is exchanged {how}; its old library is {}", reloaded.old_library));
    for (module, lost) in &reloaded.modules {
        match lost {
            None => output::line(format_args!("{module}: goes on with its state")),
            Some(reason) => output::line(format_args!("{module}: begins afresh: {reason}")),
        }
    }
}

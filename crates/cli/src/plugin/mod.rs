mod info;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use serde_json::json;
use slate::control::{LoadedPlugin, PluginEntry, ReloadedPlugin};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::new::{self, Template};
use crate::output;

#[derive(Debug, Subcommand)]
pub enum PluginVerb {
    /// Create a crate with a module, a test, and a configuration for the simulator
    New {
        /// Name of the project and its folder
        name: String,
        /// Checkout of Slate [default: where this program was built]
        #[arg(long, value_name = "PATH")]
        slate: Option<PathBuf>,
    },
    /// Show the modules and requirements of a library without loading it
    Info {
        /// Library, such as `target/debug/libfollower.so`
        file: PathBuf,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Append a checksum to a library; agents refuse it if a byte has changed
    Seal {
        /// Library
        file: PathBuf,
    },
    /// List the plugins
    List {
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Load a plugin of the configuration, or a library
    Load {
        /// Plugin or list of plugins of the configuration, or a library file
        #[arg(value_name = "NAME|FILE")]
        plugin: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Unload a plugin: its modules end, and their outputs take their safe values
    Unload {
        /// Name of a plugin or of a list of plugins
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Replace the code of a plugin between two ticks; compatible states are kept
    Reload {
        /// Name of the plugin
        name: String,
        /// Library with the new code [default: the file it was loaded from]
        file: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Run new code as the shadow of a plugin and compare;
    /// without a file, show the comparison
    Shadow {
        /// Name of the plugin
        name: String,
        /// Library with the new code
        file: Option<PathBuf>,
        /// End the shadow
        #[arg(long, conflicts_with = "file")]
        end: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Replace the plugin by its shadow, which keeps its state
    Promote {
        /// Name of the plugin
        name: String,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Runs the command; returns true, as a refusal is a failure.
pub fn plugin(verb: &PluginVerb) -> Result<bool, Failure> {
    match verb {
        PluginVerb::New { name, slate } => {
            new::write(name, Template::Plugin, slate.as_deref())?;
            new::print_next_steps(name, Template::Plugin);
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
        PluginVerb::Promote { name, agent } => show_reloaded(&agent.connect()?.promote(name)?),
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

/// Maximum width of a list of names, characters.
const MAX_LIST_WIDTH: usize = 40;

/// Names with commas, in as many lines as they need.
fn wrapped(names: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let comma = if i + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 2 <= MAX_LIST_WIDTH => {
                *line += &format!(" {name}{comma}")
            }
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

/// Returns the origin of a plugin's code, for display.
fn code(file: Option<&Path>) -> String {
    file.map_or_else(|| "linked in".into(), slate::runtime::printable)
}

fn reload(agent: &AgentOption, name: &str, file: Option<&Path>) -> Result<(), Failure> {
    let file = file.map(|file| agent.library(file)).transpose()?;
    show_reloaded(&agent.connect()?.reload(name, file.as_deref())?);
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

/// Prints the result of a reload.
fn show_reloaded(reloaded: &ReloadedPlugin) {
    let name = &reloaded.plugin;
    let how =
        if reloaded.in_place { "between two ticks" } else { "with other ports, so its modules were away" };
    output::line(format_args!("{name} is reloaded {how}; its old library is {}", reloaded.old_library));
    for (module, lost) in &reloaded.modules {
        match lost {
            None => output::line(format_args!("{module}: keeps its state")),
            Some(reason) => output::line(format_args!("{module}: restarts without its state: {reason}")),
        }
    }
}

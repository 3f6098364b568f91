//! Modules and what goes from one to another, as a drawing.

mod layout;
mod svg;
mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCompleter;
use serde::Serialize;
use serde_json::Value;
use slate::runtime::composition::Wired;
use slate::runtime::configuration::{Actuator, Link};
use slate::runtime::replacement::Replacement;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{check, complete, examples, output};

#[derive(Debug, Args)]
pub struct GraphOptions {
    /// An example by name, or a configuration file; the agent that runs unless given.
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    name: Option<String>,

    /// What is written; what the name of the file says unless given, and a drawing to stdout.
    #[arg(long, value_enum)]
    format: Option<Format>,

    /// The same as `--format json`.
    #[arg(long, conflicts_with = "format")]
    json: bool,

    /// The file; what is printed goes to stdout unless given.
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Leaves modules out whose names are so, such as `referee` or `r2/*`; may be given several times.
    #[arg(long, value_name = "PATTERN")]
    hide: Vec<String>,

    /// Sets a value of the configuration first; may be given several times.
    #[arg(long, value_name = "PATH=VALUE", requires = "name")]
    set: Vec<String>,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A drawing.
    Svg,
    /// A text that Markdown shows as a drawing.
    Mermaid,
    /// For Graphviz.
    Dot,
    /// For programs.
    Json,
}

/// What is drawn.
#[derive(Debug, Default, Serialize)]
pub struct Graph {
    pub title: String,
    pub nodes: Vec<Node>,
    pub edges: Vec<Edge>,
}

/// A module, or what else values come from and go to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Node {
    pub name: String,
    pub kind: Kind,
    /// The stage of the main loop that a module runs in, where that is known; else what it is.
    pub note: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Module,
    /// A gate in front of an actuator.
    Gate,
    /// Another agent, or the host.
    Outside,
}

/// A link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    /// The property that is read, or the output that sends messages, without the name of its module.
    pub output: String,
    /// The input, without the name of its module.
    pub input: String,
    pub flow: Flow,
    /// Whether nobody has written it, as types and roles leave no choice.
    pub inferred: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Flow {
    Values,
    Messages,
    /// Values of the last cycle.
    Previous,
}

/// What a graph is made of, of a configuration or an agent that runs.
struct Found {
    title: String,
    /// Modules and the stages they run in.
    modules: Vec<(String, String)>,
    links: Vec<FoundLink>,
    /// Actuators and what commands them.
    actuators: Vec<(String, Vec<String>)>,
}

struct FoundLink {
    to: String,
    from: String,
    flow: Flow,
    inferred: bool,
}

impl FoundLink {
    fn new(to: String, from: String, options: &[(String, String)], sends: bool, inferred: bool) -> Self {
        let is_previous = options.iter().any(|(name, value)| name == "previous" && value == "true");
        let flow = match (sends, is_previous) {
            (true, _) => Flow::Messages,
            (false, true) => Flow::Previous,
            (false, false) => Flow::Values,
        };
        Self { to, from, flow, inferred }
    }
}

/// What a file has in it by the ending of its name.
fn named(path: &Path) -> Result<Format, Failure> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") | None => Ok(Format::Svg),
        Some("mmd" | "mermaid" | "md") => Ok(Format::Mermaid),
        Some("dot" | "gv") => Ok(Format::Dot),
        Some("json") => Ok(Format::Json),
        Some(_) => Err(Failure::NoDrawing { path: path.into() }),
    }
}

/// Draws it.
pub fn graph(options: &GraphOptions) -> Result<bool, Failure> {
    let found = match &options.name {
        Some(name) => of_configuration(name, options)?,
        None => of_agent(&options.agent)?,
    };
    let graph = made(found, &options.hide);
    let format = match (options.json, options.format, &options.out) {
        (true, ..) => Format::Json,
        (false, Some(format), _) => format,
        (false, None, Some(path)) => named(path)?,
        (false, None, None) => Format::Svg,
    };
    let text = match format {
        Format::Svg => svg::draw(&graph),
        Format::Mermaid => text::mermaid(&graph),
        Format::Dot => text::dot(&graph),
        Format::Json => text::json(&graph),
    };
    match &options.out {
        Some(path) => {
            write(path, &text).map_err(|source| Failure::File { path: path.clone(), source })?;
        }
        None => output::line(text.trim_end()),
    }
    Ok(true)
}

/// A drawing that is there stays until the new one is whole; a pipe or a device takes it as it comes.
fn write(path: &Path, text: &str) -> io::Result<()> {
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return std::fs::write(path, text);
    }
    // What a link leads to is written, and not the link.
    let mut new = Replacement::create(&path.canonicalize().unwrap_or_else(|_| path.into()))?;
    new.write_all(text.as_bytes())?;
    new.keep()
}

fn of_configuration(name: &str, options: &GraphOptions) -> Result<Found, Failure> {
    let sets = [check::QUIET.map(String::from).to_vec(), options.set.clone()].concat();
    let application = examples::find(name, options.agent.agent.as_deref(), Vec::new(), sets, None)?;
    let catalogue = check::catalogue(&application)?;
    let wired = Wired::new(&application.configuration, &catalogue, &|_| false);
    let survey = wired.check(&catalogue)?;
    let configuration = wired.configuration();
    let stages: BTreeMap<String, String> = survey
        .stages(configuration)
        .into_iter()
        .flat_map(|(stage, modules)| modules.into_iter().map(move |module| (module, stage.clone())))
        .collect();
    let module = |name: &String| (name.clone(), stages.get(name).cloned().unwrap_or_default());
    let names: BTreeSet<_> = survey.modules.iter().map(|surveyed| &surveyed.module.name.value).collect();
    let link = |link: &Link| {
        let sends = survey.sends(&link.to.value, &link.from.value.path_in(""));
        let options = configuration.link_options(link);
        let (to, from) = (link.to.value.clone(), link.from.value.to_string());
        FoundLink::new(to, from, &options, sends, link.is_inferred())
    };
    let commands = |actuator: &Actuator| {
        let commands = actuator.commands.iter().map(|command| command.value.to_string());
        (actuator.name.value.clone(), commands.collect())
    };
    Ok(Found {
        title: application.name.clone(),
        modules: names.into_iter().map(module).collect(),
        links: configuration.links().iter().map(link).collect(),
        actuators: configuration.actuators().iter().map(commands).collect(),
    })
}

fn of_agent(agent: &AgentOption) -> Result<Found, Failure> {
    let mut client = agent.connect()?;
    let modules = client.modules()?.into_iter();
    let links = client.links()?.into_iter();
    let links =
        links.map(|link| FoundLink::new(link.to, link.from, &link.options, link.sends, link.inferred));
    let mut actuators: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for setting in client.settings("actuators").unwrap_or_default() {
        let path = setting.path.strip_prefix("actuators.").and_then(|rest| rest.split_once(".command"));
        let Some((name, rest)) = path else { continue };
        let command = match (rest.strip_prefix("s."), setting.value) {
            (None, Value::String(command)) => command,
            (Some(command), Value::Bool(true)) => command.trim_matches('"').to_owned(),
            _ => continue,
        };
        actuators.entry(name.trim_matches('"').to_owned()).or_default().push(command);
    }
    Ok(Found {
        title: client.name().to_owned(),
        modules: modules.map(|module| (module.name, module.condition.to_lowercase())).collect(),
        links: links.collect(),
        actuators: actuators.into_iter().collect(),
    })
}

/// Nodes and edges of what was found.
fn made(found: Found, hide: &[String]) -> Graph {
    let Found { title, modules, links, actuators } = found;
    let patterns: Vec<_> =
        hide.iter().filter_map(|hide| slate::blackboard::Pattern::parse(hide).ok()).collect();
    let is_hidden = |name: &str| patterns.iter().any(|pattern| pattern.matches(name));
    let mut graph = Graph { title, ..Graph::default() };
    let module = |(name, note)| Node { name, kind: Kind::Module, note };
    graph.nodes = modules.into_iter().map(module).collect();
    let gate = |(name, _): &(String, Vec<String>)| Node {
        name: name.clone(),
        kind: Kind::Gate,
        note: "gate".into(),
    };
    graph.nodes.extend(actuators.iter().map(gate));
    let mut edges = Vec::new();
    for FoundLink { to, from, flow, inferred } in links {
        let ((from, output), (to, input)) = (graph.end(&from), graph.end(&to));
        edges.push(Edge { from, to, output, input, flow, inferred });
    }
    for (name, commands) in actuators {
        for command in commands {
            let (from, output) = graph.end(&command);
            let Some(to) = graph.nodes.iter().position(|node| node.kind == Kind::Gate && node.name == name)
            else {
                continue;
            };
            edges.push(Edge {
                from,
                to,
                output,
                input: "command".into(),
                flow: Flow::Values,
                inferred: false,
            });
        }
    }
    graph.edges = edges;
    graph.hide(is_hidden);
    graph
}

impl Graph {
    /// The node that a URL leads to, and what is left of it behind the name of the node.
    fn end(&mut self, url: &str) -> (usize, String) {
        let path = match url.strip_prefix("slate://") {
            Some(rest) => {
                let (agent, path) = rest.split_once('/').unwrap_or((rest, ""));
                return (self.outside(&format!("slate://{agent}"), "another agent"), path.into());
            }
            None => url.trim_start_matches('/'),
        };
        let owner = self.nodes.iter().enumerate().filter_map(|(index, node)| {
            let rest = path.strip_prefix(node.name.as_str())?.strip_prefix('/')?;
            Some((node.name.len(), index, rest.to_owned()))
        });
        match owner.max() {
            Some((_, index, rest)) => (index, rest),
            None => {
                let (first, rest) = path.split_once('/').unwrap_or((path, ""));
                (self.outside(first, "the host's"), rest.into())
            }
        }
    }

    fn outside(&mut self, name: &str, note: &str) -> usize {
        let is_it = |node: &Node| node.kind == Kind::Outside && node.name == name;
        self.nodes.iter().position(is_it).unwrap_or_else(|| {
            self.nodes.push(Node { name: name.into(), kind: Kind::Outside, note: note.into() });
            self.nodes.len() - 1
        })
    }

    /// Leaves nodes out, with their edges.
    fn hide(&mut self, is_hidden: impl Fn(&str) -> bool) {
        let mut number = 0;
        let places: Vec<Option<usize>> = self
            .nodes
            .iter()
            .map(|node| {
                let stays = !is_hidden(&node.name);
                number += usize::from(stays);
                stays.then(|| number - 1)
            })
            .collect();
        self.nodes.retain(|node| !is_hidden(&node.name));
        self.edges.retain_mut(|edge| match (places[edge.from], places[edge.to]) {
            (Some(from), Some(to)) => {
                (edge.from, edge.to) = (from, to);
                true
            }
            _ => false,
        });
    }
}

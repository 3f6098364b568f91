//! `slate graph`: modules, gates and links as a drawing or as text.
//! The text is for other programs.

pub mod svg;
mod text;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCompleter;
use slate::blackboard::Pattern;
use slate::control::graph::{GraphLink, ModuleGraph};
use slate::runtime::composition::LinkedConfiguration;
use slate::runtime::configuration::{Actuator, ExternalLink, Link};
use slate::runtime::replacement::Replacement;
use slate_sorted::{SortedMap, SortedSet};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, examples, offline, output};

#[derive(Debug, Args)]
pub struct GraphOptions {
    /// Example or configuration file [default: the running agent]
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    name: Option<String>,

    /// Output format [default: by file name; svg on stdout]
    #[arg(long, value_enum)]
    format: Option<GraphFormat>,

    /// Same as `--format json`
    #[arg(long, conflicts_with = "format")]
    json: bool,

    /// Output file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Hide a module or pattern, such as `referee` or `r2/*`; repeatable
    #[arg(long, value_name = "PATTERN")]
    hide: Vec<String>,

    /// Override a setting; repeatable
    #[arg(long, value_name = "PATH=VALUE", requires = "name")]
    set: Vec<String>,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GraphFormat {
    /// Drawing
    Svg,
    /// Mermaid, which Markdown viewers draw
    Mermaid,
    /// Graphviz
    Dot,
    /// JSON
    Json,
}

/// Returns the format for a file name.
fn named(path: &Path) -> Result<GraphFormat, Failure> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") | None => Ok(GraphFormat::Svg),
        Some("mmd" | "mermaid" | "md") => Ok(GraphFormat::Mermaid),
        Some("dot" | "gv") => Ok(GraphFormat::Dot),
        Some("json") => Ok(GraphFormat::Json),
        Some(_) => Err(Failure::NoDrawing { path: path.into() }),
    }
}

/// Draws it.
pub fn graph(options: &GraphOptions) -> Result<bool, Failure> {
    let mut graph = match &options.name {
        Some(name) => of_configuration(name, options)?,
        None => options.agent.connect()?.graph()?.graph(),
    };
    let patterns = options.hide.iter().filter_map(|hide| Pattern::parse(hide).ok());
    let patterns: Vec<_> = patterns.collect();
    graph.hide(|name| patterns.iter().any(|pattern| pattern.matches(name)));
    let format = match (options.json, options.format, &options.out) {
        (true, ..) => GraphFormat::Json,
        (false, Some(format), _) => format,
        (false, None, Some(path)) => named(path)?,
        (false, None, None) => GraphFormat::Svg,
    };
    let text = match format {
        GraphFormat::Svg => svg::draw(&graph),
        GraphFormat::Mermaid => text::mermaid(&graph),
        GraphFormat::Dot => text::dot(&graph),
        GraphFormat::Json => text::json(&graph),
    };
    match &options.out {
        Some(path) => {
            write(path, &text).map_err(|source| Failure::File { path: path.clone(), source })?;
        }
        None => output::line(text.trim_end()),
    }
    Ok(true)
}

/// Writes a drawing; an existing one stays until the new one is complete.
/// A pipe or a device takes it as it comes.
pub fn write(path: &Path, text: &str) -> io::Result<()> {
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return std::fs::write(path, text);
    }
    // The target of a symbolic link is written, and not the link.
    let mut new = Replacement::create(&path.canonicalize().unwrap_or_else(|_| path.into()))?;
    new.write_all(text.as_bytes())?;
    new.keep()
}

fn of_configuration(name: &str, options: &GraphOptions) -> Result<ModuleGraph, Failure> {
    let (agent, sets) = (options.agent.agent.as_deref(), options.set.clone());
    let application = examples::find(name, agent, Vec::new(), sets, None)?;
    let catalogue = offline::catalogue(&application)?;
    let linked = LinkedConfiguration::new(&application.configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue)?;
    let configuration = linked.configuration();
    let stages: SortedMap<String, String> = survey
        .stages(configuration)
        .into_iter()
        .flat_map(|(stage, modules)| modules.into_iter().map(move |module| (module, stage.clone())))
        .collect();
    let module = |name: &String| (name.clone(), stages.get(name).cloned().unwrap_or_default());
    let names: SortedSet<_> = survey.modules.iter().map(|surveyed| &surveyed.module.name.value).collect();
    let link = |link: &Link| {
        let sends = survey.sends(&link.to.value, &link.from.value.path_in(""));
        let options = configuration.link_options(link);
        let (to, from) = (link.to.value.clone(), link.from.value.to_string());
        GraphLink::new(to, from, &options, sends, link.is_inferred())
    };
    let external = |link: &ExternalLink| {
        let (to, from) = link.ends();
        GraphLink::new(to, from, &[], false, false)
    };
    let commands = |actuator: &Actuator| {
        let commands = actuator.commands.iter().map(|command| command.value.to_string());
        (actuator.name.value.clone(), commands.collect())
    };
    Ok(ModuleGraph::new(
        application.name.clone(),
        names.into_iter().map(module).collect(),
        configuration
            .links()
            .iter()
            .map(link)
            .chain(configuration.external_links().iter().map(external))
            .collect(),
        configuration.actuators().iter().map(commands).collect(),
    ))
}

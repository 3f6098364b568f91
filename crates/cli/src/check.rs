//! What is wrong with a configuration, without running it.

use std::collections::{BTreeMap, BTreeSet};
use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde::Serialize;
use serde_json::json;
use slate::blackboard::Board;
use slate::control::OpenError;
use slate::module::Plugin;
use slate::record::{Misspelt, misspelt};
use slate::runtime::composition::{Catalogue, Survey, Wired, loose};
use slate::runtime::configuration::{Configuration, Diagnostic, Report};
use slate::runtime::directory::check_reach;
use slate::runtime::sharing::{RemotePath, Sharing, SharingError, Site, Want};
use slate::runtime::{Agent, Mistake, Mode, Options, StartError};
use slate::share::agent::AgentSharing;

use crate::examples::{self, Application};
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::observation::Observation;
use crate::{complete, output, scene};

#[derive(Debug, Args)]
pub struct CheckOptions {
    /// An example by name, or a configuration file.
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: String,

    /// One of the agents that the file describes; all of them unless given.
    #[arg(long, value_name = "NAME")]
    pub agent: Option<String>,

    /// Sets a value of the configuration first; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,

    /// A file with the settings of the computer that it shall run on.
    #[arg(long, value_name = "FILE")]
    pub host: Option<PathBuf>,

    /// Counts warnings as errors.
    #[arg(long)]
    strict: bool,

    /// Prints what is wrong as JSON.
    #[arg(long)]
    json: bool,
}

/// Sharing that reaches nobody: what the configuration says of it is checked, endpoints too, and nothing is opened.
struct Offline(AgentSharing);

impl Sharing for Offline {
    fn start(&mut self, site: Site) -> Result<(), SharingError> {
        self.0.check(&site)
    }

    fn want(&mut self, _: BTreeMap<RemotePath, Want>) {}

    fn carriers(&self) -> BTreeSet<String> {
        self.0.carriers()
    }

    fn has_jpeg(&self) -> bool {
        self.0.has_jpeg()
    }
}

/// Something that was found.
#[derive(Debug, Serialize)]
pub struct Finding {
    severity: &'static str,
    code: &'static str,
    message: String,
    pub help: Option<String>,
    file: Option<String>,
    line: Option<usize>,
}

/// What a configuration is made of, once it fits.
#[derive(Debug, Default, Serialize)]
struct Counts {
    agents: usize,
    modules: usize,
    links: usize,
    actuators: usize,
}

/// An application that is made as for a run, but neither reached by others nor written about.
pub fn load(application: &Application) -> Result<Agent, Failure> {
    let options = Options {
        mode: Mode::Staged,
        sharing: Some(Box::new(Offline(AgentSharing::default()))),
        armed: false,
        ..Options::default()
    };
    Ok(Agent::load_with(&application.database, &application.plugins, options)?)
}

/// What an application could be made of, without an agent.
pub fn catalogue(application: &Application) -> Result<Catalogue, Failure> {
    let sharing = Offline(AgentSharing::default());
    Ok(slate::runtime::catalogue(&application.configuration, &application.plugins, Some(&sharing))?)
}

/// What keeps a look at a configuration from touching files that a run may be writing.
pub const QUIET: [&str; 3] =
    ["log.targets.console=false", "log.targets.file=false", "log.targets.syslog=false"];

/// Checks it, and returns what the process ends with.
pub fn check(options: &CheckOptions) -> Result<u8, Failure> {
    let (mut findings, mut counts) = (Vec::new(), Counts::default());
    let mut rendered = String::new();
    let colour = output::has_colour(&std::io::stderr());
    let mut complain = |severity, report: &Report| {
        match severity {
            "error" => rendered.push_str(&report.render(colour)),
            _ => report.to_string().lines().for_each(|line| rendered.push_str(&format!("warning: {line}\n"))),
        }
        findings.extend(report.diagnostics().iter().map(|one| finding(severity, one)));
    };
    let names = match &options.agent {
        Some(name) => vec![Some(name.clone())],
        None => match examples::agents(&options.name, options.host.as_deref()) {
            Ok(agents) if agents.is_empty() => vec![None],
            Ok(agents) => agents.into_iter().map(Some).collect(),
            Err(Failure::Configuration(report)) => {
                complain("error", &report);
                Vec::new()
            }
            Err(other) => return Err(other),
        },
    };
    for agent in &names {
        let sets = [QUIET.map(String::from).to_vec(), options.set.clone()].concat();
        let found =
            examples::find(&options.name, agent.as_deref(), Vec::new(), sets, options.host.as_deref());
        let loaded = found.and_then(|application| look(&application).map(|seen| (application, seen)));
        match loaded {
            Ok((application, (links, warnings))) => {
                let configuration = &application.configuration;
                counts.agents += 1;
                counts.modules += configuration.modules().len();
                counts.links += links;
                counts.actuators += configuration.actuators().len();
                complain("warning", &Report::from(warnings));
            }
            Err(Failure::Configuration(report)) => complain("error", &report),
            Err(Failure::Start(StartError::Configuration(report))) => complain("error", &report),
            Err(other) => return Err(other),
        }
    }
    // What several agents of a file have in common is wrong once.
    let mut seen = BTreeSet::new();
    findings.retain(|one: &Finding| seen.insert((one.file.clone(), one.line, one.message.clone())));
    let errors = findings.iter().filter(|one| options.strict || one.severity == "error").count();
    if options.json {
        let ok = errors == 0;
        output::json(&json!({
            "schema": "slate.check/1", "configuration": options.name, "ok": ok, "findings": findings, "counts": counts,
        }));
    } else {
        eprint!("{rendered}");
        let codes: BTreeSet<_> =
            findings.iter().map(|one| one.code).filter(|code| !code.is_empty()).collect();
        if !codes.is_empty() && std::io::stderr().is_terminal() {
            let codes: Vec<_> = codes.into_iter().collect();
            eprintln!("more about them: slate explain {}", codes.join(" "));
        }
        let Counts { agents, modules, links, actuators } = counts;
        let number =
            |count: usize, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
        let warnings = findings.len() - findings.iter().filter(|one| one.severity == "error").count();
        output::line(match errors {
            0 => format!(
                "{} is good: {}, {}, {}, {}{}",
                options.name,
                number(agents, "agent"),
                number(modules, "module"),
                number(links, "link"),
                number(actuators, "actuator"),
                if warnings > 0 { format!("; {}", number(warnings, "warning")) } else { String::new() }
            ),
            errors => format!("{}: {}", options.name, number(errors, "error")),
        });
    }
    Ok(if errors == 0 { 0 } else { ASSERTION_FALSE })
}

/// Whether all of it fits, and then makes it; returns how many links it has, and what is no mistake and yet looks like
/// one. Only an agent knows whether its modules can be set up, what its files say, and what is on its blackboard.
fn look(application: &Application) -> Result<(usize, Vec<Diagnostic>), Failure> {
    let configuration = &application.configuration;
    let catalogue = catalogue(application)?;
    let wired = Wired::new(configuration, &catalogue, &|_| false);
    let survey = wired.check(&catalogue)?;
    let agent = load(application)?;
    reach(configuration)?;
    Observation::new(configuration, agent.board())?;
    scene::of(configuration)?;
    let mut warnings = unused(configuration, &catalogue, &survey);
    warnings.extend(loose(wired.configuration(), &survey));
    warnings.extend(unrecorded(configuration, agent.board()));
    Ok((wired.configuration().links().len(), warnings))
}

/// Whether tools will find the agent, as a run that they would not find is refused.
fn reach(configuration: &Configuration) -> Result<(), Failure> {
    let Err(error) = check_reach(configuration.agent_name()).map_err(OpenError::from) else { return Ok(()) };
    let Some(name) = configuration.value("agent.name") else { return Err(Failure::Unreachable(error)) };
    let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
    let diagnostic = configuration.diagnostic(name.span, error.to_string(), help);
    Err(Failure::Configuration(diagnostic.into()))
}

/// Plugins that are for nothing.
fn unused(configuration: &Configuration, catalogue: &Catalogue, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let warn = |plugin: &Plugin| {
        let is_used =
            survey.modules.iter().any(|module| plugin.kinds().iter().any(|kind| kind.is(&module.kind)));
        let entry = configuration.table("plugins").and_then(|table| table.get(plugin.name()))?;
        let message = format!("no module is of plugin `{}`", plugin.name());
        let help = "leave it out, or say `load = false` if it is to be loaded later";
        (!is_used).then(|| configuration.diagnostic(entry.span, message, Some(help.into())))
    };
    catalogue.plugins.iter().filter_map(warn).collect()
}

/// What is to be recorded and is nowhere.
fn unrecorded(configuration: &Configuration, board: &Board) -> Vec<Diagnostic> {
    let warn = |own: Misspelt| {
        let setting = configuration.value(own.setting)?;
        Some(configuration.diagnostic(setting.span, own.to_string(), Some(own.help.clone())))
    };
    misspelt(&configuration.record().selection, board).into_iter().filter_map(warn).collect()
}

/// Of something that is wrong with a configuration.
pub fn finding(severity: &'static str, diagnostic: &Diagnostic) -> Finding {
    Finding {
        severity,
        code: diagnostic.mistake().map_or("", Mistake::code),
        message: diagnostic.message().into(),
        help: diagnostic.help_text().map(String::from),
        file: diagnostic.source_name().map(String::from),
        line: diagnostic.line(),
    }
}

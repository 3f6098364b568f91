//! Checks of a configuration without running it.

use std::collections::BTreeSet;
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
use slate::runtime::StartError;
use slate::runtime::composition::{Catalogue, Survey, Wired, loose};
use slate::runtime::configuration::{Configuration, Diagnostic, Report};
use slate::runtime::directory::check_reach;
use slate_run::{Application, ConfigurationFinding, Observation, check_network, check_ros2};

use crate::examples;
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::offline::{QUIET, catalogue, load};
use crate::{complete, output, scene};

#[derive(Debug, Args)]
pub struct CheckOptions {
    /// Example or configuration file
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: String,

    /// Agent of the file [default: all]
    #[arg(long, value_name = "NAME")]
    pub agent: Option<String>,

    /// Override a setting; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,

    /// Configuration of the target machine, which overrides the main one
    #[arg(long, value_name = "FILE")]
    pub host: Option<PathBuf>,

    /// Treat warnings as errors
    #[arg(long)]
    strict: bool,

    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Numbers of parts of a configuration.
#[derive(Debug, Default, Serialize)]
struct CompositionCounts {
    agents: usize,
    modules: usize,
    links: usize,
    actuators: usize,
}

/// Checks it, and returns what the process ends with.
pub fn check(options: &CheckOptions) -> Result<u8, Failure> {
    let (mut findings, mut counts) = (Vec::new(), CompositionCounts::default());
    let mut rendered = String::new();
    let colour = output::has_colour(&std::io::stderr());
    let mut complain = |severity, report: &Report| {
        match severity {
            "error" => rendered.push_str(&report.render(colour)),
            _ => report.to_string().lines().for_each(|line| rendered.push_str(&format!("warning: {line}\n"))),
        }
        findings.extend(report.diagnostics().iter().map(|one| ConfigurationFinding::new(severity, one)));
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
    findings
        .retain(|one: &ConfigurationFinding| seen.insert((one.file.clone(), one.line, one.message.clone())));
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
            eprintln!("more: slate explain {}", codes.join(" "));
        }
        let CompositionCounts { agents, modules, links, actuators } = counts;
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
    check_network(&agent)?;
    check_ros2(&agent)?;
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
        let message = format!("no module uses plugin `{}`", plugin.name());
        let help = "remove it, or set `load = false` to load it later";
        (!is_used).then(|| configuration.diagnostic(entry.span, message, Some(help.into())))
    };
    catalogue.plugins.iter().filter_map(warn).collect()
}

/// Returns warnings for recorded properties that do not exist.
fn unrecorded(configuration: &Configuration, board: &Board) -> Vec<Diagnostic> {
    let warn = |own: Misspelt| {
        let setting = configuration.value(own.setting)?;
        Some(configuration.diagnostic(setting.span, own.to_string(), Some(own.help.clone())))
    };
    misspelt(&configuration.record().selection, board).into_iter().filter_map(warn).collect()
}

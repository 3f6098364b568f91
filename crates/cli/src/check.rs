//! Checks of a configuration without running it.

mod findings;

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde::Serialize;
use serde_json::json;
use slate::control::OpenError;
use slate::module::Plugin;
use slate::record::{UnmatchedPattern, unmatched_patterns};
use slate::runtime::composition::{
    Catalogue, CheckedComposition, DescribedLimits, LinkedConfiguration, Survey, described_limits,
    unlinked_warnings,
};
use slate::runtime::configuration::{Configuration, Diagnostic, Report, Variant};
use slate::runtime::directory::check_reach;
use slate::runtime::{ErrorCode, StartError};
use slate_run::{Application, check_tables};
use slate_sorted::SortedMap;

use crate::examples;
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::offline::{self, catalogue};
use crate::{complete, output};
use findings::Findings;

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
    /// Limits of gates that are not written.
    #[serde(skip)]
    limits: Vec<GateLimits>,
}

/// Limits of a gate from the RobotModel.
#[derive(Debug, Serialize)]
struct GateLimits {
    gate: String,
    /// Name of the robot's description.
    robot: String,
    limits: SortedMap<String, [f64; 2]>,
}

impl GateLimits {
    fn of(gate: &str, described: DescribedLimits<'_>) -> Self {
        let limits = described.limits.into_iter();
        let limits = limits.map(|limit| (limit.field.value, [limit.low, limit.high])).collect();
        Self { gate: gate.into(), robot: described.robot.into(), limits }
    }

    fn line(&self) -> String {
        let Self { gate, robot, limits } = self;
        let mut intervals: Vec<([f64; 2], Vec<&str>)> = Vec::new();
        for (field, limit) in limits {
            match intervals.iter_mut().find(|(known, _)| known == limit) {
                Some((_, fields)) => fields.push(field),
                None => intervals.push((*limit, vec![field])),
            }
        }
        let words = intervals
            .iter()
            .map(|([low, high], fields)| format!("{} from {low} to {high}", fields.join(", ")));
        format!("{gate}: {}, by the RobotModel of a {robot}", words.collect::<Vec<_>>().join("; "))
    }
}

/// Checks it, and returns the exit code.
pub fn check(options: &CheckOptions) -> Result<u8, Failure> {
    let (mut findings, mut counts) = (Findings::default(), CompositionCounts::default());
    let names = match &options.agent {
        Some(name) => vec![Some(name.clone())],
        None => match examples::agents(&options.name, options.host.as_deref()).map_err(Failure::from) {
            Ok(agents) if agents.is_empty() => vec![None],
            Ok(agents) => agents.into_iter().map(Some).collect(),
            Err(Failure::Configuration(report)) => {
                findings.add("error", report.diagnostics(), None);
                Vec::new()
            }
            Err(other) => return Err(other),
        },
    };
    for agent in &names {
        check_agent(options, agent.as_deref(), &mut findings, &mut counts)?;
    }
    let warnings = findings.count("warning");
    let errors = findings.count("error") + if options.strict { warnings } else { 0 };
    print(options, &findings, &counts, errors);
    Ok(if errors == 0 { 0 } else { ASSERTION_FALSE })
}

/// Checks an agent as configured, then with each variant that is not chosen.
/// The variant takes the place of the chosen one.
fn check_agent(
    options: &CheckOptions,
    agent: Option<&str>,
    findings: &mut Findings,
    counts: &mut CompositionCounts,
) -> Result<(), Failure> {
    let find = |more: Option<String>| {
        let sets = options.set.iter().cloned().chain(more).collect();
        examples::find(&options.name, agent, Vec::new(), sets, options.host.as_deref()).map_err(Failure::from)
    };
    let application = match find(None).map_err(as_report) {
        Ok(application) => application,
        Err(Ok(report)) => {
            findings.add("error", report.diagnostics(), None);
            return Ok(());
        }
        Err(Err(other)) => return Err(other),
    };
    let configuration = &application.configuration;
    counts.agents += 1;
    counts.modules += configuration.modules().len();
    counts.actuators += configuration.actuators().len();
    match check_configuration(&application).map_err(as_report) {
        Ok(CheckedConfiguration { links, limits, warnings }) => {
            counts.links += links;
            counts.limits.extend(limits);
            findings.add("warning", &warnings, None);
        }
        Err(Ok(report)) => findings.add("error", report.diagnostics(), None),
        Err(Err(other)) => return Err(other),
    }
    for variant in Variant::all(configuration).filter(|variant| !variant.is_chosen) {
        let setting = variant.setting();
        let checked = find(Some(setting.clone())).and_then(|application| check_configuration(&application));
        match checked.map_err(as_report) {
            Ok(CheckedConfiguration { warnings, .. }) => findings.add("warning", &warnings, Some(&setting)),
            Err(Ok(report)) => findings.add("error", report.diagnostics(), Some(&setting)),
            // Such as a file that only this variant names.
            Err(Err(other)) => {
                let diagnostic = configuration.diagnostic(variant.span, other.to_string(), None);
                findings.add("error", &[diagnostic], Some(&setting));
            }
        }
    }
    Ok(())
}

/// Returns the report of a configuration's errors; another failure is an error.
fn as_report(failure: Failure) -> Result<Report, Failure> {
    match failure {
        Failure::Configuration(report) | Failure::Start(StartError::Configuration(report)) => Ok(report),
        other => Err(other),
    }
}

/// Prints the findings and their sum.
fn print(options: &CheckOptions, findings: &Findings, counts: &CompositionCounts, errors: usize) {
    if options.json {
        let (ok, findings) = (errors == 0, findings.json());
        output::json(&json!({
            "schema": "slate.check/1", "configuration": options.name, "ok": ok, "findings": findings, "counts": counts,
            "limits": counts.limits,
        }));
        return;
    }
    eprint!("{}", findings.render(output::has_color(&std::io::stderr())));
    let codes = findings.codes();
    if !codes.is_empty() && std::io::stderr().is_terminal() {
        let codes: Vec<_> = codes.into_iter().collect();
        eprintln!("more: slate explain {}", codes.join(" "));
    }
    let CompositionCounts { agents, modules, links, actuators, .. } = *counts;
    let number = |count: usize, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
    let warnings = findings.count("warning");
    output::line(match errors {
        0 => format!(
            "{} is valid: {}, {}, {}, {}{}",
            options.name,
            number(agents, "agent"),
            number(modules, "module"),
            number(links, "link"),
            number(actuators, "actuator"),
            if warnings > 0 { format!("; {}", number(warnings, "warning")) } else { String::new() }
        ),
        errors => format!("{}: {}", options.name, number(errors, "error")),
    });
    counts.limits.iter().for_each(|limits| output::line(limits.line()));
}

/// Summary of a valid configuration.
struct CheckedConfiguration {
    /// Number of links.
    links: usize,
    /// Limits of gates that are not written.
    limits: Vec<GateLimits>,
    /// Findings that are not errors, but suspicious.
    warnings: Vec<Diagnostic>,
}

/// Checks the whole configuration, with the parts of this program.
/// It makes no agent, and opens nothing.
fn check_configuration(application: &Application) -> Result<CheckedConfiguration, Failure> {
    let configuration = &application.configuration;
    let catalogue = catalogue(application)?;
    let linked = LinkedConfiguration::new(configuration, &catalogue, &|_| false);
    let composition = linked.composition(&catalogue)?;
    offline::check(&composition, &catalogue)?;
    reach(configuration)?;
    check_tables(&composition)?;
    let survey = composition.survey();
    let mut warnings = unused(configuration, &catalogue, survey);
    warnings.extend(unlinked_warnings(linked.configuration(), survey));
    warnings.extend(unrecorded(configuration, &composition));
    let links = linked.configuration().links().len() + configuration.external_links().len();
    let gates = linked.configuration().actuators().iter();
    let limits = gates.filter_map(|gate| Some(GateLimits::of(&gate.name, described_limits(survey, gate)?)));
    let limits = limits.collect();
    Ok(CheckedConfiguration { links, limits, warnings })
}

/// Checks that tools will find the agent.
/// A run that they would not find is refused.
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
        let message = ErrorCode::UnusedPlugin.of(format!("no module uses plugin `{}`", plugin.name()));
        let help = "remove it, or set `load = false` to load it later";
        (!is_used).then(|| configuration.diagnostic(entry.span, message, Some(help.into())))
    };
    catalogue.plugins.iter().filter_map(warn).collect()
}

/// Returns warnings for recorded properties that do not exist.
fn unrecorded(configuration: &Configuration, composition: &CheckedComposition<'_>) -> Vec<Diagnostic> {
    let warn = |own: UnmatchedPattern| {
        let setting = configuration.value(own.setting)?;
        let message = ErrorCode::Unrecorded.of(own.to_string());
        Some(configuration.diagnostic(setting.span, message, Some(own.help.clone())))
    };
    unmatched_patterns(&configuration.record().selection, composition).into_iter().filter_map(warn).collect()
}

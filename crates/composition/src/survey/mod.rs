//! Validation of a configuration against the catalogue's kinds; creates nothing.

mod actuation;
mod aspects;
mod block;
mod commander;
mod hardware;
mod host;
mod infer;
mod knowledge_inputs;
mod levels;
mod limits;
mod links;
mod manual_values;
mod module;
mod names;
mod order;
mod origins;
mod reflex_warnings;
mod rings;
mod robot_crossing;
mod robot_model;
mod rules;
mod switched_off;
mod unlinked;
mod writers;

use std::sync::Arc;

use slate_module::{Description, ModuleKind, Stage, Trigger};
use slate_sorted::{SortedMap, SortedSet};

pub use host::{Host, LOOP_STORE, stage_histogram};

pub use crate::LinkEnd;
use crate::OwnSetup;
use crate::Played;
use crate::RemotePath;
use crate::catalogue::{Catalogue, RemoteProperty};
use crate::diagnostic_collector::{DiagnosticCollector, suggest};
use crate::link::{FieldPlace, Filter, Program};
pub use aspects::needs;
pub use block::{GATE, inbox_part, part};
pub use infer::{Inferred, LinkKeeping, infer};
pub use limits::{DescribedLimits, described_limits};
pub use links::{bridge_refusal, carrier_mismatch, remote_path, ungated_command};
pub use manual_values::manual_value_refusal;
pub use names::port_at;
use slate_configuration::{Configuration, ErrorCode, Link, Module};
pub use unlinked::unlinked_warnings;

/// Names of the ports that every module has in addition to its own.
pub const RESERVED: [&str; 5] = ["params", "enabled", "state", "timing", "histogram"];

/// Name of the additional port of isolated modules.
pub const RESERVED_WHEN_ISOLATED: &str = "process";

/// A module of the composition.
pub struct Surveyed<'a> {
    /// Module as configured.
    pub module: &'a Module,
    /// Kind of the module.
    pub kind: ModuleKind,
    /// True if it runs in a process of its own.
    pub is_isolated: bool,
    /// Ports and parameters.
    pub description: Description,
    /// Stage that runs it.
    pub stage: Stage,
    /// Trigger of the module.
    pub trigger: Trigger,
    /// Longest duration of a tick, ns.
    pub deadline: Option<u64>,
    /// The bytes of its parameters.
    pub params: Vec<u8>,
    /// Setup of the module.
    pub setup: OwnSetup,
    /// Values of unlinked inputs, by port.
    pub inputs: SortedMap<usize, Vec<u8>>,
}

/// Link between two ports, with its resolved source.
#[derive(Clone, Debug)]
pub struct ResolvedLink<'a> {
    /// Link as configured.
    pub link: &'a Link,
    /// The module and the port that the link belongs to.
    pub port: (usize, LinkEnd),
    /// Source of the link, traced through the links of other inputs.
    pub target: LinkSource,
    /// Field of the source; empty for the whole value.
    pub from: String,
    /// Field of the port; empty for the whole value.
    pub field: String,
    /// Conversion of the value.
    pub conversion: LinkConversion,
    /// Filter of values; all pass without one.
    pub filter: Option<Arc<Filter>>,
    /// Selection of last cycle's value, by this link or by that of an input between.
    pub previous: bool,
    /// Delay by one cycle of a value that is written earlier in the same cycle.
    pub delayed: bool,
}

/// Conversion of a link's value.
#[derive(Clone, Debug)]
pub enum LinkConversion {
    /// Direct reading of the property, without conversion.
    Plain,
    /// Conversion into a property of the port's own.
    Converted(Arc<Program>),
    /// Conversion into this place that is not resolved yet.
    /// It is resolved when the source of the link is loaded.
    Pending(Arc<FieldPlace>),
}

/// Source of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkSource {
    /// A port of a module.
    Port(usize, usize),
    /// A property that every module has.
    Implied(usize, Implied),
    /// The command of an actuator that passed its gate.
    Command(usize),
    /// The state of an actuator's gate.
    Gate(usize),
    /// Property of a module whose plugin is not loaded; an index of [`Survey::absent`].
    Absent(usize),
    /// A property of another agent; an index of [`Survey::remote`].
    Remote(usize),
    /// A property of the main loop or of the log.
    Host(Host),
    /// A property that is played; an index of [`Survey::played`].
    Played(usize),
}

/// Source of a link in another agent.
#[derive(Clone, Debug)]
pub struct Remote {
    /// The path in the other agent.
    pub path: RemotePath,
    /// Mirror on the board, if it exists.
    pub property: Option<RemoteProperty>,
}

impl Remote {
    /// Returns the path of the mirror on the board.
    pub fn mirror_path(&self) -> String {
        match &self.property {
            Some(found) => RemotePath { path: found.path.clone(), ..self.path.clone() }.mirror_path(),
            None => self.path.mirror_path(),
        }
    }
}

/// Mismatch between a link to another agent and its source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkMismatch {
    /// Description of the error.
    pub message: String,
    /// Help for the user.
    pub help: String,
}

/// Property that every module has in addition to its ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Implied {
    /// Parameters of the module.
    Params,
    /// Switch of the module.
    Enabled,
    /// Condition of the module.
    State,
    /// Durations of its last ticks.
    Timing,
    /// Histogram of the durations of its ticks.
    Histogram,
}

impl Implied {
    /// Returns the property with that name.
    pub fn of(name: &str) -> Option<Self> {
        [Self::Params, Self::Enabled, Self::State, Self::Timing, Self::Histogram]
            .into_iter()
            .find(|implied| implied.name() == name)
    }

    /// Returns the name of the property.
    pub fn name(self) -> &'static str {
        match self {
            Self::Params => "params",
            Self::Enabled => "enabled",
            Self::State => "state",
            Self::Timing => "timing",
            Self::Histogram => "histogram",
        }
    }
}

/// Property of a module whose plugin is not loaded yet.
#[derive(Debug, PartialEq, Eq)]
pub struct Absent {
    /// Path of the property.
    pub path: String,
    /// The module.
    pub module: String,
}

/// A composition: all that an agent creates.
pub struct Survey<'a> {
    /// The modules, in the order of the configuration.
    pub modules: Vec<Surveyed<'a>>,
    /// The links between them.
    pub links: Vec<ResolvedLink<'a>>,
    /// Targets of links whose modules are not loaded.
    pub absent: Vec<Absent>,
    /// Targets of links in other agents.
    pub remote: Vec<Remote>,
    /// Properties that are played from a recording.
    pub played: Arc<[Played]>,
    /// Carriers of values of other agents; any carrier when this is empty.
    pub carriers: SortedSet<String>,
    /// Support for JPEG compression of these values.
    pub has_jpeg: bool,
    /// Links to other agents that do not fit their source, by the port that they fill.
    /// Each waits until the source changes.
    pub mismatches: SortedMap<String, LinkMismatch>,
    /// The provider of the service of each port: a port of another module, or the host.
    pub services: SortedMap<(usize, usize), Option<(usize, usize)>>,
    /// Per stage, levels of modules.
    pub order: Vec<Vec<Vec<usize>>>,
    /// Modules with links to a path, once per link, also those that are not loaded yet.
    pub listeners: SortedMap<String, Vec<&'a str>>,
}

/// Resolved link.
/// A port whose links resolve to the same stays untouched when links change.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkSignature {
    /// Path of the property; the field that is read follows.
    pub path: String,
    from: String,
    field: String,
    /// Kind of the link: the port has its own property; the link waits for its source.
    kind: (bool, bool),
    /// Epoch of the mirror of another agent's property.
    epoch: u64,
    /// Flag of a source that links write.
    is_written: bool,
    previous: bool,
    delayed: bool,
    stale: Option<u64>,
    options: [Option<String>; 4],
    /// Value of the unlinked part of the port, if links fill parts of it.
    value: Option<Vec<u8>>,
}

impl<'a> Survey<'a> {
    /// Returns the path of a link's source.
    pub fn path(&self, configuration: &Configuration, target: LinkSource) -> String {
        match target {
            LinkSource::Port(module, port) => {
                let surveyed = &self.modules[module];
                format!("{}/{}", surveyed.module.name.value, surveyed.description.ports[port].name)
            }
            LinkSource::Implied(module, implied) => {
                format!("{}/{}", self.modules[module].module.name.value, implied.name())
            }
            LinkSource::Command(actuator) => {
                format!("{}/command", configuration.actuators()[actuator].name.value)
            }
            LinkSource::Gate(actuator) => {
                format!("{}/gate", configuration.actuators()[actuator].name.value)
            }
            LinkSource::Absent(absent) => self.absent[absent].path.clone(),
            LinkSource::Remote(remote) => self.remote[remote].mirror_path(),
            LinkSource::Host(host) => host.path().into(),
            LinkSource::Played(played) => self.played[played].path.clone(),
        }
    }

    /// Returns the links of a module, by port.
    pub fn link_signatures(
        &self,
        configuration: &Configuration,
        module: usize,
    ) -> SortedMap<LinkEnd, Vec<LinkSignature>> {
        let mut link_signatures: SortedMap<_, Vec<_>> = SortedMap::new();
        for resolved in self.links.iter().filter(|resolved| resolved.port.0 == module) {
            let link = resolved.link;
            let value = match resolved.port.1 {
                LinkEnd::Port(port) if !resolved.is_plain() => {
                    self.modules[module].inputs.get(&port).cloned()
                }
                _ => None,
            };
            let is_pending = matches!(resolved.conversion, LinkConversion::Pending(_));
            link_signatures.entry(resolved.port.1).or_default().push(LinkSignature {
                path: self.path(configuration, resolved.target),
                from: resolved.from.clone(),
                field: resolved.field.clone(),
                kind: (!resolved.is_plain(), is_pending),
                epoch: match resolved.target {
                    LinkSource::Remote(remote) => {
                        self.remote[remote].property.as_ref().map_or(0, |property| property.epoch)
                    }
                    _ => 0,
                },
                is_written: self.is_written(resolved.target),
                previous: resolved.previous,
                delayed: resolved.delayed,
                stale: link.stale.as_ref().map(|stale| stale.value),
                options: [
                    link.filter.every.as_ref().map(|every| every.value.to_string()),
                    link.filter.when.as_ref().map(|when| when.value.clone()),
                    link.policy.as_ref().map(|policy| format!("{:?}", policy.value)),
                    link.window.as_ref().map(|window| window.value.to_string()),
                ],
                value,
            });
        }
        link_signatures
    }

    /// Returns whether the source of a link is a port or a switch that links fill.
    fn is_written(&self, target: LinkSource) -> bool {
        let port = match target {
            LinkSource::Port(module, port) => (module, LinkEnd::Port(port)),
            LinkSource::Implied(module, Implied::Enabled) => (module, LinkEnd::Enabled),
            _ => return false,
        };
        self.links.iter().any(|resolved| resolved.port == port)
    }

    /// Collects the readers of each path.
    fn collect_listeners(&mut self, configuration: &'a Configuration) {
        let mut listeners: SortedMap<String, Vec<&'a str>> = SortedMap::new();
        for resolved in &self.links {
            let name = self.modules[resolved.port.0].module.name.value.as_str();
            listeners.entry(self.path(configuration, resolved.target)).or_default().push(name);
        }
        let names = || configuration.modules().iter().map(|module| module.name.value.as_str());
        let is_surveyed = |name: &str| self.modules.iter().any(|surveyed| surveyed.module.name.value == name);
        for link in configuration.links() {
            let (to, from) = (link.destination(), Some(link.from.value.clone()));
            // A module that sends has the link of its outbox.
            for (own, other) in [(&to, &from), (&from, &to)] {
                let (Some(own), Some(other)) = (own, other) else { continue };
                let own = own.path_in("");
                let owns = |name: &&str| own.strip_prefix(*name).is_some_and(|rest| rest.starts_with('/'));
                let owner = names().filter(owns).max_by_key(|name| name.len());
                let Some(owner) = owner.filter(|owner| !is_surveyed(owner)) else { continue };
                // Which part of it is a field is not known yet.
                let mut path = other.path_in("");
                while let Some((shorter, _)) =
                    path.rsplit_once('/').map(|(a, b)| (a.to_owned(), b.to_owned()))
                {
                    listeners.entry(path).or_default().push(owner);
                    path = shorter;
                }
            }
        }
        self.listeners = listeners;
    }
}

/// Checks a configuration against the kinds of a catalogue.
/// All errors are added to `collector`.
pub fn survey<'a>(
    configuration: &'a Configuration,
    catalogue: &Catalogue,
    collector: &mut DiagnosticCollector<'a>,
) -> Survey<'a> {
    let mut modules = Vec::new();
    // Their ports are unknown: links to them are not checked.
    let (mut dormant, mut is_complete) = (Vec::new(), true);
    for module in configuration.modules() {
        if catalogue.is_dormant(&module.kind.value) {
            dormant.push(module.name.value.as_str());
        } else if let Some(surveyed) = module::survey_module(configuration, module, catalogue, collector) {
            modules.push(surveyed);
        } else {
            dormant.push(module.name.value.as_str());
            is_complete = false;
        }
    }
    collector.add_deferred();
    check_unique(configuration, &modules, collector);
    check_time_source(configuration, &modules, collector);
    aspects::check_single(configuration, &modules, collector);
    let services = aspects::survey_services(&modules, catalogue, collector);
    let mut survey = Survey {
        modules,
        links: Vec::new(),
        absent: Vec::new(),
        played: Arc::clone(&catalogue.played),
        carriers: SortedSet::new(),
        has_jpeg: false,
        remote: Vec::new(),
        mismatches: SortedMap::new(),
        services,
        order: Vec::new(),
        listeners: SortedMap::new(),
    };
    links::survey_links(configuration, &dormant, catalogue, &mut survey, collector);
    rules::check_rules(configuration, &survey, collector);
    aspects::check_blocks(&survey, catalogue, collector);
    // The order can only be determined when every module is known.
    if is_complete {
        survey.collect_listeners(configuration);
        robot_model::check_robot_models(configuration, &dormant, &survey, collector);
        hardware::check_hardware(configuration, &dormant, &survey, collector);
        survey.order = order::survey_order(configuration, &survey.modules, &survey.links, collector);
        if collector.diagnostics.is_empty() {
            rings::check_rings(&survey.modules, &survey.links, collector);
        }
    }
    survey
}

/// Checks that the time source is one of the modules.
fn check_time_source(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    collector: &mut DiagnosticCollector<'_>,
) {
    let Some(source) = configuration.time_source() else { return };
    let names = configuration.modules().iter().map(|module| module.name.value.as_str());
    if !names.clone().any(|name| name == source.value) {
        collector.add(
            source.span,
            ErrorCode::TimeSource.of(format!("no module `{}` to be the time source", source.value)),
            suggest(&source.value, names),
        );
    } else if collector.diagnostics.is_empty()
        && !modules.iter().any(|surveyed| surveyed.module.name.value == source.value)
    {
        let message = ErrorCode::TimeSource
            .of(format!("the time source `{}` is of a plugin that is not loaded", source.value));
        collector.add(source.span, message, "load it, or choose another time source");
    }
}

/// Returns the robot that a module belongs to; empty for none.
pub fn scope(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(scope, _)| scope)
}

/// Checks for at most one Plan, Execute and Knowledge per robot (RoCS, 5.1).
fn check_unique(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    collector: &mut DiagnosticCollector<'_>,
) {
    for (first, second) in duplicates(configuration, modules) {
        let (first, second) = (&modules[first], &modules[second]);
        let (part, name) = (&second.description.unique, &second.module.name.value);
        let place = collector.place(first.module.name.span);
        let first = &first.module.name.value;
        let message = format!("a robot has one {part}, and `{first}` ({place}) is it already");
        let help = format!("remove `{name}` or put it into another robot");
        collector.add(second.module.name.span, ErrorCode::Second.of(message), help);
    }
}

/// Finds duplicates of parts that a robot has only once.
/// Each follows the part that its robot already has. Modules of an included file come first.
fn duplicates(configuration: &Configuration, modules: &[Surveyed<'_>]) -> Vec<(usize, usize)> {
    let (mut firsts, mut duplicates) = (SortedMap::new(), Vec::new());
    let mut sorted: Vec<_> = modules.iter().enumerate().collect();
    sorted.sort_by_key(|(_, surveyed)| {
        let span = surveyed.module.name.span;
        (configuration.rank(span), span)
    });
    for (index, surveyed) in sorted {
        let part = surveyed.description.unique.as_str();
        if !part.is_empty() {
            let first = *firsts.entry((scope(&surveyed.module.name.value), part)).or_insert(index);
            if first != index {
                duplicates.push((first, index));
            }
        }
    }
    duplicates
}

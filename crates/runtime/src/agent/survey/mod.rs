//! What configuration asks for, checked against what the plugins offer; nothing is made here.

mod aspects;
mod levels;
mod links;
mod module;
mod order;

use std::collections::BTreeMap;

use slate_blackboard::nearest_names;
use slate_module::{Description, ModuleKind, Stage, Trigger};

use super::catalogue::Catalogue;
use crate::configuration::{Configuration, Diagnostic, Link, Module, Span};
use crate::runner::OwnSetup;

/// Ports that every module has beside its own.
pub(super) const RESERVED: [&str; 5] = ["params", "enabled", "state", "timing", "histogram"];

/// Another one that isolated modules have.
const RESERVED_WHEN_ISOLATED: &str = "process";

/// A module that will be made.
pub(super) struct Surveyed<'a> {
    pub module: &'a Module,
    pub kind: ModuleKind,
    pub description: Description,
    pub stage: Stage,
    pub trigger: Trigger,
    pub deadline: Option<u64>,
    pub params: Vec<u8>,
    pub setup: OwnSetup,
    /// Values of unlinked inputs, by port.
    pub inputs: BTreeMap<usize, Vec<u8>>,
}

/// A link between two ports.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint<'a> {
    pub link: &'a Link,
    /// The module and the port that the link belongs to: an input or an outbox.
    pub port: (usize, Wire),
    /// The module and the port that it leads to.
    pub target: Target,
}

/// What a link ends at in its own module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Wire {
    Port(usize),
    Enabled,
}

/// What a link leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// A port of a module.
    Port(usize, usize),
    /// The command of an actuator that passed its gate.
    Command(usize),
    /// A property of a module whose plugin is not loaded; an index of [`Survey::absent`].
    Absent(usize),
}

/// A property that will be written, or read, when a plugin is loaded.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Absent {
    /// Path of the property.
    pub path: String,
    /// The module.
    pub module: String,
}

/// Everything that will be made.
pub(super) struct Survey<'a> {
    pub modules: Vec<Surveyed<'a>>,
    pub joints: Vec<Joint<'a>>,
    /// What links lead to that is not there.
    pub absent: Vec<Absent>,
    /// Who provides a service to a port: a port of another module, or the host.
    pub services: BTreeMap<(usize, usize), Option<(usize, usize)>>,
    /// Per stage, levels of modules.
    pub order: Vec<Vec<Vec<usize>>>,
    /// The modules with links to a path, also those that are not there yet; one stands there for each link.
    pub listeners: BTreeMap<String, Vec<&'a str>>,
}

/// What a link comes to: what decides whether a port can go on as it is when links change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Lead {
    /// The path of the property.
    pub path: String,
    pub previous: bool,
    pub stale: Option<u64>,
}

impl<'a> Survey<'a> {
    /// The path of what a link leads to.
    pub fn path(&self, configuration: &Configuration, target: Target) -> String {
        match target {
            Target::Port(module, port) => {
                let surveyed = &self.modules[module];
                format!("{}/{}", surveyed.module.name.value, surveyed.description.ports[port].name)
            }
            Target::Command(actuator) => {
                format!("{}/command", configuration.actuators()[actuator].name.value)
            }
            Target::Absent(absent) => self.absent[absent].path.clone(),
        }
    }

    /// The links of a module.
    pub fn leads(&self, configuration: &Configuration, module: usize) -> BTreeMap<Wire, Vec<Lead>> {
        let mut leads: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for joint in self.joints.iter().filter(|joint| joint.port.0 == module) {
            leads.entry(joint.port.1).or_default().push(Lead {
                path: self.path(configuration, joint.target),
                previous: joint.link.previous,
                stale: joint.link.stale.as_ref().map(|stale| stale.value),
            });
        }
        leads
    }

    /// Finds out who reads what.
    fn listen(&mut self, configuration: &'a Configuration) {
        let mut listeners: BTreeMap<String, Vec<&'a str>> = BTreeMap::new();
        for joint in &self.joints {
            let name = self.modules[joint.port.0].module.name.value.as_str();
            listeners.entry(self.path(configuration, joint.target)).or_default().push(name);
        }
        let names = || configuration.modules().iter().map(|module| module.name.value.as_str());
        let there = |name: &str| self.modules.iter().any(|surveyed| surveyed.module.name.value == name);
        for link in configuration.links() {
            let owns =
                |name: &&str| link.to.value.strip_prefix(*name).is_some_and(|rest| rest.starts_with('/'));
            let owner = names().filter(owns).max_by_key(|name| name.len());
            if let Some(owner) = owner.filter(|owner| !there(owner)) {
                listeners.entry(link.from.value.path_in("")).or_default().push(owner);
            }
        }
        self.listeners = listeners;
    }
}

/// Collects complaints.
pub(super) struct Complaints<'a> {
    configuration: &'a Configuration,
    pub diagnostics: Vec<Diagnostic>,
}

impl<'a> Complaints<'a> {
    pub fn new(configuration: &'a Configuration) -> Self {
        Self { configuration, diagnostics: Vec::new() }
    }

    pub fn add(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        let help: String = help.into();
        self.diagnostics.push(self.configuration.diagnostic(span, message, Some(help)));
    }
}

/// Words for "did you mean".
fn suggest<'n>(name: &str, names: impl Iterator<Item = &'n str> + Clone) -> String {
    let near = nearest_names(name, names.clone());
    if near.is_empty() {
        format!("there are: {}", names.collect::<Vec<_>>().join(", "))
    } else {
        format!("did you mean {}?", near.join(" or "))
    }
}

pub(super) fn survey<'a>(
    configuration: &'a Configuration,
    catalogue: &Catalogue,
    complaints: &mut Complaints<'a>,
) -> Survey<'a> {
    let mut modules = Vec::new();
    let mut dormant = Vec::new();
    for module in configuration.modules() {
        if catalogue.is_dormant(&module.plugin.value) {
            dormant.push(module.name.value.as_str());
        } else if let Some(surveyed) = module::survey_module(configuration, module, catalogue, complaints) {
            modules.push(surveyed);
        }
    }
    check_unique(&modules, complaints);
    check_time_source(configuration, &modules, complaints);
    aspects::check_single(configuration, &modules, complaints);
    let services = aspects::survey_services(&modules, catalogue, complaints);
    let mut survey = Survey {
        modules,
        joints: Vec::new(),
        absent: Vec::new(),
        services,
        order: Vec::new(),
        listeners: BTreeMap::new(),
    };
    // Links can only be judged when every module is known.
    if survey.modules.len() + dormant.len() == configuration.modules().len() {
        links::survey_links(configuration, &dormant, &mut survey, complaints);
        survey.listen(configuration);
        survey.order = order::survey_order(configuration, &survey.modules, &survey.joints, complaints);
    }
    survey
}

/// The time source is one of the modules.
fn check_time_source(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    complaints: &mut Complaints<'_>,
) {
    let Some(source) = configuration.time_source() else { return };
    let names = configuration.modules().iter().map(|module| module.name.value.as_str());
    if !names.clone().any(|name| name == source.value) {
        complaints.add(
            source.span,
            format!("no module `{}` to be the time source", source.value),
            suggest(&source.value, names),
        );
    } else if complaints.diagnostics.is_empty()
        && !modules.iter().any(|surveyed| surveyed.module.name.value == source.value)
    {
        let message = format!("the time source `{}` is of a plugin that is not loaded", source.value);
        complaints.add(source.span, message, "load it, or choose another time source");
    }
}

/// The robot that a module belongs to.
pub(super) fn scope(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(scope, _)| scope)
}

/// One Plan, one Execute, one Knowledge per robot (RoCS, 5.1).
fn check_unique(modules: &[Surveyed<'_>], complaints: &mut Complaints<'_>) {
    let mut seen: BTreeMap<(&str, &str), &str> = BTreeMap::new();
    for surveyed in modules {
        let name = surveyed.module.name.value.as_str();
        let part = surveyed.description.unique.as_str();
        if part.is_empty() {
            continue;
        }
        if let Some(first) = seen.insert((scope(name), part), name) {
            let message = format!("a robot has one {part}, and `{first}` is it already");
            complaints.add(
                surveyed.module.name.span,
                message,
                format!("remove `{name}` or put it into another robot"),
            );
        }
    }
}

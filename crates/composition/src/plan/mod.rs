//! Build plan: queries for all that an agent makes of a survey.

mod gates;
mod planned_port;
mod properties;

use slate_blackboard::channel::Budget;
use slate_configuration::Configuration;
use slate_module::{Direction, PortDescription, Trigger};

use crate::survey::{LinkSource, ResolvedLink, Survey, Surveyed};
use crate::{LinkEnd, survey};
pub use gates::{PlannedGate, planned_gate};
pub use planned_port::PlannedPort;
pub use properties::{
    PlannedProperty, SAME_ACTUATOR, SAME_PATH, gate_stores, interface_conflict, planned_properties,
    reader_refusal, shallow_source,
};

/// Reader handles for tools, and for modules that come later.
pub const SPARE_READERS: u16 = 16;
/// Queue readers for tools, and for modules that come later.
const SPARE_QUEUES: u16 = 4;
/// Default window of a queue whose reader is not loaded yet, in values.
const USUAL_WINDOW: usize = 16;

/// Error whose diagnostic was added.
struct PlanRefusal;

/// Configuration and survey, with the queries of a builder.
#[derive(Clone, Copy)]
pub struct BuildPlan<'a, 's> {
    /// Configuration with the inferred links.
    pub configuration: &'a Configuration,
    /// Modules and links of it.
    pub survey: &'s Survey<'a>,
}

impl<'a, 's> BuildPlan<'a, 's> {
    /// Returns a module by its index.
    pub fn surveyed(self, module: usize) -> &'s Surveyed<'a> {
        &self.survey.modules[module]
    }

    /// Returns the name of a module.
    pub fn name(self, module: usize) -> &'a str {
        &self.surveyed(module).module.name.value
    }

    /// Returns a port of a module.
    pub fn port(self, module: usize, port: usize) -> &'s PortDescription {
        &self.surveyed(module).description.ports[port]
    }

    /// Returns the part that writes a link's source, for readers in other agents.
    pub fn part(self, target: LinkSource) -> &'static str {
        match target {
            LinkSource::Port(module, port) => {
                survey::part(&self.surveyed(module).description, self.port(module, port))
            }
            _ => "",
        }
    }

    /// Returns the path of a port.
    pub fn port_path(self, module: usize, port: usize) -> String {
        format!("{}/{}", self.name(module), self.port(module, port).name)
    }

    /// Returns the link of a port that reads a property directly.
    pub fn link(self, module: usize, link_end: LinkEnd) -> Option<&'s ResolvedLink<'a>> {
        self.links(module, link_end).find(|resolved| resolved.is_plain())
    }

    /// Returns true if a port has a property of its own that links fill.
    pub fn is_converted(self, module: usize, link_end: LinkEnd) -> bool {
        self.links(module, link_end).any(|resolved| !resolved.is_plain())
    }

    /// Returns the links of a port.
    pub fn links(self, module: usize, link_end: LinkEnd) -> impl Iterator<Item = &'s ResolvedLink<'a>> {
        self.survey.links.iter().filter(move |resolved| resolved.port == (module, link_end))
    }

    /// Returns the path of a link's source.
    pub fn target_path(self, target: LinkSource) -> String {
        self.survey.path(self.configuration, target)
    }

    /// Returns the ports that are linked to a property.
    pub fn readers(self, target: LinkSource) -> impl Iterator<Item = &'s ResolvedLink<'a>> {
        self.survey.links.iter().filter(move |resolved| resolved.target == target)
    }

    /// Returns the depth and the number of readers of a property.
    pub fn demand(self, target: LinkSource, path: &str) -> (usize, Budget) {
        let mut budget = Budget { latest: SPARE_READERS, queues: SPARE_QUEUES, window: USUAL_WINDOW as u16 };
        let mut depth = 1;
        for resolved in self.readers(target) {
            match resolved.port {
                (module, LinkEnd::Port(port)) if self.port(module, port).direction == Direction::Queue => {
                    let said = resolved.link.window.as_ref().map(|window| window.value.into());
                    let window = said.unwrap_or(self.port(module, port).window);
                    depth = depth.max(window * 2);
                    budget.queues += 1;
                    budget.window = budget.window.max(window as u16);
                }
                _ => budget.latest += 1,
            }
        }
        // A module that is not there yet may want every value.
        let absent = self.links_to(path).any(|name| !self.is_there(name));
        (if absent { depth.max(USUAL_WINDOW * 2) } else { depth }, budget)
    }

    /// Returns true if a module exists.
    pub fn is_there(self, module: &str) -> bool {
        self.survey.modules.iter().any(|surveyed| surveyed.module.name.value == module)
    }

    /// Returns true if a path belongs to a module that does not exist yet.
    pub fn is_dormant(self, path: &str) -> bool {
        self.configuration.modules().iter().any(|module| {
            let name = module.name.value.as_str();
            let rest = path.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/')) && !self.is_there(name)
        })
    }

    /// Returns the modules with a link to a path, also absent ones.
    pub fn links_to(self, path: &str) -> impl Iterator<Item = &'a str> + use<'a, 's> {
        let listeners = self.survey.listeners.get(path);
        listeners.into_iter().flatten().copied()
    }

    /// Returns true if new values at a port trigger the module.
    pub fn triggers(self, module: usize, port: usize) -> bool {
        match &self.surveyed(module).trigger {
            Trigger::On { ports, .. } => ports.contains(&self.port(module, port).name),
            Trigger::Stage | Trigger::Every(_) => false,
        }
    }

    /// Returns the module whose output is the source of a link.
    pub fn writing(self, target: LinkSource) -> Option<usize> {
        let LinkSource::Port(module, port) = target else { return None };
        let is_output = matches!(
            self.port(module, port).direction,
            Direction::Output | Direction::Debug | Direction::Command
        );
        is_output.then_some(module)
    }

    /// Returns true if a module runs in a process of its own.
    pub fn is_isolated(self, module: usize) -> bool {
        self.surveyed(module).is_isolated
    }

    /// Returns the parameters that tools must not set, as links set them.
    /// Each comes with the source of its link.
    pub fn reserved(self, module: usize) -> Vec<(String, String)> {
        let links = self.links(module, LinkEnd::Params);
        links.map(|resolved| (resolved.field.clone(), resolved.link.from.value.to_string())).collect()
    }
}

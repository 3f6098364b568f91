//! Makes what the survey found to be right: properties, links, gates, instances.

mod actuators;
mod properties;
mod runners;

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::{Board, BoardError, Property};
use slate_module::{Direction, Plugin, PortDescription, Trigger};
use slate_safety::StopLatch;

use super::survey::{Complaints, Joint, Survey, Target, Wire, survey};
use crate::actuators::Actuator;
use crate::configuration::{Configuration, Report};
use crate::log::Logger;
use crate::runner::Runner;

/// Reader handles that tools may take beside those of links.
const SPARE_READERS: u16 = 4;

/// What an agent consists of.
pub(super) struct Built {
    pub board: Arc<Board>,
    pub runners: Vec<Runner>,
    /// Per stage, levels of runners.
    pub order: Vec<Vec<Vec<usize>>>,
    /// Whether a runner waits for something or has a period, rather than running in every cycle.
    pub waits: Vec<bool>,
    pub actuators: Vec<Arc<Actuator>>,
}

pub(super) fn build(
    configuration: &Configuration,
    plugins: &[Plugin],
    logger: &Logger,
    lockstep: bool,
    stop: &StopLatch,
) -> Result<Built, Report> {
    let mut complaints = Complaints::new(configuration);
    let survey = survey(configuration, plugins, &mut complaints);
    if !complaints.diagnostics.is_empty() {
        return Err(Report::from(complaints.diagnostics));
    }
    let board = Arc::new(Board::new(configuration.agent_name()));
    let mut builder = Builder { configuration, survey: &survey, board: &board, complaints, index: 0 };
    let Ok(properties) = builder.properties() else {
        return Err(Report::from(builder.complaints.diagnostics));
    };
    let actuators = builder.actuators(stop);
    if !builder.complaints.diagnostics.is_empty() {
        return Err(Report::from(builder.complaints.diagnostics));
    }
    let runners = builder.runners(&properties, &actuators, logger, lockstep);
    if !builder.complaints.diagnostics.is_empty() {
        return Err(Report::from(builder.complaints.diagnostics));
    }
    let waits = survey.modules.iter().map(|module| module.trigger != Trigger::Stage).collect();
    Ok(Built { board, runners, order: survey.order, waits, actuators })
}

struct Builder<'a, 's> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    board: &'s Arc<Board>,
    complaints: Complaints<'a>,
    /// Counts outputs, for the digest.
    index: u32,
}

/// The properties of a module's ports, by port; nothing for linked inputs and outboxes.
type PortProperties = Vec<Vec<Option<Arc<Property>>>>;

struct Failed;

impl<'a> Builder<'a, '_> {
    fn name(&self, module: usize) -> &'a str {
        &self.survey.modules[module].module.name.value
    }

    fn port(&self, module: usize, port: usize) -> &PortDescription {
        &self.survey.modules[module].description.ports[port]
    }

    /// The link of an input or an outbox.
    fn joint(&self, module: usize, wire: Wire) -> Option<&Joint<'a>> {
        self.survey.joints.iter().find(|joint| joint.port == (module, wire))
    }

    fn added<T>(&mut self, module: usize, result: Result<T, BoardError>) -> Result<T, Failed> {
        result.map_err(|error| {
            let span = self.survey.modules[module].module.name.span;
            self.complaints.add(span, error.to_string(), "rename one of the two");
            Failed
        })
    }

    fn target_path(&self, target: Target) -> String {
        match target {
            Target::Port(module, port) => format!("{}/{}", self.name(module), self.port(module, port).name),
            Target::Command(actuator) => {
                format!("{}/command", self.configuration.actuators()[actuator].name.value)
            }
        }
    }

    /// The ports that are linked to a property.
    fn readers(&self, target: Target) -> impl Iterator<Item = &Joint<'a>> {
        self.survey.joints.iter().filter(move |joint| joint.target == target)
    }

    /// How many values a property keeps, and how many readers it serves.
    fn demand(&self, target: Target) -> (usize, Budget) {
        let mut budget = Budget { latest: SPARE_READERS, queues: 1, window: 16 };
        let mut depth = 1;
        for joint in self.readers(target) {
            match joint.port {
                (module, Wire::Port(port)) if self.port(module, port).direction == Direction::Queue => {
                    let window = self.port(module, port).window;
                    depth = depth.max(window * 2);
                    budget.queues += 1;
                    budget.window = budget.window.max(window as u16);
                }
                _ => budget.latest += 1,
            }
        }
        (depth, budget)
    }
}

fn new_writer(property: &Property) -> Option<Writer> {
    property.channel()?.writer().ok()
}

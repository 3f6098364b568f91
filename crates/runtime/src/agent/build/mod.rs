//! Makes what the survey found to be right: properties, links, gates, instances.

mod actuators;
mod deepening;
mod isolation;
mod properties;
mod rewiring;
mod runners;
mod wiring;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, BoardError, Placement, Property};
use slate_module::aspect::{MainLoop, Service};
use slate_module::{Direction, PortDescription, Trigger};
use slate_safety::StopLatch;

use super::Mode;
use crate::actuators::Actuator;
use crate::aspects::{Means, ServicePlace};
use crate::configuration::{Configuration, Diagnostic};
use crate::isolation::Arenas;
use crate::log::Logger;
use crate::runner::{Health, InputAge, Patience, QueueGauge, Runner};
pub(super) use deepening::deepening;
pub(super) use rewiring::{Rewiring, rewire};
use slate_composition::{Complaints, Joint, Survey, Surveyed, Target, Wire, needs};

/// Reader handles for tools, and for modules that come later.
const SPARE_READERS: u16 = 16;
/// The same for readers of every value.
const SPARE_QUEUES: u16 = 4;
/// What a module that comes later may want of a queue, when its plugin does not say.
const USUAL_WINDOW: usize = 16;

/// What outlives the modules: they come and go, and what they share with others stays.
pub(super) struct Ground {
    pub board: Arc<Board>,
    pub logger: Arc<Logger>,
    /// How long a module's call may take before it hangs.
    pub hang: Duration,
    pub lockstep: bool,
    pub mode: Mode,
    pub stop: StopLatch,
    /// By module, also of modules that are not there yet.
    pub posts: BTreeMap<String, Post>,
    /// By name.
    pub actuators: BTreeMap<String, Arc<Actuator>>,
    /// Services that modules provide, by the path of the port.
    pub services: BTreeMap<String, Arc<ServicePlace>>,
    /// What the host's services are made of.
    pub means: Means,
    /// Counts outputs, for the digest.
    pub index: u32,
    /// How queue inputs keep up, by the path of the port.
    pub gauges: BTreeMap<String, Arc<QueueGauge>>,
    /// How old the values of other inputs are, by the path of the port.
    pub ages: BTreeMap<String, Arc<InputAge>>,
    /// Wakes who sends messages to other agents.
    pub sharing_wake: Arc<Wake>,
    /// Memory that isolated modules see.
    pub arenas: Arenas,
    /// What was set in modules that are away for a moment, by path.
    pub kept: BTreeMap<String, Kept>,
}

/// A value that a user or a tool has set.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    /// The schema that it has.
    pub schema: u64,
    pub bytes: Vec<u8>,
    /// When it was set.
    pub time: u64,
}

/// What others know of a module.
#[derive(Clone)]
pub(super) struct Post {
    pub health: Arc<Health>,
    pub commit: CommitWord,
    pub wake: Arc<Wake>,
}

impl Ground {
    /// Without anything on it yet.
    pub fn new(
        means: Means,
        hang: Duration,
        lockstep: bool,
        mode: Mode,
        stop: StopLatch,
        arenas: Arenas,
    ) -> Self {
        Self {
            board: Arc::clone(&means.board),
            logger: Arc::clone(&means.logger),
            hang,
            lockstep,
            mode,
            stop,
            posts: BTreeMap::new(),
            actuators: BTreeMap::new(),
            services: BTreeMap::new(),
            means,
            index: 0,
            gauges: BTreeMap::new(),
            ages: BTreeMap::new(),
            sharing_wake: Arc::default(),
            arenas,
            kept: BTreeMap::new(),
        }
    }

    /// The post of a module of that name.
    pub fn post(&mut self, module: &str) -> Post {
        let post = self.posts.entry(module.into()).or_insert_with(|| Post {
            health: Arc::new(Health::default()),
            commit: CommitWord::new(),
            wake: Arc::new(Wake::new()),
        });
        post.clone()
    }

    /// How long the last calls of a module are waited for.
    pub fn patience(&self, module: &Arc<str>, is_isolated: bool) -> Patience {
        Patience {
            module: Arc::clone(module),
            limit: (!is_isolated).then_some(self.hang),
            logger: Arc::clone(&self.logger),
            clock: Arc::clone(&self.means.clock),
        }
    }

    /// Where the service of a port is found.
    pub fn service(&mut self, path: &str) -> Arc<ServicePlace> {
        Arc::clone(self.services.entry(path.into()).or_default())
    }

    /// Whether a module gets a thread of its own. Nobody waits for an isolated one on the wall clock, and one that may
    /// take the loop is on the loop, where it is watched.
    pub fn has_own_thread(&self, surveyed: &Surveyed<'_>) -> bool {
        let threaded = self.mode == Mode::Threaded && surveyed.trigger != Trigger::Stage;
        let isolated = surveyed.module.isolated.value && !self.lockstep;
        (threaded || isolated) && !needs(&surveyed.description, MainLoop::DESCRIPTOR.hash)
    }
}

/// Makes the modules of the survey that are listed, by index.
pub(super) fn build(
    configuration: &Configuration,
    survey: &Survey<'_>,
    ground: &mut Ground,
    arriving: &[usize],
) -> Result<Vec<Runner>, Vec<Diagnostic>> {
    let complaints = Complaints::new(configuration);
    let mut builder = Builder {
        configuration,
        survey,
        ground,
        complaints,
        placements: Vec::new(),
        kept: BTreeSet::new(),
        made: Made::AtStart,
    };
    let runners = builder.all(arriving);
    if builder.complaints.diagnostics.is_empty() { Ok(runners) } else { Err(builder.complaints.diagnostics) }
}

struct Builder<'a, 's> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    ground: &'s mut Ground,
    complaints: Complaints<'a>,
    /// What is to stand on the board when links are exchanged.
    placements: Vec<Placement>,
    /// Ports that links filled before, and fill again.
    kept: BTreeSet<(usize, Wire)>,
    made: Made,
}

/// When properties are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Made {
    /// With their module: configured values have the time 0.
    AtStart,
    /// For other links of a module that goes on, at that time of the agent.
    Later(u64),
    /// To find out whether links fit: no recorder hears of them.
    OnTrial,
}

impl Made {
    /// The time of a configured value.
    fn time(self) -> u64 {
        match self {
            Self::Later(now) => now,
            Self::AtStart | Self::OnTrial => 0,
        }
    }
}

struct Failed;

impl<'a> Builder<'a, '_> {
    fn all(&mut self, arriving: &[usize]) -> Vec<Runner> {
        for module in arriving {
            // What is wrong was complained about.
            let _ = self.properties(*module);
        }
        self.actuators();
        if !self.complaints.diagnostics.is_empty() {
            return Vec::new();
        }
        self.runners(arriving)
    }

    fn surveyed(&self, module: usize) -> &Surveyed<'a> {
        &self.survey.modules[module]
    }

    fn name(&self, module: usize) -> &'a str {
        &self.surveyed(module).module.name.value
    }

    fn port(&self, module: usize, port: usize) -> &PortDescription {
        &self.surveyed(module).description.ports[port]
    }

    /// The link of a port that reads a property itself.
    fn joint(&self, module: usize, wire: Wire) -> Option<&Joint<'a>> {
        self.joints(module, wire).find(|joint| joint.is_plain())
    }

    /// The links of a port that has a property of its own, which they fill.
    fn conversions(&self, module: usize, wire: Wire) -> impl Iterator<Item = &Joint<'a>> {
        self.joints(module, wire).filter(|joint| !joint.is_plain())
    }

    fn joints(&self, module: usize, wire: Wire) -> impl Iterator<Item = &Joint<'a>> {
        self.survey.joints.iter().filter(move |joint| joint.port == (module, wire))
    }

    fn added<T>(&mut self, module: usize, result: Result<T, BoardError>) -> Result<T, Failed> {
        result.map_err(|error| {
            let span = self.surveyed(module).module.name.span;
            self.complaints.add(span, error.to_string(), "rename one of the two");
            Failed
        })
    }

    fn target_path(&self, target: Target) -> String {
        self.survey.path(self.configuration, target)
    }

    /// The property at exactly that path.
    fn property(&self, path: &str) -> Option<Arc<Property>> {
        let placed = self.placements.iter().find_map(|placement| match placement {
            Placement::Property(property) if property.path() == path => Some(Arc::clone(property)),
            _ => None,
        });
        if placed.is_some() {
            return placed;
        }
        let (property, field) = self.ground.board.get(path)?;
        (field.is_empty() && property.path() == path).then_some(property)
    }

    /// Looks at what stands at a path already: nothing, or a property of that interface. One of another interface that
    /// nobody reads any more makes room.
    fn standing(
        &mut self,
        module: usize,
        path: &str,
        descriptor: &Descriptor,
    ) -> Result<Option<Arc<Property>>, Failed> {
        let Some(property) = self.property(path) else { return Ok(None) };
        if property.descriptor().hash == descriptor.hash {
            return Ok(Some(property));
        }
        if property.has_writer()
            || self.survey.joints.iter().any(|joint| self.target_path(joint.target) == path)
        {
            let message = format!(
                "`/{path}` is {} {:016x}, but its readers were linked to {} {:016x}",
                descriptor.name,
                descriptor.hash,
                property.descriptor().name,
                property.descriptor().hash
            );
            let span = self.surveyed(module).module.name.span;
            self.complaints.add(span, message, "build both with the same version of the interface");
            return Err(Failed);
        }
        // It was there a moment ago.
        let _ = self.ground.board.remove(path);
        Ok(None)
    }

    /// The ports that are linked to a property.
    fn readers(&self, target: Target) -> impl Iterator<Item = &Joint<'a>> {
        self.survey.joints.iter().filter(move |joint| joint.target == target)
    }

    /// How many values a property keeps, and how many readers it serves.
    fn demand(&self, target: Target, path: &str) -> (usize, Budget) {
        let mut budget = Budget { latest: SPARE_READERS, queues: SPARE_QUEUES, window: USUAL_WINDOW as u16 };
        let mut depth = 1;
        for joint in self.readers(target) {
            match joint.port {
                (module, Wire::Port(port)) if self.port(module, port).direction == Direction::Queue => {
                    let said = joint.link.window.as_ref().map(|window| window.value.into());
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

    fn is_there(&self, module: &str) -> bool {
        self.survey.modules.iter().any(|surveyed| surveyed.module.name.value == module)
    }

    /// The modules with a link to that path, also those that are not there yet.
    fn links_to<'p>(&'p self, path: &'p str) -> impl Iterator<Item = &'a str> + 'p {
        let listeners = self.survey.listeners.get(path);
        listeners.into_iter().flatten().copied()
    }

    /// What wakes the threads of the modules that are linked to that path.
    fn wakes(&mut self, path: &str) -> Vec<Arc<Wake>> {
        let names: BTreeSet<_> = self.links_to(path).collect();
        names.into_iter().filter_map(|name| self.wake_of(name)).collect()
    }

    /// What wakes a module's thread, if it has or may get one.
    fn wake_of(&mut self, name: &str) -> Option<Arc<Wake>> {
        let surveyed = self.survey.modules.iter().find(|surveyed| surveyed.module.name.value == name);
        let threaded = match surveyed {
            Some(surveyed) => self.ground.has_own_thread(surveyed),
            None => self.ground.mode == Mode::Threaded || !self.ground.lockstep,
        };
        threaded.then(|| self.ground.post(name).wake)
    }
}

fn new_writer(property: &Property) -> Option<Writer> {
    property.channel()?.writer().ok()
}

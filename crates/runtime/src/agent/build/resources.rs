//! Resources that outlive the modules.
//! Modules come and go, but the resources that they share with others stay.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::commit::CommitWord;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board};
use slate_module::Trigger;
use slate_module::aspect::{MainLoop, Service};
use slate_safety::StopLatch;
use slate_sorted::{SortedMap, SortedSet};

use crate::agent::Mode;
use crate::aspects::{ServiceContext, ServiceSlot};
use slate_composition::{Surveyed, needs};
use slate_engine::actuators::Actuator;
use slate_engine::isolation::Arenas;
use slate_engine::log::Logger;
use slate_engine::runner::{CallTimeout, Health, InputAge, ModuleCondition, QueueGauge};

/// Resources of the host for all modules, also those that do not exist yet.
pub(in crate::agent) struct HostResources {
    pub board: Arc<Board>,
    pub logger: Arc<Logger>,
    /// Duration of a module's call after which it counts as hanging.
    pub hang: Duration,
    pub lockstep: bool,
    pub mode: Mode,
    pub stop: StopLatch,
    /// Signals by module, also of modules that do not exist yet.
    pub signals: SortedMap<String, ModuleSignals>,
    /// Actuators by name.
    pub actuators: SortedMap<String, Arc<Actuator>>,
    /// Services that modules provide, by the path of the port.
    pub services: SortedMap<String, Arc<ServiceSlot>>,
    /// Means of the host's services.
    pub service_context: ServiceContext,
    /// Number of outputs, for the digest.
    pub index: u32,
    /// Gauges of queue inputs, by the path of the port.
    pub gauges: SortedMap<String, Arc<QueueGauge>>,
    /// Ages of the values of other inputs, by the path of the port.
    pub ages: SortedMap<String, Arc<InputAge>>,
    /// Wake of the thread that sends messages to other agents.
    pub sharing_wake: Arc<Wake>,
    /// Memory that isolated modules see.
    pub arenas: Arenas,
    /// Values set in modules that are unloaded for a moment, by path.
    pub kept: SortedMap<String, KeptSetting>,
}

/// A value that a user or a tool has set.
#[derive(Clone, Debug)]
pub(in crate::agent) struct KeptSetting {
    /// Schema of the value.
    pub schema: u64,
    pub bytes: Vec<u8>,
    /// Time at which it was set.
    pub time: u64,
}

/// Signals of a module for others.
#[derive(Clone)]
pub(in crate::agent) struct ModuleSignals {
    pub health: Arc<Health>,
    pub commit: CommitWord,
    pub wake: Arc<Wake>,
}

/// Paths and actuators before a change, to which a failure returns.
pub(in crate::agent) struct ResourceMark {
    paths: SortedSet<String>,
    actuators: SortedSet<String>,
}

impl ResourceMark {
    /// Returns true if an actuator existed before the change.
    pub fn has_actuator(&self, name: &str) -> bool {
        self.actuators.contains(name)
    }
}

impl HostResources {
    /// Makes empty resources.
    pub fn new(
        service_context: ServiceContext,
        hang: Duration,
        lockstep: bool,
        mode: Mode,
        stop: StopLatch,
        arenas: Arenas,
    ) -> Self {
        Self {
            board: Arc::clone(&service_context.board),
            logger: Arc::clone(&service_context.logger),
            hang,
            lockstep,
            mode,
            stop,
            signals: SortedMap::new(),
            actuators: SortedMap::new(),
            services: SortedMap::new(),
            service_context,
            index: 0,
            gauges: SortedMap::new(),
            ages: SortedMap::new(),
            sharing_wake: Arc::default(),
            arenas,
            kept: SortedMap::new(),
        }
    }

    /// Returns the signals of a module.
    pub fn signals(&mut self, module: &str) -> ModuleSignals {
        let signals = self.signals.entry(module.into()).or_insert_with(|| ModuleSignals {
            health: Arc::new(Health::default()),
            commit: CommitWord::new(),
            wake: Arc::new(Wake::new()),
        });
        signals.clone()
    }

    /// Returns the time limit for the last calls of a module.
    pub fn timeout(&self, module: &Arc<str>, is_isolated: bool) -> CallTimeout {
        CallTimeout {
            module: Arc::clone(module),
            limit: (!is_isolated).then_some(self.hang),
            logger: Arc::clone(&self.logger),
            clock: Arc::clone(&self.service_context.clock),
        }
    }

    /// Returns the place of a port's service.
    pub fn service(&mut self, path: &str) -> Arc<ServiceSlot> {
        Arc::clone(self.services.entry(path.into()).or_default())
    }

    /// Returns true if a module gets a thread of its own.
    /// On the wall clock nothing waits for an isolated module. A module that may take the loop runs on the loop, where
    /// it is watched.
    pub fn has_own_thread(&self, surveyed: &Surveyed<'_>) -> bool {
        let threaded = self.mode == Mode::Threaded && surveyed.trigger != Trigger::Stage;
        let isolated = surveyed.is_isolated && !self.lockstep;
        (threaded || isolated) && !needs(&surveyed.description, MainLoop::DESCRIPTOR.hash)
    }

    /// Returns all paths of the board.
    pub fn paths(&self) -> SortedSet<String> {
        let aliases = self.board.aliases().into_iter().map(|(path, _)| path);
        self.board.properties().iter().map(|property| property.path().to_owned()).chain(aliases).collect()
    }

    /// Marks the present paths and actuators.
    pub fn mark(&self) -> ResourceMark {
        ResourceMark { paths: self.paths(), actuators: self.actuators.keys().cloned().collect() }
    }

    /// Reverts a failed change to its mark, and unloads the arriving modules.
    pub fn undo<'n>(&mut self, mark: &ResourceMark, arriving: impl IntoIterator<Item = &'n str>) {
        for path in self.paths().difference(&mark.paths) {
            // It was just found, and nothing else removes it.
            let _ = self.board.remove(path);
        }
        self.actuators.retain(|name, _| mark.has_actuator(name));
        for name in arriving {
            self.signals(name).health.set(ModuleCondition::UNLOADED);
        }
    }

    /// Returns the values that users and tools have set in some modules.
    /// These are parameters, `enabled` and inputs without a link.
    pub fn settings(&self, modules: &[String]) -> SortedMap<String, KeptSetting> {
        let of = |path: &str| {
            let within =
                |module: &String| path.strip_prefix(module).is_some_and(|rest| rest.starts_with('/'));
            modules.iter().any(within)
        };
        let properties = self.board.properties();
        let settings =
            properties.iter().filter(|property| property.access() == Access::Setting && of(property.path()));
        let kept = settings.filter_map(|property| {
            let (bytes, _, stamp) = property.newest().ok().flatten()?;
            let schema = property.descriptor().hash;
            Some((property.path().to_owned(), KeptSetting { schema, bytes, time: stamp.time }))
        });
        kept.collect()
    }
}

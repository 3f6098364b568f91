//! Robot as a program: its blocks, attachments and gates.
//! They are also a configuration.

mod attach;
mod check;
mod content;
mod error;
mod gate;
mod toml;

use std::any::TypeId;
use std::marker::PhantomData;
use std::panic::Location;

pub use attach::{Notices, Observes, Senses};
pub use error::{RobotError, RobotErrors, RobotProblem};
pub use gate::Gate;
use slate_module::blackboard::interface::{Interface, Value, View};
use slate_module::{Module, ModuleKind, Params, Plugin, Stage};

use crate::{
    Actuator, ActuatorBlock, Analyze, AnalyzeBlock, ExecuteBlock, Knowledge, KnowledgeBlock, Monitor,
    MonitorBlock, Plan, PlanBlock, ReactiveBlock, ReactiveModel, Repertoire, Sensor, SensorBlock,
};
use content::{AttachedLink, GateEntry, ModuleSettings, RobotContent, RobotModule, RobotProgram, Source};

/// Builder of a robot.
/// It has the robot's blocks, their attachments, and the gates of its actuators.
///
/// Types and roles wire what has one possibility, as in a configuration, so only other attachments must be written. Those
/// that the architecture does not permit do not compile. Settings such as [`params`](Robot::params) and
/// [`attach`](Robot::attach) belong to the block `B` that was added last.
///
/// The robot is also a configuration: [`to_toml`](Robot::to_toml) prints it. The facade `slate` runs it.
#[derive(Debug)]
pub struct Robot<B = ()> {
    content: RobotProgram,
    block: PhantomData<fn() -> B>,
}

impl Robot {
    /// Creates a robot without blocks.
    #[track_caller]
    pub fn new(name: &str) -> Self {
        let robot = RobotContent::new(name, Location::caller());
        Self::of(RobotProgram { robots: vec![robot], ..RobotProgram::default() })
    }
}

impl<B> Robot<B> {
    fn of(content: RobotProgram) -> Self {
        Self { content, block: PhantomData }
    }

    /// Returns the robot whose blocks are added.
    fn own(&mut self) -> &mut RobotContent {
        // The first one of several; `new` makes it.
        &mut self.content.robots[0]
    }

    #[track_caller]
    fn add<N: Module>(mut self, name: &str, part: Option<&'static str>) -> Robot<N> {
        self.own().modules.push(RobotModule {
            name: name.into(),
            part,
            kind: ModuleKind::linked::<N>(),
            code: TypeId::of::<N>(),
            settings: ModuleSettings::default(),
            place: Location::caller(),
        });
        Robot::of(self.content)
    }

    /// Adds a sensor.
    #[track_caller]
    pub fn sensor<S: Sensor>(self, name: &str) -> Robot<SensorBlock<S>> {
        self.add(name, None)
    }

    /// Adds an actuator.
    #[track_caller]
    pub fn actuator<A: Actuator>(self, name: &str) -> Robot<ActuatorBlock<A>> {
        self.add(name, None)
    }

    /// Adds a Monitor.
    #[track_caller]
    pub fn monitor<M: Monitor>(self, name: &str) -> Robot<MonitorBlock<M>> {
        self.add(name, None)
    }

    /// Adds an Analyze.
    #[track_caller]
    pub fn analyze<A: Analyze>(self, name: &str) -> Robot<AnalyzeBlock<A>> {
        self.add(name, None)
    }

    /// Adds the Plan; a second one is an error of the robot.
    #[track_caller]
    pub fn plan<P: Plan>(self, name: &str) -> Robot<PlanBlock<P>> {
        self.add(name, Some("Plan"))
    }

    /// Adds the Execute; a second one is an error of the robot.
    #[track_caller]
    pub fn execute<R: Repertoire>(self, name: &str) -> Robot<ExecuteBlock<R>> {
        self.add(name, Some("Execute"))
    }

    /// Adds the Knowledge; a second one is an error of the robot.
    #[track_caller]
    pub fn knowledge<K: Knowledge>(self, name: &str) -> Robot<KnowledgeBlock<K>> {
        self.add(name, Some("Knowledge"))
    }

    /// Adds a ReactiveModel.
    #[track_caller]
    pub fn reactive<R: ReactiveModel>(self, name: &str) -> Robot<ReactiveBlock<R>> {
        self.add(name, None)
    }

    /// Adds a module that is not a block of MAPE-K.
    #[track_caller]
    pub fn module<M: Module>(self, name: &str) -> Robot<M> {
        self.add(name, None)
    }

    /// Adds another robot of the same agent, with its world and plugins.
    pub fn with<C>(mut self, other: Robot<C>) -> Robot {
        self.content.robots.extend(other.content.robots);
        self.content.world.push_str(&other.content.world);
        self.content.plugins.extend(other.content.plugins);
        Robot::of(self.content)
    }

    /// Adds the surroundings of the robots: configuration in TOML.
    /// It has world, simulator, referee, report, loop and mission.
    ///
    /// It goes in front of the robots in [`to_toml`](Robot::to_toml). Relative paths in it start at the working directory.
    pub fn world(mut self, toml: &str) -> Robot {
        self.content.world.push_str(toml);
        if !toml.ends_with('\n') {
            self.content.world.push('\n');
        }
        Robot::of(self.content)
    }

    /// Adds the [world](Robot::world) of a configuration.
    /// It is all in front of its first robot but `include`, because the program adds the robots.
    pub fn world_of(self, configuration: &str) -> Robot {
        // A table of a robot begins a line, and so does `include`.
        let end = configuration.find("\n[robots.").map_or(configuration.len(), |end| end + 1);
        let mut is_included = false;
        let world = configuration[..end].split_inclusive('\n').filter(|line| {
            let files =
                line.strip_prefix("include").map(str::trim_start).filter(|rest| rest.starts_with('='));
            let is_kept = files.is_none() && !is_included;
            is_included =
                (is_included || files.is_some_and(|files| files.contains('['))) && !line.contains(']');
            is_kept
        });
        self.world(&world.collect::<String>())
    }

    /// Adds the kinds of modules that the world names.
    /// They come besides those of the robot's blocks and of the simulator.
    pub fn plugin(mut self, plugin: Plugin) -> Robot {
        self.content.plugins.push(plugin);
        Robot::of(self.content)
    }

    /// Returns the robot without a last block, such as for the result of a function.
    pub fn finish(self) -> Robot {
        Robot::of(self.content)
    }

    /// Returns the name of the robot; of several, that of the first.
    pub fn name(&self) -> &str {
        &self.content.robots[0].name
    }

    /// Checks the robot by itself: names, attachments, parameters and gates.
    ///
    /// # Errors
    /// Everything that is wrong, with the lines of the program.
    pub fn check(&self) -> Result<(), RobotErrors> {
        check::check(&self.content)
    }

    /// Returns the configuration of the robot in readable TOML.
    ///
    /// It leaves out attachments whose port has a role and one possible source, and parameters with their default.
    ///
    /// # Errors
    /// Everything that is wrong with the robot, with the lines of the program.
    pub fn to_toml(&self) -> Result<String, RobotErrors> {
        self.check()?;
        Ok(toml::print(&self.content, false))
    }

    /// Returns the same configuration with the line of the program for each entry.
    /// The lines are for messages about it.
    ///
    /// # Errors
    /// As for [`to_toml`](Robot::to_toml).
    pub fn to_toml_with_places(&self) -> Result<String, RobotErrors> {
        self.check()?;
        Ok(toml::print(&self.content, true))
    }

    /// Returns the plugins that bring the robot's kinds of modules.
    /// They are those that were added, and one with the kinds that neither they nor `others` bring.
    pub fn plugins(&self, others: &[Plugin]) -> Vec<Plugin> {
        self.content.plugins(self.name(), others)
    }
}

/// Settings of the block that was added last.
impl<B: Module> Robot<B> {
    fn last(&mut self) -> &mut RobotModule {
        // `add` is the only way to a robot with a block, and nothing removes one.
        let modules = &mut self.own().modules;
        let last = modules.len() - 1;
        &mut modules[last]
    }

    fn settings(mut self, set: impl FnOnce(&mut ModuleSettings)) -> Self {
        set(&mut self.last().settings);
        self
    }

    /// Sets parameters of the block.
    /// `.params(|params| params.max_linear_velocity = 0.3)`.
    pub fn params(self, set: impl FnOnce(&mut B::Params)) -> Self {
        let mut params = B::Params::default();
        set(&mut params);
        self.settings(|settings| {
            settings.parameters = B::Params::parameters();
            settings.params = View::of(&mut params).value();
        })
    }

    /// Starts the block disabled.
    pub fn disabled(self) -> Self {
        self.settings(|settings| settings.others.push(("enabled", Value::Bool(false))))
    }

    /// Runs the block in a process of its own.
    pub fn isolated(self) -> Self {
        self.settings(|settings| settings.others.push(("isolated", Value::Bool(true))))
    }

    /// Runs the block in another stage of the main loop.
    pub fn stage(self, stage: Stage) -> Self {
        self.settings(|settings| settings.others.push(("stage", Value::Text(stage.name().into()))))
    }

    /// Runs the block with a period, such as `"10ms"`.
    pub fn every(self, period: &str) -> Self {
        self.settings(|settings| settings.others.push(("every", Value::Text(period.into()))))
    }

    /// Sets the longest duration of a tick, such as `"5ms"`.
    pub fn deadline(self, duration: &str) -> Self {
        self.settings(|settings| settings.others.push(("deadline", Value::Text(duration.into()))))
    }

    /// Stores the state of the block in a file, from run to run.
    pub fn memory(self, file: &str) -> Self {
        self.settings(|settings| settings.others.push(("memory", Value::Text(file.into()))))
    }

    /// Sets the value of an input without a link, such as a goal.
    pub fn input<T: Interface + Copy>(self, port: &str, value: T) -> Self {
        let mut value = value;
        let value = (port.to_owned(), T::DESCRIPTOR, View::of(&mut value).value());
        self.settings(|settings| settings.inputs.push(value))
    }

    /// Links a port of the block to a property.
    /// Examples are `knowledge/goal` of this robot or `/simulator/r2/sonar`.
    #[track_caller]
    pub fn link(mut self, port: &str, source: &str) -> Self {
        let link = AttachedLink::new(&self.last().name, port, Source::Url(source.into()), Location::caller());
        self.own().links.push(link);
        self
    }

    /// Links as [`link`](Robot::link), to the value of the previous cycle.
    /// It is for a block that its source reads.
    #[track_caller]
    pub fn link_previous(mut self, port: &str, source: &str) -> Self {
        let mut link =
            AttachedLink::new(&self.last().name, port, Source::Url(source.into()), Location::caller());
        link.is_previous = true;
        self.own().links.push(link);
        self
    }

    /// Leaves a port of the block without a link.
    /// Types and roles would otherwise determine one.
    #[track_caller]
    pub fn unlinked(mut self, port: &str) -> Self {
        let link = AttachedLink::new(&self.last().name, port, Source::None, Location::caller());
        self.own().links.push(link);
        self
    }

    /// Adds a gate in front of an actuator, which takes the commands of this block.
    #[track_caller]
    pub fn gate(mut self, name: &str, gate: Gate) -> Self {
        let commander = self.last().name.clone();
        let place = Location::caller();
        self.own().gates.push(GateEntry { name: name.into(), gate, commander, place });
        self
    }
}

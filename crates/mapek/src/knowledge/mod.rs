//! Knowledge of a robot.

mod facts;
mod plans;
mod robot;
mod statements;
mod strategy;
mod strategy_ports;
mod table;
mod world;

use std::marker::PhantomData;

pub use facts::{Fact, Facts, Live, Merge, MostCertain, Newest, Union, Version};
pub use plans::{PlanDescription, PlanLibrary, PlanOutcome, Role};
pub use robot::{ActuatorStatus, Device, DeviceHealth, Kinematics, RobotModel, Steering};
use slate_module::{Hardware, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger};
pub use statements::Statements;
pub use strategy::{StoredPlan, StrategyModel, StrategyRecord, StrategyReport};
pub use strategy_ports::StrategyPorts;
pub use table::{FactTable, Stated};
pub use world::WorldModel;

use crate::block::{BlockState, distinct};

/// Knowledge of the world, the robot and its strategies (RoCS, 4.2).
/// It consists of properties for all blocks. A robot has one.
///
/// Blocks write to it by links: each input is an origin of facts with a single writer, and each output is a view of
/// them. Its parts are [`WorldModel`], [`RobotModel`] and [`StrategyModel`].
pub trait Knowledge: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports: inputs to learn from, outputs with knowledge.
    type Models: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;
    /// True if its RobotModel describes a robot that the parameters name.
    const DESCRIBES_HARDWARE: bool = false;

    /// Returns the hardware of that robot.
    /// It must have everything that its Monitors and Execute need, and be that of its devices.
    ///
    /// # Errors
    /// A refusal when there is no such robot: `params.NAME: ` and what was expected.
    fn hardware(_: &Setup<'_>, _: &Self::Params) -> Result<Vec<Hardware>, Refusal> {
        Ok(Vec::new())
    }

    /// Returns the first state.
    ///
    /// # Errors
    /// A refusal when the parameters do not fit, with what was expected.
    fn create(_: &Setup<'_>, _: &Self::Params) -> Result<Self::State, Refusal> {
        Ok(Self::State::default())
    }

    /// Updates from new inputs, and writes changes.
    fn update(state: &mut Self::State, models: &Self::Models, params: &Self::Params, now: &Tick);
}

/// Module of a [`Knowledge`], run in every cycle after the sensors' interpretation.
pub struct KnowledgeBlock<K>(PhantomData<fn() -> K>);

impl<K: Knowledge> Module for KnowledgeBlock<K> {
    type Io = K::Models;
    type Params = K::Params;
    type State = K::State;

    const NAME: &'static str = K::NAME;
    const DOC: &'static str = K::DOC;
    const STAGE: Stage = Stage::WorldState;
    const DESCRIBES_HARDWARE: bool = K::DESCRIBES_HARDWARE;

    fn hardware(setup: &Setup<'_>, params: &K::Params) -> Result<Vec<Hardware>, Refusal> {
        K::hardware(setup, params)
    }

    fn spec() -> Spec {
        Spec { trigger: Trigger::Stage, deadline: None, unique: "knowledge" }
    }

    fn create(setup: &Setup<'_>, params: &K::Params) -> Result<K::State, Refusal> {
        distinct(&Self::Io::describe())?;
        K::create(setup, params)
    }

    fn tick(state: &mut K::State, models: &K::Models, params: &K::Params, now: &Tick) -> Outcome {
        K::update(state, models, params, now);
        Outcome::Ok
    }
}

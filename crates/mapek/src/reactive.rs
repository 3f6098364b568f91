use std::marker::PhantomData;

use slate_module::{Input, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::ReflexOut;
use crate::{ActionRequest, Rank, Reflex};

/// A reflex: a known mapping from what sensors say to an action (RoCS, 5.1). It is woken by its sensors and goes
/// straight to Execute; the deliberative route is not involved.
pub trait ReactiveModel: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// Its place among the robot's models, unless the block's input `rank` is set: a higher one inhibits and preempts
    /// a lower one.
    const RANK: i32 = 0;
    /// The sensors and the knowledge it reacts to.
    type Sensors: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers.
    type State: BlockState;

    /// Reacts: an action that is returned comes before all that is planned. While it waits or runs, the same kind of
    /// action renews it.
    fn run(
        state: &mut Self::State,
        sensors: &Self::Sensors,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<ActionRequest>;
}

/// What the framework adds to a ReactiveModel's ports.
#[ports]
pub struct ReactivePorts {
    /// Replaces the model's own rank when it is set.
    rank: Input<Rank>,
    /// The actions for Execute.
    reflex: ReflexOut,
}

/// A [`ReactiveModel`] as a module.
pub struct ReactiveBlock<R>(PhantomData<fn() -> R>);

impl<R: ReactiveModel> Module for ReactiveBlock<R> {
    type Io = (R::Sensors, ReactivePorts);
    type Params = R::Params;
    type State = R::State;

    const NAME: &'static str = R::NAME;
    const DOC: &'static str = R::DOC;
    const STAGE: Stage = Stage::SensorProcess;

    fn spec() -> Spec {
        Spec { trigger: on(&R::Sensors::describe(), |_| true), deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &R::Params) -> Result<R::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(R::State::default())
    }

    fn tick(state: &mut R::State, (sensors, own): &Self::Io, params: &R::Params, now: &Tick) -> Outcome {
        let Some(action) = R::run(state, sensors, params, now) else { return Outcome::Ok };
        let rank = if own.rank.stamp().sequence > 0 { own.rank.rank } else { R::RANK };
        if own.reflex.0.send(Reflex { action, rank, reserved: 0 }) {
            Outcome::Ok
        } else {
            now.error(format_args!("no room for the reflex {}", action.kind.as_str()));
            Outcome::Failed
        }
    }
}

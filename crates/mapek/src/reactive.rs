use std::marker::PhantomData;

use slate_module::{Input, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::ReflexOut;
use crate::{ActionRequest, Rank, Reflex};

/// Reflex: a known mapping from sensors to an action (RoCS, 5.1).
/// Its sensors trigger it; its actions go straight to Execute, without the deliberative route.
pub trait ReactiveModel: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Rank among the robot's models, unless the input `rank` is set.
    /// A higher one inhibits and preempts a lower one.
    const RANK: i32 = 0;
    /// Ports of sensors and knowledge.
    type Sensors: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;

    /// Reacts: a returned action precedes all planned ones.
    /// While it is queued or runs, the same kind of action renews it.
    fn run(
        state: &mut Self::State,
        sensors: &Self::Sensors,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<ActionRequest>;
}

/// Additional ports of a ReactiveModel.
#[ports]
pub struct ReactivePorts {
    /// Replaces the model's own rank when it is set.
    rank: Input<Rank>,
    /// Actions for Execute.
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
        Spec { trigger: on(&R::Sensors::describe(), &|_| true), deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &R::Params) -> Result<R::State, Refusal> {
        distinct(&Self::Io::describe())?;
        Ok(R::State::default())
    }

    fn tick(state: &mut R::State, (sensors, own): &Self::Io, params: &R::Params, now: &Tick) -> Outcome {
        let Some(action) = R::run(state, sensors, params, now) else { return Outcome::Ok };
        let rank = own.rank.get().map_or(R::RANK, |rank| rank.rank);
        if own.reflex.0.send(Reflex { action, rank }) {
            Outcome::Ok
        } else {
            now.error(format_args!("no room for the reflex {}", action.kind.as_str()));
            Outcome::Failed
        }
    }
}

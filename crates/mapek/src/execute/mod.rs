mod execution;

use std::marker::PhantomData;

pub use execution::Execution;
use slate_module::{Module, Outcome, Output, Refusal, Setup, Spec, Stage, Tick, Trigger, ports};

use crate::block::{RENEWAL, distinct};
use crate::port::{PlanIn, ReflexIn};
use crate::{ExecuteStatus, Repertoire};

/// What Execute adds to a body's ports.
#[ports]
pub struct ExecutePorts {
    /// Actions of the Plan.
    #[window(64)]
    plan: PlanIn,
    /// Actions of ReactiveModels.
    #[window(64)]
    reflexes: ReflexIn,
    /// What Execute is doing, written when it changes.
    status: Output<ExecuteStatus>,
}

/// Performs the actions of Plan and ReactiveModels, one after the other (RoCS, 5.1). A robot has one.
///
/// Each cycle it steps the action that the [`Pipeline`](crate::Pipeline) chose, which renews the action's commands;
/// when an action is done, the next begins in the same cycle. When a planned action fails, the rest of the plan is
/// cancelled and the Plan is told to plan anew. With nothing to do it sends no command, and the gate makes the
/// actuators safe.
pub struct ExecuteBlock<R>(PhantomData<fn() -> R>);

impl<R: Repertoire> Module for ExecuteBlock<R> {
    type Io = (R::Body, ExecutePorts);
    type Params = ();
    type State = Execution<R>;

    const NAME: &'static str = R::NAME;
    const DOC: &'static str = "Performs the actions of Plan and ReactiveModels.";
    const STAGE: Stage = Stage::Act;

    fn spec() -> Spec {
        let trigger = Trigger::On { ports: vec!["plan".into(), "reflexes".into()], timeout: Some(RENEWAL) };
        Spec { trigger, deadline: None, unique: "execute" }
    }

    fn create(_: &Setup<'_>, (): &()) -> Result<Self::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(Execution::default())
    }

    fn tick(state: &mut Self::State, (body, own): &Self::Io, (): &(), now: &Tick) -> Outcome {
        let before = state.summary();
        // Reflexes first, so that a plan made without knowledge of them is dropped.
        state.take_reflexes(&own.reflexes.0, now);
        state.take_plan(&own.plan.0, now);
        state.cancel_interrupted(body, now);
        state.perform(body, now);
        if state.must_publish(&before) {
            own.status.set(state.status());
        }
        Outcome::Ok
    }
}

mod execution;

use std::marker::PhantomData;

pub use execution::Execution;
use slate_module::{Module, Outcome, Output, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger, ports};

use crate::block::{RENEWAL, distinct};
use crate::port::{PlanIn, ReflexIn};
use crate::{ExecuteStatus, Repertoire, WaitingActions};

/// Additional ports of Execute.
#[ports]
pub struct ExecutePorts {
    /// Actions of the Plan.
    #[window(64)]
    plan: PlanIn,
    /// Actions of ReactiveModels.
    #[window(64)]
    reflexes: ReflexIn,
    /// Status of Execute, written when it changes.
    status: Output<ExecuteStatus>,
    /// Waiting actions, written at the start and when they change.
    #[capacity(128)]
    waiting: Output<WaitingActions>,
}

/// Execution of the actions of Plan and ReactiveModels in sequence (RoCS, 5.1).
/// A robot has one.
///
/// Each cycle steps the action that the [`Pipeline`](crate::Pipeline) has chosen, which renews its commands; when an action is done, the next
/// begins in the same cycle. A failed planned action cancels the rest of the plan, and the Plan replans. Without an action no command is
/// sent, and the gate applies the safe commands.
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
        distinct(&Self::Io::describe())?;
        Ok(Execution::default())
    }

    fn tick(state: &mut Self::State, (body, own): &Self::Io, (): &(), now: &Tick) -> Outcome {
        let before = state.summary();
        let is_first = !state.is_published();
        let (revision, was_waiting) = (state.revision(), state.has_waiting());
        state.set_time(now.now());
        // Reflexes first, so that a plan made without knowledge of them is dropped.
        state.take_reflexes(&own.reflexes.0, now);
        state.take_plan(&own.plan.0, now);
        state.cancel_interrupted(body, now);
        state.perform(body, now);
        if state.must_publish(&before) {
            own.status.set(state.status());
        }
        // An action that begins at once has not waited.
        if is_first || state.revision() != revision && (was_waiting || state.has_waiting()) {
            state.write_waiting(&own.waiting);
        }
        Outcome::Ok
    }
}

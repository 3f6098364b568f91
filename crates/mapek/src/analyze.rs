use std::marker::PhantomData;

use slate_module::role;
use slate_module::{Direction, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick};

use crate::Published;
use crate::block::{BlockState, distinct, on};
use crate::published::has_place;

/// Interpretation of percepts (RoCS, 4.2).
/// An Analyze filters, processes and aggregates percepts, and notifies the Plan of relevant changes.
///
/// The observed Monitors trigger it.
pub trait Analyze: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports: one [`Observed`](crate::Observed) for each Monitor, and plain inputs.
    /// The plain inputs are for knowledge.
    type Observed: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;
    /// Published value: a small one, or [`InPlace`](crate::InPlace) for any size.
    type Value: Published;

    /// Processes percepts; returns a relevant change, which is published.
    fn process(
        state: &mut Self::State,
        observed: &Self::Observed,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;

    /// Returns true if the observed values are invalid: the Analyze is degraded.
    fn is_degraded(_: &Self::State) -> bool {
        false
    }
}

/// An [`Analyze`] as a module.
pub struct AnalyzeBlock<A>(PhantomData<fn() -> A>);

impl<A: Analyze> Module for AnalyzeBlock<A> {
    type Io = (A::Observed, <A::Value as Published>::Change);
    type Params = A::Params;
    type State = A::State;

    const NAME: &'static str = A::NAME;
    const DOC: &'static str = A::DOC;
    const STAGE: Stage = Stage::WorldState;

    fn spec() -> Spec {
        let trigger = on(&A::Observed::describe(), &|port| {
            port.role == role::PERCEPT || port.direction == Direction::Inbox
        });
        Spec { trigger, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &A::Params) -> Result<A::State, Refusal> {
        distinct(&Self::Io::describe())?;
        has_place::<A::Value, A::Observed>(role::CHANGE)?;
        Ok(A::State::default())
    }

    fn tick(state: &mut A::State, (observed, own): &Self::Io, params: &A::Params, now: &Tick) -> Outcome {
        let outcome = match A::process(state, observed, params, now) {
            Some(value) => value.notify(own, now),
            None => Outcome::Ok,
        };
        match outcome {
            Outcome::Ok if A::is_degraded(state) => Outcome::Degraded,
            outcome => outcome,
        }
    }
}

use std::marker::PhantomData;

use slate_module::{Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::{Change, role};

/// Filters, processes and aggregates percepts, and notifies the Plan of relevant changes (RoCS, 4.2).
///
/// The observed Monitors trigger it.
pub trait Analyze: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports: [`Observed`](crate::Observed) for each Monitor, and plain inputs for knowledge.
    type Observed: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;
    /// Published value.
    type Value: Interface + Copy;

    /// Processes percepts; returns a relevant change, which is published.
    fn process(
        state: &mut Self::State,
        observed: &Self::Observed,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// Additional ports of an Analyze.
#[ports]
pub struct AnalyzePorts<T: Interface> {
    /// Relevant change.
    change: Change<T>,
}

/// An [`Analyze`] as a module.
pub struct AnalyzeBlock<A>(PhantomData<fn() -> A>);

impl<A: Analyze> Module for AnalyzeBlock<A> {
    type Io = (A::Observed, AnalyzePorts<A::Value>);
    type Params = A::Params;
    type State = A::State;

    const NAME: &'static str = A::NAME;
    const DOC: &'static str = A::DOC;
    const STAGE: Stage = Stage::WorldState;

    fn spec() -> Spec {
        let trigger = on(&A::Observed::describe(), |port| port.role == role::PERCEPT);
        Spec { trigger, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &A::Params) -> Result<A::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(A::State::default())
    }

    fn tick(state: &mut A::State, (observed, own): &Self::Io, params: &A::Params, now: &Tick) -> Outcome {
        if let Some(value) = A::process(state, observed, params, now) {
            own.change.0.set(value);
        }
        Outcome::Ok
    }
}

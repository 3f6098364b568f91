use std::marker::PhantomData;

use slate_module::{Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::{Change, role};

/// Filters, processes and aggregates what Monitors tell, and notifies the Plan when something relevant changed
/// (RoCS, 4.2). It is woken by the Monitors that it observes.
pub trait Analyze: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// What it observes: an [`Observed`](crate::Observed) port for each Monitor, and plain inputs for knowledge.
    type Observed: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers.
    type State: BlockState;
    /// What it publishes.
    type Value: Interface + Copy;

    /// Processes what was observed; a change that is relevant is returned and published, else nothing is.
    fn process(
        state: &mut Self::State,
        observed: &Self::Observed,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// What the framework adds to an Analyze's ports.
#[ports]
pub struct AnalyzePorts<T: Interface> {
    /// What changed.
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

//! Allocation counter for a module's ticks.
//! A program that uses this crate has the allocator of `allocation-counter`.

use std::cell::Cell;
use std::marker::PhantomData;

use slate_module::{Module, Outcome, Refusal, Setup, Spec, Stage, Tick};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Returns the number of allocations in this thread's ticks.
/// They are those of [`Counted`] modules.
#[must_use]
pub fn allocations() -> u64 {
    ALLOCATIONS.get()
}

/// Module whose ticks are counted, without the fixture's own work around them.
pub struct Counted<M>(PhantomData<fn() -> M>);

impl<M: Module> Module for Counted<M> {
    type Io = M::Io;
    type Params = M::Params;
    type State = M::State;

    const NAME: &'static str = M::NAME;
    const STAGE: Stage = M::STAGE;

    fn spec() -> Spec {
        M::spec()
    }

    fn create(setup: &Setup<'_>, params: &M::Params) -> Result<M::State, Refusal> {
        M::create(setup, params)
    }

    fn tick(state: &mut M::State, io: &M::Io, params: &M::Params, now: &Tick) -> Outcome {
        let mut outcome = Outcome::Ok;
        let made = allocation_counter::measure(|| outcome = M::tick(state, io, params, now));
        ALLOCATIONS.set(ALLOCATIONS.get() + made.count_total);
        outcome
    }
}

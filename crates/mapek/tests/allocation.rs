//! A tick of a block allocates nothing, once it has begun.
#![allow(unsafe_code, reason = "an allocator that counts")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::marker::PhantomData;

use slate_mapek::{
    ActionKind, AnalyzeBlock, ExecuteBlock, ExecuteStatus, MonitorBlock, PlanBlock, ReactiveBlock,
};
use slate_module::testing::Fixture;
use slate_module::{Module, Outcome, Refusal, Setup, Spec, Tick};

use common::{
    Actions, AvoidNear, Free, Near, NearMonitor, Swerve, Tour, Wanderer, WayIsFree, planned, reflex,
};

struct Counting;

thread_local! {
    static ACTIVE: Cell<bool> = const { Cell::new(false) };
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if ACTIVE.get() {
            COUNT.set(COUNT.get() + 1);
        }
        // SAFETY: passed on to the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on to the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A module whose ticks are watched, without what the fixture itself does around them.
struct Watched<M>(PhantomData<fn() -> M>);

impl<M: Module> Module for Watched<M> {
    type Io = M::Io;
    type Params = M::Params;
    type State = M::State;

    const NAME: &'static str = M::NAME;
    const STAGE: slate_module::Stage = M::STAGE;

    fn spec() -> Spec {
        M::spec()
    }

    fn create(setup: &Setup<'_>, params: &M::Params) -> Result<M::State, Refusal> {
        M::create(setup, params)
    }

    fn tick(state: &mut M::State, io: &M::Io, params: &M::Params, now: &Tick) -> Outcome {
        ACTIVE.set(true);
        let outcome = M::tick(state, io, params, now);
        ACTIVE.set(false);
        outcome
    }
}

#[test]
fn an_allocation_in_a_tick_would_be_seen() {
    // This Plan keeps a list of all endings.
    let mut plan = Fixture::<Watched<PlanBlock<Wanderer>>>::new();
    let ended = [slate_mapek::Ended { number: 1, ..Default::default() }];
    plan.set(
        "situation",
        ExecuteStatus { ended: slate_module::Sequence::new(&ended), ..ExecuteStatus::default() },
    );
    plan.tick();
    assert!(COUNT.get() > 0);
}

#[test]
fn a_tick_allocates_nothing() {
    let mut monitor = Fixture::<Watched<MonitorBlock<NearMonitor>>>::new();
    let mut analyze = Fixture::<Watched<AnalyzeBlock<WayIsFree>>>::new();
    let mut plan = Fixture::<Watched<PlanBlock<Wanderer>>>::new();
    let mut model = Fixture::<Watched<ReactiveBlock<AvoidNear>>>::new();
    let mut execute = Fixture::<Watched<ExecuteBlock<Actions>>>::new();
    for (cycle, ticket) in (0..300_u32).zip(1..) {
        let range = Near { distance: f64::from(cycle % 7) * 0.1 };
        monitor.set("range", range);
        monitor.tick();
        model.set("range", range);
        model.tick();
        analyze.set("near", Near { distance: f64::from(cycle % 5) });
        analyze.tick();
        plan.push("free", Free { free: (cycle % 2 == 0).into() });
        plan.tick();
        let epoch = execute.output::<ExecuteStatus>("status").map_or(0, |status| status.epoch);
        execute.push("plan", planned(Tour::request(()), ticket, epoch));
        for _ in 0..cycle % 3 {
            execute.push("plan", planned(Swerve::request((1.0, 0.0)), ticket, epoch));
        }
        if cycle % 11 == 0 {
            execute.push("reflexes", reflex(Swerve::request((0.1, 3.0)), (cycle % 3).cast_signed()));
        }
        execute.advance(20_000_000);
        execute.tick();
        if cycle % 50 == 0 {
            let saved = execute.save().unwrap();
            execute.restore(&saved).unwrap();
        }
    }
    assert_eq!(COUNT.get(), 0);
}

//! A tick of a block allocates nothing, once it has begun.

mod common;

use slate_mapek::{
    ActionKind, AnalyzeBlock, ExecuteBlock, ExecuteStatus, MonitorBlock, PlanBlock, ReactiveBlock,
};
use slate_module::testing::Fixture;
use slate_testing::{Counted, allocations};

use common::{
    Actions, AvoidNear, Free, Near, NearMonitor, Swerve, Tour, Wanderer, WayIsFree, planned, reflex,
};

#[test]
fn an_allocation_in_a_tick_would_be_seen() {
    // This Plan keeps a list of all endings.
    let mut plan = Fixture::<Counted<PlanBlock<Wanderer>>>::new();
    let ended = [slate_mapek::Ended { number: 1, ..Default::default() }];
    plan.set(
        "situation",
        ExecuteStatus { ended: slate_module::Sequence::new(&ended), ..ExecuteStatus::default() },
    );
    plan.tick();
    assert!(allocations() > 0);
}

#[test]
fn a_tick_allocates_nothing() {
    let mut monitor = Fixture::<Counted<MonitorBlock<NearMonitor>>>::new();
    let mut analyze = Fixture::<Counted<AnalyzeBlock<WayIsFree>>>::new();
    let mut plan = Fixture::<Counted<PlanBlock<Wanderer>>>::new();
    let mut model = Fixture::<Counted<ReactiveBlock<AvoidNear>>>::new();
    let mut execute = Fixture::<Counted<ExecuteBlock<Actions>>>::new();
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
    assert_eq!(allocations(), 0);
}

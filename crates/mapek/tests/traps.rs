//! The defects of RoCS, each by its name.

use crate::common;

use slate_interfaces::Twist2;
use slate_mapek::{
    ActionKind, AnalyzeBlock, ExecuteBlock, ExecuteStatus, MonitorBlock, PlanBlock, Planned, ReactiveBlock,
    Reflex,
};
use slate_module::testing::Fixture;
use slate_module::{Module, Priority, Trigger};

use common::{
    Actions, AvoidNear, Drive, Free, Near, NearMonitor, Swerve, Wanderer, WayIsFree, planned, reflex,
};

/// One cycle; the speed that was commanded.
fn step(execute: &mut Fixture<ExecuteBlock<Actions>>) -> Option<f64> {
    execute.advance(20_000_000);
    execute.tick();
    execute.output::<Twist2>("wheels").map(|twist| twist.linear)
}

#[test]
fn a_planned_action_deletes_a_waiting_reflex() {
    let mut execute = Fixture::<ExecuteBlock<Actions>>::new();
    // Of two models with the same rank, the second's reflex waits.
    execute.push("reflexes", reflex(Swerve::request((-1.0, 2.0)), 0));
    execute.push("reflexes", reflex(Drive::request((-2.0, 1.0)), 0));
    assert_eq!(step(&mut execute), Some(-1.0));
    let epoch = execute.output::<ExecuteStatus>("status").unwrap().epoch;
    execute.push("plan", planned(Drive::request((3.0, 1.0)), 1, epoch));
    assert_eq!(step(&mut execute), Some(-1.0));
    assert_eq!(step(&mut execute), Some(-2.0));
    assert_eq!(step(&mut execute), Some(3.0));
}

#[test]
fn equal_priority_actions_vanish() {
    let mut execute = Fixture::<ExecuteBlock<Actions>>::new();
    for number in 1..=20_u32 {
        execute.push("plan", planned(Drive::request((number.into(), 1.0)), number.into(), 0));
    }
    for number in 1..=20_u32 {
        assert_eq!(step(&mut execute), Some(number.into()));
    }
}

#[test]
fn polling_makes_the_reflex_as_slow_as_the_plan() {
    // No block on the reactive route waits for a period: each is woken by the one before it.
    let woken_by = |trigger: Trigger, port: &str| matches!(trigger, Trigger::On { ports, .. } if ports.iter().any(|name| name == port));
    assert!(woken_by(ReactiveBlock::<AvoidNear>::spec().trigger, "range"));
    assert!(woken_by(ExecuteBlock::<Actions>::spec().trigger, "reflexes"));
    // And the command goes out in the step that receives the reflex, at the same time, while a plan is running.
    let mut model = Fixture::<ReactiveBlock<AvoidNear>>::new();
    let mut execute = Fixture::<ExecuteBlock<Actions>>::new();
    execute.push("plan", planned(Drive::request((1.0, 1000.0)), 1, 0));
    assert_eq!(step(&mut execute), Some(1.0));
    model.set("range", Near { distance: 0.1 });
    model.tick();
    for reflex in model.sent::<Reflex>("reflex") {
        execute.push("reflexes", reflex);
    }
    execute.tick();
    assert_eq!(execute.output("wheels"), Some(Twist2 { linear: 0.1, angular: 0.0 }));
    assert_eq!(execute.priority("wheels"), Some(Priority::Reflex as u32));
}

#[test]
fn analyze_result_has_no_reader() {
    let mut monitor = Fixture::<MonitorBlock<NearMonitor>>::new();
    let mut analyze = Fixture::<AnalyzeBlock<WayIsFree>>::new();
    let mut plan = Fixture::<PlanBlock<Wanderer>>::new();
    let mut execute = Fixture::<ExecuteBlock<Actions>>::new();
    monitor.set("range", Near { distance: 4.0 });
    monitor.tick();
    analyze.set("near", monitor.output::<Near>("percept").unwrap());
    analyze.tick();
    plan.push("free", analyze.output::<Free>("change").unwrap());
    plan.tick();
    for message in plan.sent::<Planned>("plan") {
        execute.push("plan", message);
    }
    assert_eq!(step(&mut execute), Some(1.0));
}

#[test]
fn unsynchronized_reads() {
    // A tick sees one snapshot: the writer's next value is only there in the next tick. That no other thread can
    // look at a port (`Observed`), and that none outlives its tick (`tests/attach`), is shown by what does not compile.
    let mut analyze = Fixture::<AnalyzeBlock<WayIsFree>>::new();
    analyze.set("near", Near { distance: 2.0 });
    analyze.set("threshold", Near { distance: 10.0 });
    analyze.tick();
    assert_eq!(analyze.output::<Free>("change").map(|change| change.free.get()), Some(false));
    analyze.set("threshold", Near { distance: 0.0 });
    assert_eq!(analyze.output::<Free>("change").map(|change| change.free.get()), Some(false));
    analyze.tick();
    assert_eq!(analyze.output::<Free>("change").map(|change| change.free.get()), Some(true));
}

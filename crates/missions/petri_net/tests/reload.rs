//! States of runs: saved, restored, and carried into a changed plan.

use std::sync::Arc;

use slate_petri_net::{ActionProgress, ConflictOrder, ExecutorState, PetriNet, PetriNetExecutor, PetriPlan};

use crate::common::{Script, net};

fn patrol(second: &str, waiting: &str) -> PetriNet {
    let exec = format!("{second}.exec");
    let (start, end) = (format!("{second}.start"), format!("{second}.end"));
    net(
        "patrol",
        &[(waiting, 1), ("goto_1.exec", 0), (" ", 0), (&exec, 0), ("goal", 0)],
        &[("goto_1.start", &[0], &[1]), ("goto_1.end", &[1], &[2]), (&start, &[2], &[3]), (&end, &[3], &[4])],
    )
}

fn plan(net: PetriNet) -> Arc<PetriPlan> {
    Arc::new(PetriPlan::new(net, |_| Ok(None)).unwrap())
}

fn running() -> (PetriNetExecutor, Script) {
    let executor = PetriNetExecutor::new(plan(patrol("goto_2", "start")), ConflictOrder::Seed(3));
    (executor, Script::default())
}

#[test]
fn a_restored_run_goes_on_as_the_saved_one() {
    let (mut executor, mut host) = running();
    for _ in 0..2 {
        executor.step(&mut host).unwrap();
    }
    let text = serde_json::to_string(&executor.state()).unwrap();
    let state: ExecutorState = serde_json::from_str(&text).unwrap();
    let mut restored =
        PetriNetExecutor::restore(Arc::clone(executor.plan()), ConflictOrder::Seed(3), &state).unwrap();
    host.orders();
    host.end("goto_1", ActionProgress::Succeeded);
    let mut other = Script::default();
    other.end("goto_1", ActionProgress::Succeeded);
    for _ in 0..3 {
        assert_eq!(executor.step(&mut host), restored.step(&mut other));
        assert_eq!(executor.fired(), restored.fired());
        assert_eq!(executor.state(), restored.state());
    }
    assert_eq!(host.orders(), other.orders());
}

#[test]
fn an_empty_state_is_the_start() {
    let state = ExecutorState::default();
    let net = plan(patrol("goto_2", "start"));
    let executor = PetriNetExecutor::restore(net, ConflictOrder::File, &state).unwrap();
    assert_eq!(executor.marking(0), [1, 0, 0, 0, 0]);
}

#[test]
fn a_changed_plan_takes_over_where_names_fit() {
    let (mut executor, mut host) = running();
    executor.step(&mut host).unwrap();
    executor.reload(plan(patrol("turn_90", "begin"))).unwrap();
    assert_eq!(executor.marking(0), [0, 1, 0, 0, 0]);
    host.end("goto_1", ActionProgress::Succeeded);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start goto_1", "end goto_1", "start turn_90"]);
}

#[test]
fn a_plan_without_a_marked_place_is_refused_and_the_old_goes_on() {
    let (mut executor, mut host) = running();
    let error = executor.reload(plan(patrol("goto_2", "begin"))).unwrap_err().to_string();
    assert!(error.contains("`patrol` has 1 tokens in a place `start`, which is missing"), "{error}");
    executor.step(&mut host).unwrap();
    host.end("goto_1", ActionProgress::Succeeded);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    let error = executor.reload(plan(patrol("goto_3", "start"))).unwrap_err().to_string();
    assert!(error.contains("place `goto_2.exec`, which is missing"), "{error}");
    host.end("goto_2", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
}

#[test]
fn an_action_that_becomes_a_sub_plan_while_it_runs_is_refused() {
    let (mut executor, mut host) = running();
    executor.step(&mut host).unwrap();
    let sub_plan = || net("goto_1", &[("go.exec", 1), ("goal", 0)], &[("go.end", &[0], &[1])]);
    let changed = || {
        let plan = PetriPlan::new(patrol("goto_2", "start"), |name| Ok((name == "goto_1").then(sub_plan)));
        Arc::new(plan.unwrap())
    };
    let error = executor.reload(changed()).unwrap_err().to_string();
    assert!(error.contains("the action `goto_1` runs, and is a sub-plan now"), "{error}");
    let mut inside = PetriNetExecutor::new(changed(), ConflictOrder::File);
    inside.step(&mut host).unwrap();
    let error = inside.reload(plan(patrol("goto_2", "start"))).unwrap_err().to_string();
    assert!(error.contains("`goto_1` runs, and is not a sub-plan any more"), "{error}");
}

//! Steps of plans.

use std::sync::Arc;

use slate_petri_net::{ActionProgress, ConflictOrder, NetBuilder, PetriNet, PetriNetExecutor, PetriPlan};

use crate::common::{Script, net};

fn executor(net: PetriNet) -> PetriNetExecutor {
    let plan = PetriPlan::new(net, |_| Ok(None)).unwrap();
    PetriNetExecutor::new(Arc::new(plan), ConflictOrder::File)
}

fn sequence() -> PetriNet {
    net(
        "sequence",
        &[("start", 1), ("goto_1.exec", 0), ("P", 0), ("goto_2.exec", 0), ("goal", 0)],
        &[
            ("goto_1.start", &[0], &[1]),
            ("goto_1.end", &[1], &[2]),
            ("goto_2.start", &[2], &[3]),
            ("goto_2.end", &[3], &[4]),
        ],
    )
}

#[test]
fn actions_follow_each_other_until_the_goal() {
    let (mut executor, mut host) = (executor(sequence()), Script::default());
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Running));
    assert_eq!(host.orders(), ["start goto_1"]);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), [""; 0]);
    host.end("goto_1", ActionProgress::Succeeded);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["end goto_1", "start goto_2"]);
    host.end("goto_2", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(host.orders(), ["end goto_2"]);
    executor.restart(&mut host);
    assert_eq!(executor.progress(), ActionProgress::Running);
    assert_eq!(executor.marking(0), [1, 0, 0, 0, 0]);
}

#[test]
fn a_sensing_action_branches_by_a_condition() {
    let net = net(
        "sense",
        &[("look.exec", 1), ("clear", 0), ("blocked", 0)],
        &[("look.end [not obstacle]", &[0], &[1]), ("look.end [obstacle]", &[0], &[2])],
    );
    let (mut executor, mut host) = (executor(net), Script::default());
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start look"]);
    assert_eq!(executor.marking(0), [1, 0, 0]);
    host.set("obstacle", true);
    executor.step(&mut host).unwrap();
    assert_eq!(executor.marking(0), [0, 0, 1]);
    assert_eq!(host.orders(), ["end look"]);
}

#[test]
fn an_interrupt_stops_an_action_and_resume_continues_it() {
    let net = net(
        "interrupt",
        &[("start", 1), ("drive.exec", 0), ("wait", 0), ("goal", 0)],
        &[
            ("drive.start", &[0], &[1]),
            ("drive.interrupt [person]", &[1], &[2]),
            ("drive.resume [not person]", &[2], &[1]),
            ("drive.end", &[1], &[3]),
        ],
    );
    let (mut executor, mut host) = (executor(net), Script::default());
    host.set("person", true);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start drive", "interrupt drive"]);
    host.set("person", false);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["resume drive"]);
    host.end("drive", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
}

#[test]
fn a_join_waits_for_both_branches_of_a_fork() {
    let net = net(
        "fork",
        &[("start", 1), ("a.exec", 0), ("b.exec", 0), ("goal", 0)],
        &[("*.start", &[0], &[1, 2]), ("*.end", &[1, 2], &[3])],
    );
    let (mut executor, mut host) = (executor(net), Script::default());
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start a", "start b"]);
    host.end("b", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Running));
    host.end("a", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(host.orders(), ["end a", "end b"]);
}

#[test]
fn a_failed_action_leads_to_its_fail_transition() {
    let net = net(
        "failure",
        &[("a.exec", 1), ("goal", 0), ("fail", 0)],
        &[("a.end", &[0], &[1]), ("a.fail", &[0], &[2])],
    );
    let (mut executor, mut host) = (executor(net), Script::default());
    executor.step(&mut host).unwrap();
    host.end("a", ActionProgress::Failed);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Failed));
    assert_eq!(host.orders(), ["start a", "fail a"]);
}

#[test]
fn running_actions_end_at_goal() {
    let net = net("race", &[("a.exec", 1), ("b.exec", 1), ("goal", 0)], &[("a.end [arrived]", &[0], &[2])]);
    let (mut executor, mut host) = (executor(net), Script::default());
    host.set("arrived", true);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(host.orders(), ["start a", "start b", "end a", "end b"]);
}

#[test]
fn an_action_runs_as_long_as_its_place_has_a_token() {
    let net = net("plain", &[("P", 1), ("a.exec", 0), ("Q", 0)], &[("", &[0], &[1]), ("[go]", &[1], &[2])]);
    let (mut executor, mut host) = (executor(net), Script::default());
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start a"]);
    host.set("go", true);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["interrupt a"]);
}

fn contest() -> PetriNet {
    net("contest", &[("P", 1), ("Q", 0), ("R", 0)], &[("[a]", &[0], &[1]), ("[b]", &[0], &[2])])
}

#[test]
fn conflicts_are_decided_by_the_order_and_reported() {
    let (mut executor, mut host) = (executor(contest()), Script::default());
    host.set("a", true);
    host.set("b", true);
    executor.step(&mut host).unwrap();
    assert_eq!(executor.marking(0), [0, 1, 0]);
    let titles: Vec<String> = executor.conflicts().iter().map(|lost| executor.title(*lost)).collect();
    assert_eq!(titles, ["contest: t2 ([b])"]);
    executor.step(&mut host).unwrap();
    assert!(executor.conflicts().is_empty());
}

#[test]
fn a_seed_decides_conflicts_the_same_in_each_run() {
    let plan = Arc::new(PetriPlan::new(contest(), |_| Ok(None)).unwrap());
    let winner = |seed| {
        let mut executor = PetriNetExecutor::new(Arc::clone(&plan), ConflictOrder::Seed(seed));
        let mut host = Script::default();
        host.set("a", true);
        host.set("b", true);
        executor.step(&mut host).unwrap();
        executor.marking(0)[1]
    };
    let winners: Vec<u32> = (0..200).map(winner).collect();
    assert_eq!(winners, (0..200).map(winner).collect::<Vec<_>>());
    let first = winners.iter().sum::<u32>();
    assert!((70..130).contains(&first), "{first} of 200");
}

#[test]
fn a_goal_counts_tokens_exactly() {
    let net = net("count", &[("P", 3), ("goal(2)", 0)], &[("[go]", &[0], &[1])]);
    let (mut executor, mut host) = (executor(net), Script::default());
    host.set("go", true);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Running));
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(executor.marking(0), [1, 2]);
}

#[test]
fn a_place_that_overflows_ends_the_run_with_words() {
    let mut net = NetBuilder::new("overflow");
    let place = net.place("pool", 1);
    net.transition("pour", &[(place, 1)], &[(place, 900_000)]);
    let (mut executor, mut host) = (executor(net.finish().unwrap()), Script::default());
    executor.step(&mut host).unwrap();
    let error = executor.step(&mut host).unwrap_err().to_string();
    assert!(error.contains("transition `t1 (pour)` would put more than 1000000 tokens into place `pool`"));
    assert_eq!(executor.marking(0), [900_000]);
}

#[test]
fn nothing_fires_after_the_goal_within_a_step() {
    let two = net("two", &[("P", 1), ("Q", 1), ("goal", 0)], &[("", &[0], &[2]), ("", &[1], &[2])]);
    let (mut executor, mut host) = (executor(two), Script::default());
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(executor.marking(0), [0, 1, 1]);
}

//! The Plan that follows a Petri Net Plan.

use std::path::PathBuf;

use slate_executive::conditions::ConditionValues;
use slate_executive::petri_net_plan::{MissionStatus, PetriNetPlan, PetriNetPlanParams};
use slate_petri_net::{generate_net, parse_linear_plan, parse_rules, write_pnml};
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::{Ending, ExecuteStatus, PlanBlock, PlanStep, Planned};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::status;

type Planning = Fixture<PlanBlock<PetriNetPlan>>;

/// Writes a generated plan; returns its file.
fn file(name: &str, plan: &str, rules: &str) -> PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("petri-net-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("{name}.pnml"));
    let net = generate_net(name, &parse_linear_plan(plan).unwrap(), &parse_rules(rules).unwrap()).unwrap();
    std::fs::write(&file, write_pnml(&net)).unwrap();
    file
}

fn planning(file: &std::path::Path) -> Planning {
    let plan_filename = Text::new(file.to_str().unwrap());
    Planning::with(PetriNetPlanParams { plan_filename, ..PetriNetPlanParams::default() }).unwrap()
}

/// What the Plan sends in this tick: kind of step, kind of action, arguments.
fn sent(plan: &mut Planning) -> Vec<(PlanStep, String, Vec<f64>)> {
    plan.advance(20_000_000);
    plan.tick();
    let sent = plan.sent::<Planned>("plan");
    sent.iter()
        .map(|sent| (sent.step, sent.action.kind.as_str().to_owned(), sent.action.arguments.to_vec()))
        .collect()
}

fn append(kind: &str, arguments: &[f64]) -> (PlanStep, String, Vec<f64>) {
    (PlanStep::APPEND, kind.into(), arguments.into())
}

fn clear() -> (PlanStep, String, Vec<f64>) {
    (PlanStep::CLEAR, String::new(), Vec::new())
}

#[test]
fn actions_of_the_net_are_sent_one_after_the_other() {
    let mut plan = planning(&file("sequence", "Go_1_-2.5; Turn_90", ""));
    assert_eq!(sent(&mut plan), [append("Go", &[1.0, -2.5])]);
    let mission = plan.output::<MissionStatus>("mission").unwrap();
    assert_eq!((mission.plan.as_str(), mission.marking.as_str()), ("sequence", "Go_1_-2.5.exec"));
    plan.set("situation", status(0, 1, None));
    assert_eq!(sent(&mut plan), []);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [append("Turn", &[90.0])]);
    plan.set("situation", status(2, 2, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), []);
    let verdict = plan.output::<Verdict>("verdict").unwrap();
    assert_eq!(verdict.state, MissionState::SUCCEEDED);
}

#[test]
fn a_condition_interrupts_an_action_and_clears_it() {
    let rules = "*if* person *during* Go *do* Greet; restart_action";
    let mut plan = planning(&file("greet", "Go_1; Turn_90", rules));
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    plan.push("conditions", ConditionValues::new(&[("person", true)]));
    assert_eq!(sent(&mut plan), [clear(), append("Greet", &[])]);
    plan.set("situation", status(1, 3, Some(Ending::COMPLETED)));
    plan.push("conditions", ConditionValues::new(&[("person", false)]));
    assert_eq!(sent(&mut plan), [append("Go", &[1.0])]);
    // What a person sets counts as well.
    plan.set("situation", status(1, 4, None));
    plan.set("facts", ConditionValues::new(&[("person", true)]));
    assert_eq!(sent(&mut plan), [clear(), append("Greet", &[])]);
}

#[test]
fn an_action_that_a_reflex_has_cleared_is_sent_again() {
    let mut plan = planning(&file("reflex", "Go_1", ""));
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    sent(&mut plan);
    let cancelled = status(1, 1, Some(Ending::CANCELLED));
    plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
    assert_eq!(sent(&mut plan), [append("Go", &[1.0])]);
    plan.set("situation", ExecuteStatus { epoch: 1, ..status(1, 2, None) });
    assert_eq!(sent(&mut plan), []);
}

#[test]
fn a_failed_or_refused_action_makes_the_plan_fail() {
    for ending in [Ending::FAILED, Ending::REFUSED] {
        let mut plan = planning(&file("failure", "Go_1; Turn_90", ""));
        sent(&mut plan);
        plan.set("situation", status(1, 1, Some(ending)));
        assert_eq!(sent(&mut plan), []);
        assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::FAILED);
    }
}

#[test]
fn waits_and_time_outs_follow_the_clock() {
    let mut plan = planning(&file("times", "wait_3; Go_1|5; Turn_90", ""));
    assert_eq!(sent(&mut plan), []);
    plan.advance(2_900_000_000);
    assert_eq!(sent(&mut plan), []);
    plan.advance(100_000_000);
    assert_eq!(sent(&mut plan), [append("Go", &[1.0])]);
    plan.set("situation", status(0, 1, None));
    plan.advance(4_900_000_000);
    assert_eq!(sent(&mut plan), []);
    plan.advance(100_000_000);
    assert_eq!(sent(&mut plan), [clear(), append("Turn", &[90.0])]);
}

#[test]
fn a_restored_mission_goes_on_as_the_saved_one() {
    let file = file("saved", "Go_1; wait_2; Turn_90", "*if* person *during* Go *do* skip_action");
    let mut plan = planning(&file);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    sent(&mut plan);
    let mut other = planning(&file);
    other.restore(&plan.save().unwrap()).unwrap();
    assert_eq!(
        other.save().unwrap(),
        plan.save().unwrap(),
        "a state that waits for its plan is saved as it is"
    );
    other.advance(40_000_000);
    for plan in [&mut plan, &mut other] {
        plan.set("situation", status(0, 1, None));
        assert_eq!(sent(plan), []);
        assert!(!plan.wrote("mission"), "nothing has changed");
        plan.push("conditions", ConditionValues::new(&[("person", true)]));
        assert_eq!(sent(plan), [clear()]);
        plan.advance(2_000_000_000);
        assert_eq!(sent(plan), [append("Turn", &[90.0])]);
    }
    assert_eq!(other.save().unwrap(), plan.save().unwrap());
}

#[test]
fn a_changed_file_takes_over_or_is_refused_in_a_running_mission() {
    let place = file("reload", "Go_1; Turn_90", "");
    let mut plan = planning(&place);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    file("reload", "Go_1; Look", "");
    plan.params().revision = 1;
    assert_eq!(sent(&mut plan), []);
    // A plan that lacks the place with the token: the mission continues with the old one.
    file("reload", "Stop", "");
    plan.params().revision = 2;
    assert_eq!(sent(&mut plan), []);
    std::fs::write(&place, "<pnml>").unwrap();
    plan.params().revision = 3;
    sent(&mut plan);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [append("Look", &[])]);
}

#[test]
fn a_plan_that_can_not_run_fails_with_the_reason() {
    let reason = |file: &std::path::Path| {
        let mut plan = planning(file);
        assert_eq!(sent(&mut plan), []);
        let verdict = plan.output::<Verdict>("verdict").unwrap();
        assert_eq!(verdict.state, MissionState::FAILED);
        verdict.reason.as_str().to_owned()
    };
    assert_eq!(reason(std::path::Path::new("")), "a mission needs a file with its plan");
    assert!(reason(std::path::Path::new("none.pnml")).starts_with("none.pnml: can't be read"));
    // The log has the folder.
    assert!(reason(&file("words", "Go_there", "")).starts_with("words.pnml: expected numbers"));
}

#[test]
fn a_mission_that_has_ended_is_followed_by_the_next_file() {
    let mut plan = planning(&file("first", "Go_1", ""));
    sent(&mut plan);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), []);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
    let next = file("next", "Go_2", "");
    plan.params().plan_filename = Text::new(next.to_str().unwrap());
    assert_eq!(sent(&mut plan), [append("Go", &[2.0])]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::RUNNING);
}

#[test]
fn a_robot_whose_plan_overflows_stops_its_action() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("petri-net-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("overflow.pnml");
    let mut net = slate_petri_net::NetBuilder::new("overflow");
    let (drive, many) = (net.place("Go_1.exec", 1), net.place("many", 1));
    net.transition("", &[(many, 1)], &[(many, 30_000)]);
    net.transition("Go_1.end", &[(drive, 1)], &[]);
    std::fs::write(&path, write_pnml(&net.finish().unwrap())).unwrap();
    let mut plan = planning(&path);
    let steps: Vec<_> = (0..100).map(|_| sent(&mut plan)).take_while(|steps| *steps != [clear()]).collect();
    assert!(steps.len() < 100, "the net overflows");
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::FAILED);
}

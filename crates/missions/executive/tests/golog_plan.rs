//! The Plan that follows a Golog program.

use std::path::{Path, PathBuf};

use slate_executive::conditions::ConditionValues;
use slate_executive::golog_plan::{GologMissionStatus, GologPlan, GologPlanParams};
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::{Ending, ExecuteStatus, PlanBlock};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};

type GologPlanning = Fixture<PlanBlock<GologPlan>>;

const THEORY: &str = "domain place = desk, shelf\ntable x(place) = desk: 1.5, shelf: -2\ncondition near\n\
    fluent met = false\nexogenous bell met becomes false\n\
    action go(p: place) performs Go(x(p), 1)\naction rest met becomes true\n";

/// Writes a theory; returns its file.
fn file(name: &str, program: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golog-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("{name}.golog"));
    std::fs::write(&file, format!("{THEORY}{program}")).unwrap();
    file
}

fn planning(file: &Path) -> GologPlanning {
    let program_filename = Text::new(file.to_str().unwrap());
    GologPlanning::with(GologPlanParams { program_filename, ..GologPlanParams::default() }).unwrap()
}

fn running(plan: &GologPlanning) -> String {
    plan.output::<GologMissionStatus>("mission").unwrap().running.as_str().to_owned()
}

#[test]
fn actions_of_the_program_are_sent_with_numbers_of_its_tables() {
    let mut plan = planning(&file("tour", "procedure main { for p: place { go(p) } }"));
    assert_eq!(sent(&mut plan), ["Go 1.5 1"]);
    assert_eq!(running(&plan), "go(desk)");
    plan.set("situation", status(0, 1, None));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("mission"), "nothing has changed");
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["Go -2 1"]);
    plan.set("situation", status(2, 2, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
}

#[test]
fn an_interrupt_clears_the_action_and_starts_it_again() {
    let program = "procedure main { interrupt near and not met { rest } >> go(desk) }";
    let mut plan = planning(&file("interrupt", program));
    assert_eq!(sent(&mut plan), ["Go 1.5 1"]);
    plan.set("situation", status(0, 1, None));
    plan.push("conditions", ConditionValues::new(&[("near", true)]));
    assert_eq!(sent(&mut plan), ["clear", "rest"]);
    assert_eq!(running(&plan), "go(desk) waits, rest");
    plan.set("situation", status(1, 3, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["Go 1.5 1"]);
    plan.push("conditions", ConditionValues::new(&[("bell", true)]));
    assert_eq!(sent(&mut plan), ["clear", "rest"], "an exogenous action has made it unmet");
}

#[test]
fn unknown_conditions_of_a_program_are_named() {
    let mut plan = planning(&file("unknown", "procedure main { test near; rest }"));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(running(&plan), "waits for `near`");
    plan.push("conditions", ConditionValues::new(&[("near", true)]));
    assert_eq!(sent(&mut plan), ["rest"]);
}

#[test]
fn a_restored_program_goes_on_as_the_saved_one() {
    let file = file("saved", "procedure main { search { { go(desk); test near } | go(shelf) }; rest }");
    let mut plan = planning(&file);
    sent(&mut plan);
    let mut other = planning(&file);
    other.restore(&plan.save().unwrap()).unwrap();
    assert_eq!(other.save().unwrap(), plan.save().unwrap(), "it waits for its program");
    other.advance(20_000_000);
    for plan in [&mut plan, &mut other] {
        let cancelled = status(1, 1, Some(Ending::CANCELLED));
        plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
        assert_eq!(sent(plan), ["Go -2 1"], "what a reflex has cleared is sent again");
        plan.set("situation", ExecuteStatus { epoch: 1, ..status(2, 2, Some(Ending::COMPLETED)) });
        assert_eq!(sent(plan), ["rest"]);
    }
    assert_eq!(other.save().unwrap(), plan.save().unwrap());
}

#[test]
fn a_changed_program_takes_over_or_is_refused() {
    let place = file("reload", "procedure main { go(desk); go(shelf) }");
    let mut plan = planning(&place);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    file("reload", "procedure main { go(desk); rest }");
    plan.params().revision = 1;
    assert_eq!(sent(&mut plan), [""; 0]);
    file("reload", "procedure main { rest; go(shelf) }");
    plan.params().revision = 2;
    assert_eq!(sent(&mut plan), [""; 0]);
    file("reload", "define a = b define b = a procedure main { rest }");
    plan.params().revision = 3;
    sent(&mut plan);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["rest"], "the mission continues with the old program");
}

#[test]
fn a_program_that_can_not_run_fails_with_the_reason() {
    let reason = |file: &Path| {
        let mut plan = planning(file);
        assert_eq!(sent(&mut plan), [""; 0]);
        let verdict = plan.output::<Verdict>("verdict").unwrap();
        assert_eq!(verdict.state, MissionState::FAILED);
        verdict.reason.as_str().to_owned()
    };
    assert_eq!(reason(Path::new("")), "a mission needs a file with its program");
    assert!(reason(Path::new("none.golog")).starts_with("none.golog: can't be read"));
    let said = reason(&file("plain", "action fetch(p: place) procedure main { fetch(desk) }"));
    assert!(said.starts_with("plain.golog:8: expected what the robot performs for `fetch`"), "{said}");
}

//! The Plan that runs skills in Lua.

use std::path::{Path, PathBuf};

use slate_executive::behavior_plan::{BehaviorPlan, BehaviorPlanParams, SkillMissionStatus};
use slate_executive::conditions::ConditionValues;
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::{Ending, ExecuteStatus, PlanBlock};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};

type SkillPlanning = Fixture<PlanBlock<BehaviorPlan>>;

/// Writes a skill whose file has states and transitions; returns the file.
fn file(name: &str, rest: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("behavior-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("{name}.lua"));
    let text = format!(
        "module(..., skillenv.module_init)\nname = '{name}'\ndocumentation = ''\n\
         depends_actions = {{{{v = 'go', kind = 'Go', arguments = {{'x'}}}}, {{v = 'look', kind = 'Look'}},\
         {{v = 'wait', arguments = {{'seconds'}}}}}}\n\
         skillenv.skill_module(_M)\nfsm = SkillHSM:new{{name = name, start = 'GO'}}\n{rest}"
    );
    std::fs::write(&file, text).unwrap();
    file
}

/// States that go to a place, wait, and look.
const VISIT: &str = "fsm:define_states{export_to = _M,
    {'GO', SkillJumpState, skills = {{go, x = 1.5}}, final_to = 'WAIT', fail_to = 'FAILED'},
    {'WAIT', SkillJumpState, skills = {{wait, seconds = 2}}, final_to = 'LOOK'},
    {'LOOK', SkillJumpState, skills = {{look}}, final_to = 'FINAL', fail_to = 'FAILED'}}
    fsm:add_transitions{{'GO', 'LOOK', cond = 'conditions.person'}}";

fn planning(file: &Path) -> SkillPlanning {
    let skill_filename = Text::new(file.to_str().unwrap());
    SkillPlanning::with(BehaviorPlanParams { skill_filename, ..BehaviorPlanParams::default() }).unwrap()
}

#[test]
fn actions_of_skills_are_sent_one_after_the_other() {
    let mut plan = planning(&file("visit", VISIT));
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
    assert_eq!(plan.output::<SkillMissionStatus>("mission").unwrap().active.as_str(), "visit/GO");
    plan.set("situation", status(0, 1, None));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("mission"), "nothing has changed");
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(plan.output::<SkillMissionStatus>("mission").unwrap().active.as_str(), "visit/WAIT");
    assert_eq!(sent(&mut plan), [""; 0], "the Plan waits");
    plan.advance(2_000_000_000);
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(sent(&mut plan), ["Look"]);
    plan.set("situation", status(2, 2, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("verdict"), "it ended once");
}

#[test]
fn a_condition_leaves_a_state_and_clears_its_action() {
    let mut plan = planning(&file("person", VISIT));
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    plan.push("conditions", ConditionValues::new(&[("person", true)]));
    let mut steps = sent(&mut plan);
    steps.extend(sent(&mut plan));
    assert_eq!(steps, ["clear", "Look"]);
}

#[test]
fn an_action_of_a_skill_that_a_reflex_cleared_is_sent_again() {
    let mut plan = planning(&file("reflex", VISIT));
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    sent(&mut plan);
    let cancelled = status(1, 1, Some(Ending::CANCELLED));
    plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
}

#[test]
fn a_skill_that_fails_or_runs_away_ends_the_mission() {
    let verdict = |name: &str, rest: &str| {
        let mut plan = planning(&file(name, rest));
        sent(&mut plan);
        let verdict = plan.output::<Verdict>("verdict").unwrap();
        assert_eq!(verdict.state, MissionState::FAILED);
        sent(&mut plan);
        assert!(!plan.wrote("verdict"), "it failed once");
        plan.save().unwrap();
        verdict.reason.as_str().to_owned()
    };
    let loops =
        "fsm:define_states{export_to = _M, {'GO', JumpState}}\nfunction GO:loop() while true do end end";
    assert!(verdict("endless", loops).starts_with("endless.lua:8: the script was stopped"));
    let fails = "fsm:define_states{export_to = _M, {'GO', JumpState}}\nfunction GO:loop() error('no') end";
    assert_eq!(verdict("fails", fails), "fails: state `GO` failed in its loop: fails.lua:8: no");
}

#[test]
fn a_restored_skill_goes_on_as_the_saved_one() {
    let file = file("saved", VISIT);
    let mut plan = planning(&file);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    sent(&mut plan);
    let mut other = planning(&file);
    other.restore(&plan.save().unwrap()).unwrap();
    assert_eq!(
        other.save().unwrap(),
        plan.save().unwrap(),
        "a state that waits for its file is saved as it is"
    );
    other.advance(40_000_000);
    for plan in [&mut plan, &mut other] {
        plan.set("situation", status(0, 1, None));
        assert_eq!(sent(plan), [""; 0]);
        assert!(!plan.wrote("mission"), "nothing has changed");
        let cancelled = status(1, 1, Some(Ending::CANCELLED));
        plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
        assert_eq!(sent(plan), ["Go 1.5"], "with its arguments");
    }
    assert_eq!(other.save().unwrap(), plan.save().unwrap());
}

#[test]
fn changed_skills_take_over_or_are_refused_in_a_running_mission() {
    let place = file("reload", VISIT);
    let mut plan = planning(&place);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    file("reload", &VISIT.replace("final_to = 'WAIT'", "final_to = 'LOOK'"));
    plan.params().revision = 1;
    assert_eq!(sent(&mut plan), [""; 0]);
    // Files that lack the state, or have wrong syntax: the mission continues with the old ones.
    file("reload", "fsm:define_states{export_to = _M, {'OTHER', JumpState}}");
    plan.params().revision = 2;
    assert_eq!(sent(&mut plan), [""; 0]);
    std::fs::write(&place, "x = = 1").unwrap();
    plan.params().revision = 3;
    assert_eq!(sent(&mut plan), [""; 0]);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    let mut steps = sent(&mut plan);
    steps.extend(sent(&mut plan));
    assert_eq!(steps, ["Look"]);
}

#[test]
fn skills_that_can_not_run_fail_with_the_reason() {
    let reason = |file: &Path| {
        let mut plan = planning(file);
        assert_eq!(sent(&mut plan), [""; 0]);
        let verdict = plan.output::<Verdict>("verdict").unwrap();
        assert_eq!(verdict.state, MissionState::FAILED);
        verdict.reason.as_str().to_owned()
    };
    assert_eq!(reason(Path::new("")), "a mission needs a file with its skills");
    assert_eq!(reason(Path::new("none.lua")), "module `none` is not a file of the skill path");
}

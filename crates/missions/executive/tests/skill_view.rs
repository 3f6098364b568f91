//! Publications of skills in Lua, and orders of a developer.

use slate_executive::behavior_plan::{BehaviorPlan, BehaviorPlanParams, SkillMissionStatus};
use slate_executive::conditions::ConditionValues;
use slate_executive::view::{ForcedOutcome, MissionCommand, MissionItemStatus};
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::PlanBlock;
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};
use crate::view::{element, file, force, graph, item, order};

const VISIT: &str = "module(..., skillenv.module_init)\nname = 'tour'\ndocumentation = ''\n\
    depends_actions = {{v = 'go', kind = 'Go', arguments = {'x'}}}\n\
    skillenv.skill_module(_M)\nfsm = SkillHSM:new{name = name, start = 'WAIT'}\n\
    fsm:define_states{export_to = _M, {'WAIT', JumpState},\n\
    {'GO', SkillJumpState, skills = {{go, x = 1.5}}, final_to = 'FINAL', fail_to = 'FAILED'}}\n\
    fsm:add_transitions{{'WAIT', 'GO', cond = 'conditions.ready'}}";

#[test]
fn machine_shows_its_state_and_jumps_to_a_forced_one() {
    let skill_filename = Text::new(file("tour.lua", VISIT).to_str().unwrap());
    let params = BehaviorPlanParams { skill_filename, ..BehaviorPlanParams::default() };
    let mut plan = Fixture::<PlanBlock<BehaviorPlan>>::with(params).unwrap();
    assert_eq!(sent(&mut plan), [""; 0]);
    let graph = graph(&plan);
    let [wait, go, ready] = ["WAIT", "GO: go", "conditions.ready"].map(|label| element(&graph, label));
    assert_eq!(item(&plan, wait).unwrap().0, MissionItemStatus::CURRENT);
    assert_eq!(item(&plan, go), None);
    assert_eq!(item(&plan, ready), Some((MissionItemStatus::WAITING, 0, "does not hold yet".into())));
    plan.push("orders", order(MissionCommand::PAUSE));
    plan.push("conditions", ConditionValues::new(&[("ready", false)]));
    assert_eq!(sent(&mut plan), [""; 0]);
    plan.push("orders", force(&graph, "GO: go", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), [""; 0], "its skill begins with the next step");
    assert_eq!(item(&plan, go).unwrap().0, MissionItemStatus::CURRENT);
    assert_eq!(plan.output::<SkillMissionStatus>("mission").unwrap().active.as_str(), "tour/GO");
    plan.push("orders", order(MissionCommand::STEP));
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
    plan.set("situation", status(0, 1, None));
    // Back, which stops the action; and there again.
    plan.push("orders", force(&graph, "WAIT", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["clear"]);
    plan.push("orders", order(MissionCommand::RESUME));
    plan.push("conditions", ConditionValues::new(&[("ready", true)]));
    sent(&mut plan);
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
    plan.set("situation", status(0, 3, None));
    plan.push("orders", force(&graph, "tour: Go", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["clear"]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
}

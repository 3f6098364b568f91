//! Skills that run skills and actions, and agents above them.

use slate_behavior::{BehaviorEngine, BehaviorLimits, BehaviorProgress, BehaviorStatus, SkillFiles};

use crate::common::{Robot, TICK, engine, machine, run};

const GO: &str = "fsm:define_states{export_to = _M,
    {'A', SkillJumpState, skills = {{go, x = 1}}, final_to = 'FINAL', fail_to = 'FAILED'}}";

#[test]
fn a_skill_performs_an_action_of_the_robot() {
    let mut robot = Robot::default();
    let mut engine = engine(&machine(GO));
    assert_eq!(run(&mut engine, &mut robot, 3), BehaviorStatus::Running);
    assert_eq!(robot.events, ["start Go [1.0, 2.0]"]);
    robot.progress.insert(0, BehaviorProgress::Preempted);
    assert_eq!(engine.tick(3 * TICK, &mut robot), Ok(BehaviorStatus::Running));
    robot.progress.insert(0, BehaviorProgress::Succeeded);
    assert_eq!(engine.tick(4 * TICK, &mut robot), Ok(BehaviorStatus::Succeeded));
}

#[test]
fn a_failed_action_fails_the_skill() {
    let mut robot = Robot::default();
    let mut engine = engine(&machine(GO));
    run(&mut engine, &mut robot, 2);
    robot.progress.insert(0, BehaviorProgress::Failed);
    assert_eq!(engine.tick(2 * TICK, &mut robot), Ok(BehaviorStatus::Failed));
    assert_eq!(engine.reason(), "it: go failed: action `Go` failed");
}

#[test]
fn an_action_without_its_arguments_fails_the_skill() {
    let mut engine = engine(&machine(&GO.replace(", x = 1", ", x = 'far'")));
    assert_eq!(run(&mut engine, &mut Robot::default(), 2), BehaviorStatus::Failed);
    assert_eq!(engine.reason(), "it: go failed: action `Go`: expected a number as `x`, found far");
}

#[test]
fn a_state_that_is_left_stops_its_actions() {
    let rest = format!("{GO}\nfsm:add_transitions{{{{'A', 'FINAL', timeout = 0.2}}}}");
    let mut robot = Robot::default();
    assert_eq!(run(&mut engine(&machine(&rest)), &mut robot, 5), BehaviorStatus::Succeeded);
    assert_eq!(robot.events, ["start Go [1.0, 2.0]", "stop 0"]);
}

/// A skill that prints its arguments, and ends after a number of loops.
const STEPS: &str = "module(..., skillenv.module_init)
    name = 'steps' documentation = ''
    skillenv.skill_module(...)
    fsm = SkillHSM:new{name = name, start = 'RUN'}
    fsm:define_states{export_to = _M, {'RUN', JumpState}}
    fsm:add_transitions{{'RUN', 'FAILED', cond = 'vars.bad', desc = 'bad'},
        {'RUN', 'FINAL', cond = 'vars.done == vars.count'}}
    function RUN:init() self.fsm.vars.done = 0 print('steps', self.fsm.vars.count, self.fsm.vars.text) end
    function RUN:loop() self.fsm.vars.done = self.fsm.vars.done + 1 end";

fn load(main: &str, call: &str) -> BehaviorEngine {
    let files = SkillFiles::from_texts("main", &[("main", main), ("steps", STEPS)]);
    BehaviorEngine::load(&files, call, BehaviorLimits::default()).unwrap()
}

fn user(states: &str) -> String {
    format!(
        "module(..., skillenv.module_init) name = 'user' documentation = '' depends_skills = {{'steps'}}
         skillenv.skill_module(_M)
         fsm = SkillHSM:new{{name = name, start = 'A'}}\n{states}"
    )
}

#[test]
fn skills_call_skills_with_arguments() {
    let ways = [
        "{'A', SkillJumpState, skills = {{steps, count = 2, text = 't'}}, final_to = 'FINAL'}}",
        "{'A', SkillJumpState, skills = {{'steps', {count = 2, text = 't'}}}, final_to = 'FINAL'}}",
        "{'A', SkillJumpState, skills = {{steps}}, final_to = 'FINAL', fail_to = 'FINAL'}}
            function A:init() self.args.steps = {count = 2, text = 't'} end",
        "{'A', SkillJumpState, skills = {{steps}}, final_to = 'FINAL'}}
            function A:init() self.args[steps] = {count = 2, text = 't'} end",
        "{'A', SkillJumpState, skills = {{steps, text = 't'}}, final_to = 'FINAL'}}
            function A:init() self.skills[1].args = {count = 2} self.args = {} end",
    ];
    for way in ways {
        let mut robot = Robot::default();
        let mut engine = load(&user(&format!("fsm:define_states{{export_to = _M, {way}")), "");
        assert_eq!(run(&mut engine, &mut robot, 5), BehaviorStatus::Succeeded, "{way}");
        assert_eq!(robot.events, ["steps, 2, t"], "{way}");
    }
}

#[test]
fn a_failed_skill_is_left_to_its_user() {
    let states = "fsm:define_states{export_to = _M,
        {'A', SkillJumpState, skills = {{steps, count = 1, bad = true}}, final_to = 'FINAL', fail_to = 'B'},
        {'B', SkillJumpState, skills = {{steps, count = 1}}, final_to = 'FINAL', fail_to = 'FAILED'}}";
    let mut robot = Robot::default();
    assert_eq!(run(&mut load(&user(states), ""), &mut robot, 5), BehaviorStatus::Succeeded);
    assert_eq!(robot.events, ["steps, 1, nil", "steps, 1, nil"]);
}

#[test]
fn a_call_runs_skills_until_all_have_succeeded() {
    let mut robot = Robot::default();
    let main = "use_skill('steps')";
    let mut engine = load(main, "steps{count = 3, text = 'call'}");
    assert_eq!(run(&mut engine, &mut robot, 2), BehaviorStatus::Running);
    assert_eq!(engine.active(), "steps/RUN");
    assert_eq!(run(&mut engine, &mut robot, 5), BehaviorStatus::Succeeded);
    assert_eq!(robot.events, ["steps, 3, call"]);
}

#[test]
fn an_agent_runs_skills_with_its_variables() {
    let main = "module(..., agentenv.module_init) name = 'agent' documentation = '' depends_skills = {'steps'}
        agentenv.agent_module(...)
        fsm = AgentHSM:new{name = name, start = 'A'}
        fsm:define_states{export_to = _M,
            {'A', JumpState},
            {'B', SkillJumpState, skills = {{'steps', {count = 'number'}, text = 'fixed'}}, final_to = 'FINAL', fail_to = 'A'}}
        fsm:add_transitions{{'A', 'B', cond = true}}
        function A:init() self.fsm.vars.number = 2 end";
    let mut robot = Robot::default();
    assert_eq!(run(&mut load(main, ""), &mut robot, 5), BehaviorStatus::Succeeded);
    assert_eq!(robot.events, ["steps, 2, fixed"]);
}

#[test]
fn conditions_are_those_of_the_robot() {
    let rest = "fsm:define_states{export_to = _M, 'A', 'B'}
        fsm:add_transitions{{'A', 'B', cond = 'conditions.ready'}, {'B', 'FINAL', cond = function() return not conditions.ready end}}";
    let mut robot = Robot::default();
    let mut engine = engine(&machine(rest));
    for (value, state) in [(None, "it/A"), (Some(false), "it/A"), (Some(true), "it/B")] {
        robot.conditions = value.map(|value| ("ready".into(), value)).into_iter().collect();
        engine.tick(0, &mut robot).unwrap();
        assert_eq!(engine.active(), state);
    }
    robot.conditions.clear();
    assert_eq!(engine.tick(TICK, &mut robot), Ok(BehaviorStatus::Succeeded));
}

#[test]
fn older_skill_files_run() {
    let rest = "fsm:new_jump_state('A')
        WAIT = WaitState:new{name = 'WAIT', fsm = fsm, next_state = FINAL}
        fsm:add_state(WAIT)
        function A:jumpcond_sent() return true, 0.3 end
        A:add_precond_trans(FAILED, function(state) return state.fsm.vars.bad end, 'bad')
        A:add_transition(WAIT, A.jumpcond_sent, 'sent')";
    let mut engine = engine(&machine(rest));
    let mut robot = Robot::default();
    assert_eq!(run(&mut engine, &mut robot, 3), BehaviorStatus::Running);
    assert_eq!(engine.active(), "it/WAIT");
    assert_eq!(engine.tick(3 * TICK, &mut robot), Ok(BehaviorStatus::Succeeded));
}

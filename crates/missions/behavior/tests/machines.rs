//! State machines: order of phases, transitions, timeouts, machines inside of states.

use slate_behavior::BehaviorStatus;

use crate::common::{Robot, TICK, engine, machine, run};

/// What a machine prints until it ends, and how it ends.
fn trace(rest: &str, ticks: u64) -> (Vec<String>, BehaviorStatus) {
    let mut robot = Robot::default();
    let status = run(&mut engine(&machine(rest)), &mut robot, ticks);
    (robot.events, status)
}

#[test]
fn phases_of_a_state_follow_each_other() {
    let rest = "fsm:define_states{export_to = _M, {'A', JumpState}, {'B', JumpState}}
        fsm:add_transitions{{'A', 'B', cond = 'vars.count == 2'}, {'B', 'FINAL', cond = true}}
        function A:init() self.fsm.vars.count = 0 print('init A') end
        function A:loop() self.fsm.vars.count = self.fsm.vars.count + 1 print('loop A') end
        function A:exit() print('exit A') end
        function B:init() print('init B') end
        function B:loop() print('loop B') end";
    let expected = ["init A", "loop A", "loop A", "exit A", "init B"];
    assert_eq!(trace(rest, 9), (expected.map(String::from).to_vec(), BehaviorStatus::Succeeded));
}

#[test]
fn the_first_transition_that_fires_is_taken() {
    let rest = "fsm:define_states{export_to = _M, closure = {two = 2}, 'A', {'B', JumpState}, {'C', JumpState}}
        fsm:add_transitions{{'A', 'FAILED', precond = 'not two'}, {'A', 'B', cond = function(state) return state == A end},
            {'A', 'C', true}, {'B', 'FINAL', precond = true, desc = 'skipped'}}
        function B:init() print('never') end";
    assert_eq!(trace(rest, 3), (Vec::new(), BehaviorStatus::Succeeded));
}

#[test]
fn timeouts_follow_the_time_of_the_host() {
    let rest = "fsm:define_states{export_to = _M, 'A', 'B'}
        fsm:add_transitions{{'A', 'B', timeout = 0.3}, {'B', 'FINAL', timeout = {0.2, 'FINAL'}}}
        function B:init() print(Time:new():in_msec()) end
        function FINAL:init() print(Time:new():in_msec()) end";
    assert_eq!(trace(rest, 9), (vec!["300".into(), "500".into()], BehaviorStatus::Succeeded));
}

#[test]
fn a_condition_adds_arguments_of_the_next_init() {
    let rest = "fsm:define_states{export_to = _M, 'A', 'B'}
        A:add_new_transition(B, function() return true, 7, 'x' end)
        B:add_new_transition(FINAL, true)
        function B:init(number, text) print(number, text) end";
    assert_eq!(trace(rest, 3).0, ["7, x"]);
}

#[test]
fn a_script_error_fails_the_machine_with_its_place() {
    let mut robot = Robot::default();
    let mut engine = engine(&machine(
        "fsm:define_states{export_to = _M, 'A'}\nfunction A:loop() local x = self.nothing.here end",
    ));
    assert_eq!(run(&mut engine, &mut robot, 3), BehaviorStatus::Failed);
    let expected =
        "it: state `A` failed in its loop: it.lua:8: attempt to index a nil value (field 'nothing')";
    assert_eq!(engine.reason(), expected);
}

#[test]
fn transitions_without_end_fail_the_tick() {
    let mut engine = engine(&machine(
        "fsm:define_states{export_to = _M, 'A', 'B'}\nfsm:add_transitions{{'A', 'B', cond = true}, {'B', 'A', cond = true}}",
    ));
    let error = engine.tick(0, &mut Robot::default()).unwrap_err().to_string();
    assert!(error.contains("`it`: 10 transitions follow each other at once"), "{error}");
}

#[test]
fn a_failed_state_has_the_reason_of_its_transition() {
    let mut engine = engine(&machine(
        "fsm:define_states{export_to = _M, 'A'}\nfsm:add_transitions{{'A', 'FAILED', cond = true, desc = 'no way'}}",
    ));
    assert_eq!(run(&mut engine, &mut Robot::default(), 2), BehaviorStatus::Failed);
    assert_eq!(engine.reason(), "it: no way");
}

#[test]
fn a_machine_inside_of_a_state_runs_with_it() {
    let rest = "local inner = HSM:new{name = 'inner', start = 'X', exit_state = 'DONE', fail_state = 'LOST'}
        inner:define_states{{'X', JumpState}, {'DONE', JumpState}, {'LOST', JumpState}}
        inner:add_transitions{{'X', 'DONE', cond = 'vars.goal == 1'}, {'X', 'LOST', cond = true, desc = 'lost'}}
        fsm:define_states{export_to = _M, {'A', SubFSMJumpState, subfsm = inner, exit_to = 'B', fail_to = 'FAILED'},
            {'B', SubFSMJumpState, subfsm = inner, exit_to = 'FINAL', fail_to = 'FAILED'}}
        function A:init() self.fsm.vars.goal = 1 end
        function B:init() self.fsm.vars.goal = 2 print('B') end";
    let mut robot = Robot::default();
    let mut engine = engine(&machine(rest));
    assert_eq!(run(&mut engine, &mut robot, 5), BehaviorStatus::Failed);
    assert_eq!(
        (engine.reason().as_str(), robot.events.as_slice()),
        ("it: FSM failed: lost", &["B".to_string()][..])
    );
}

#[test]
fn several_machines_succeed_when_all_have() {
    let rest = "local parts = {}
        for index = 1, 2 do
            local part = HSM:new{name = 'part' .. index, start = 'X', exit_state = 'DONE', fail_state = 'LOST'}
            part:define_states{{'X', JumpState}, {'DONE', JumpState}, {'LOST', JumpState}}
            part:add_transitions{{'X', 'DONE', timeout = index}}
            parts[index] = part
        end
        fsm:define_states{export_to = _M,
            {'A', MultiSubFSMJumpState, subfsms = parts, exit_to = 'FINAL', fail_to = 'FAILED'}}";
    let mut robot = Robot::default();
    let mut engine = engine(&machine(rest));
    assert_eq!(run(&mut engine, &mut robot, 15), BehaviorStatus::Running);
    assert_eq!(engine.active(), "it/A, part2/X");
    assert_eq!(engine.tick(20 * TICK, &mut robot), Ok(BehaviorStatus::Succeeded));
}

#[test]
fn a_default_transition_leads_out_of_every_state() {
    let rest = "fsm:define_states{export_to = _M, 'A', 'B'}
        fsm:add_transitions{{'FAILED', cond = 'vars.stop', desc = 'stopped'}, {'A', 'B', cond = true}}
        function B:loop() self.fsm.vars.stop = true end";
    let mut engine = engine(&machine(rest));
    assert_eq!(run(&mut engine, &mut Robot::default(), 5), BehaviorStatus::Failed);
    assert_eq!(engine.reason(), "it: stopped");
}

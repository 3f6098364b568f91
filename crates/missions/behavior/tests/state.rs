//! State that is saved, restored, and carried to changed files.

use slate_behavior::{
    BehaviorEngine, BehaviorLimits, BehaviorProgress, BehaviorState, BehaviorStatus, SkillFiles,
};

use crate::common::{Robot, TICK, engine, files, machine};

/// A machine with all that a state has: variables, fields of states, arguments, timeouts, an action, random numbers.
const BUSY: &str = "total = 0
    fsm:define_states{export_to = _M, 'A', {'B', SkillJumpState, skills = {{go}}, final_to = 'A', fail_to = 'A'}, 'C'}
    fsm:add_transitions{{'A', 'B', cond = 'self.count >= 3'}, {'A', 'C', timeout = 0.7}, {'B', 'C', timeout = 0.4},
        {'C', 'A', cond = 'vars.list[#vars.list] > 3', desc = 'again'}, {'C', 'B', cond = true}}
    function A:init() self.count = 0 self.fsm.vars.list = self.fsm.vars.list or {1, deep = {math.nan, [2.5] = 'x'}} end
    function A:loop()
        self.count = self.count + 1
        total = total + 1
        local list = self.fsm.vars.list
        list[#list + 1] = math.random(6)
        if #list > 9 then list[5] = nil list.same = list.deep list.owner = self end
    end
    function B:init() self.args.go = {x = total, y = self.fsm.vars.list[1]} end
    function C:init() self.since = Time:new() print(self.since:in_msec(), total) end";

/// What a robot does and prints in a tick, with random progress.
fn tick(engine: &mut BehaviorEngine, robot: &mut Robot, number: u64) {
    let progress = match number % 5 {
        0 => BehaviorProgress::Succeeded,
        3 => BehaviorProgress::Failed,
        _ => BehaviorProgress::Running,
    };
    robot.progress.insert(0, progress);
    engine.tick(number * TICK, robot).unwrap();
    robot.events.push(engine.active());
}

fn through_text(state: &BehaviorState) -> BehaviorState {
    serde_json::from_str(&serde_json::to_string(state).unwrap()).unwrap()
}

#[test]
fn a_restored_engine_goes_on_as_the_saved_one() {
    let text = machine(BUSY);
    let files = files(&text);
    let (mut whole, mut robot) = (engine(&text), Robot::default());
    (0..60).for_each(|number| tick(&mut whole, &mut robot, number));
    for end in [0, 1, 2, 5, 8, 13, 21, 34, 55] {
        let (mut part, mut other) = (engine(&text), Robot::default());
        (0..end).for_each(|number| tick(&mut part, &mut other, number));
        let state = through_text(&part.state().unwrap());
        drop(part);
        let mut part = BehaviorEngine::restore(&files, "", BehaviorLimits::default(), &state).unwrap();
        assert_eq!(part.state().unwrap(), state, "at {end}");
        (end..60).for_each(|number| tick(&mut part, &mut other, number));
        assert_eq!(other.events, robot.events, "at {end}");
        assert_eq!(through_text(&part.state().unwrap()), through_text(&whole.state().unwrap()), "at {end}");
    }
}

#[test]
fn a_state_that_has_run_nothing_is_nearly_empty() {
    assert!(engine(&machine(BUSY)).state().unwrap().is_empty());
}

#[test]
fn an_ended_mission_stays_ended() {
    let text =
        machine("fsm:define_states{export_to = _M, 'A'}\nfsm:add_transitions{{'A', 'FINAL', cond = true}}");
    let mut ended = engine(&text);
    ended.tick(0, &mut Robot::default()).unwrap();
    let state = ended.state().unwrap();
    let mut other = BehaviorEngine::restore(&files(&text), "", BehaviorLimits::default(), &state).unwrap();
    assert_eq!(other.status(), BehaviorStatus::Succeeded);
    assert_eq!(other.tick(TICK, &mut Robot::default()), Ok(BehaviorStatus::Succeeded));
}

#[test]
fn a_function_in_a_variable_can_not_be_saved() {
    let text = machine(
        "fsm:define_states{export_to = _M, 'A'}\nfunction A:init() self.fsm.vars.f = {g = print} end",
    );
    let mut engine = engine(&text);
    engine.tick(0, &mut Robot::default()).unwrap();
    let error = engine.state().unwrap_err().to_string();
    assert_eq!(error, "vars:it.f.g is a function, which can't be saved; keep plain data there");
}

#[test]
fn a_changed_mission_takes_over_what_runs() {
    let old = machine(
        "SPEED = 1\nfsm:define_states{export_to = _M, 'A'}\nfunction A:init() self.fsm.vars.n = 5 end",
    );
    let new = machine(
        "SPEED = 2\nfsm:define_states{export_to = _M, 'NEW', 'A'}
         fsm:add_transitions{{'A', 'FINAL', cond = 'vars.n == 5'}}
         function FINAL:init() print(SPEED) end",
    );
    let mut running = engine(&old);
    running.tick(0, &mut Robot::default()).unwrap();
    let state = running.state().unwrap();
    let mut robot = Robot::default();
    let mut other = BehaviorEngine::restore(&files(&new), "", BehaviorLimits::default(), &state).unwrap();
    assert_eq!(other.tick(TICK, &mut robot), Ok(BehaviorStatus::Succeeded));
    assert_eq!(robot.events, ["2"]);
    let without = new
        .replace("'NEW', 'A'}", "'NEW'}")
        .replace("start = 'A'", "start = 'NEW'")
        .replace("{'A', 'FINAL'", "{'NEW', 'FINAL'");
    let refused = BehaviorEngine::restore(&files(&without), "", BehaviorLimits::default(), &state);
    let error = refused.unwrap_err().to_string();
    assert_eq!(error, "`state:it/A` is where the mission is, and does not exist any more");
}

#[test]
fn files_are_read_from_a_folder_as_fawkes_has_them() {
    let root = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("behavior-files");
    std::fs::create_dir_all(root.join("skills/robot")).unwrap();
    std::fs::create_dir_all(root.join("skills/generic")).unwrap();
    std::fs::write(root.join("skills/robot/init.lua"), "use_skill('skills.generic.it')").unwrap();
    std::fs::write(
        root.join("skills/generic/it.lua"),
        machine("fsm:define_states{export_to = _M, 'A'}\nx = = 1"),
    )
    .unwrap();
    let open = || SkillFiles::open(&root.join("skills/robot/init.lua")).unwrap();
    let error = BehaviorEngine::load(&open(), "it{}", BehaviorLimits::default()).unwrap_err();
    assert_eq!(error.line(), Some(8));
    let place = root.join("skills/generic/it.lua");
    assert!(error.to_string().starts_with(&format!("{}:8: unexpected symbol", place.display())), "{error}");
    std::fs::write(&place, machine("fsm:define_states{export_to = _M, 'A'}")).unwrap();
    let mut engine = BehaviorEngine::load(&open(), "it{}", BehaviorLimits::default()).unwrap();
    engine.tick(0, &mut Robot::default()).unwrap();
    assert_eq!(engine.active(), "it/A");
}

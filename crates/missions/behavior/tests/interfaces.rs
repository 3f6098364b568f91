//! Interfaces of the blackboard, predicates, configuration and places.

use slate_behavior::{BehaviorEngine, BehaviorLimits, BehaviorProgress, BehaviorStatus, SkillFiles};

use crate::common::{Robot, TICK, run};

const NAMES: &str = "interface{type = 'NavigatorInterface', id = 'Navigator',
        fields = {x = {0.5, unit = 'm'}, visible = {condition = 'ball'}},
        constants = {ERROR_NONE = 0},
        messages = {CartesianGoto = {'x', 'y', 'orientation', action = 'Go', arguments = {'x', 'y'}}, Stop = {stop = true}}}
    configuration{['/speed'] = 0.5}
    places{door = {x = 1, y = 2, color = 'red'}}
    transformation(function(pose, from, to) return {x = pose.x + 1, y = pose.y, ori = 0} end)";

fn load(skill: &str) -> BehaviorEngine {
    let skill = format!(
        "module(..., skillenv.module_init) name = 'it' documentation = ''
         depends_interfaces = {{{{v = 'navigator', type = 'NavigatorInterface', id = 'Navigator'}}}}
         skillenv.skill_module(_M)\n{skill}"
    );
    let predicates = "require('fawkes.predlib') local math = math
        module(..., fawkes.predlib.module_init)
        depends_interfaces = {{v = 'navigator', type = 'NavigatorInterface', id = 'Navigator'}}
        START = navigator:x()
        predparams = {limit = 0.4}
        function far() print('computed') return navigator:x() > predparams.limit end
        function near() return not far end";
    let files = SkillFiles::from_texts(
        "it",
        &[("it", &skill), ("interfaces", NAMES), ("predicates.range", predicates)],
    );
    BehaviorEngine::load(&files, "", BehaviorLimits::default()).unwrap()
}

const GO: &str = "fsm = SkillHSM:new{name = 'it', start = 'A'}
    fsm:define_states{export_to = _M, closure = {navigator = navigator}, 'A'}
    fsm:add_transitions{{'A', 'FAILED', precond = 'not navigator:has_writer()'},
        {'A', 'FAILED', cond = 'navigator:msgid() ~= vars.id'},
        {'A', 'FAILED', cond = 'navigator:is_final() and navigator:error_code() ~= navigator.ERROR_NONE', desc = 'stuck'},
        {'A', 'FINAL', cond = 'navigator:is_final()'}}
    function A:init()
        local message = navigator.CartesianGotoMessage:new(1, 2, 0.5)
        message:set_y(message:y() + 1)
        self.fsm.vars.id = navigator:msgq_enqueue_copy(message)
    end";

#[test]
fn messages_are_actions_of_the_robot() {
    for (progress, status) in [
        (BehaviorProgress::Succeeded, BehaviorStatus::Succeeded),
        (BehaviorProgress::Failed, BehaviorStatus::Failed),
    ] {
        let mut robot = Robot::default();
        let mut engine = load(GO);
        assert_eq!(run(&mut engine, &mut robot, 3), BehaviorStatus::Running);
        assert_eq!(robot.events, ["start Go [1.0, 3.0]"]);
        robot.progress.insert(0, progress);
        assert_eq!(engine.tick(3 * TICK, &mut robot), Ok(status));
    }
}

fn printed(body: &str) -> Vec<String> {
    let mut robot = Robot::default();
    robot.conditions.insert("ball".into(), true);
    load(&format!("{body}\nfunction reset() end")).tick(0, &mut robot).unwrap();
    robot.events
}

#[test]
fn fields_have_values_and_units_or_are_conditions() {
    let body = "function execute() print(navigator:x(), navigator:unit('x'), navigator:is_visible(), navigator:visible())
        print(navigator:id(), navigator:type(), navigator.UNNAMED)
        print(navigator:msgq_enqueue(navigator.BeepMessage:new(1, 2)))
        print(select(2, pcall(function() return navigator:speed() end))) return S_FINAL end";
    let expected = [
        "0.5, m, true, true",
        "Navigator, NavigatorInterface, nil",
        "NavigatorInterface::Navigator received Beep",
        "1",
        "it.lua:7: `NavigatorInterface::Navigator` has no `speed`: name it among the `fields` of interface{...}",
    ];
    assert_eq!(printed(body), expected);
}

#[test]
fn a_message_stops_the_action_of_the_one_before() {
    let body = "function execute()
        navigator:msgq_enqueue(navigator.CartesianGotoMessage:new(1, 2))
        navigator:msgq_enqueue(navigator.StopMessage:new())
        print(navigator:is_final(), navigator:msgid()) return S_FINAL end";
    assert_eq!(printed(body), ["start Go [1.0, 2.0]", "stop 0", "true, 2"]);
}

#[test]
fn predicates_are_computed_once_in_a_tick() {
    let body = "local p = require('predicates.range')
        function execute() print(p.far, p.far, p.near, p.START, predicates.range.far) return S_FINAL end";
    assert_eq!(printed(body), ["computed", "true, true, false, 0.5, true"]);
}

#[test]
fn configuration_places_and_transforms_are_named() {
    let body = "local tf = require('fawkes.tfutils')
        function execute() print(config:get_float('/speed'), config:exists('/x'))
        local node = navgraph:node('door')
        print(node:is_valid(), node:x(), node:has_property('color'), navgraph:node('wall'):is_valid())
        print(tf.transform({x = 1, y = 2, ori = 0}, '/map', '/base_link').x)
        return S_FINAL end";
    assert_eq!(printed(body), ["0.5, false", "true, 1, true, false", "2"]);
}

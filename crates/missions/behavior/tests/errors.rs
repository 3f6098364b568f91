//! Files that are refused.

use slate_behavior::{BehaviorEngine, BehaviorLimits, SkillFiles};

use crate::common::{machine, refusal, skill};

#[test]
fn a_defect_is_named_with_file_and_line() {
    let defects = [
        ("x = = 1", "it.lua:1: unexpected symbol near '='"),
        ("x = nil + 1", "it.lua:1: attempt to perform arithmetic on a nil value"),
        (
            "x = 1",
            "the file has neither a skill nor an agent: name a call of one, such as `moveto{x = 1, y = 2}`",
        ),
    ];
    for (text, expected) in defects {
        assert_eq!(refusal(text), expected);
    }
}

#[test]
fn unknown_states_and_skills_are_refused() {
    let states = "fsm:define_states{export_to = _M, {'A', JumpState}}\n";
    let defects = [
        (
            "fsm:add_transitions{{'A', 'B', cond = true}}",
            "`it`: state `A` leads to `B`, which does not exist",
        ),
        (
            "fsm:add_transitions{{'B', 'A', cond = true}}",
            "`it`: a transition starts at `B`, which does not exist",
        ),
        ("A:add_new_transition('B', true)", "`it`: state `A` leads to `B`, which does not exist"),
        (
            "fsm:add_transitions{{'A', 'A'}}",
            "`it`: the transition from `A` to `A` needs a `cond`, a `precond` or a `timeout`",
        ),
        ("fsm:define_states{{'A', JumpState}}", "`it`: the state `A` exists already"),
        ("fsm:define_states{{'B', Unknown}}", "`it`: the class of state `B` is unknown"),
        (
            "fsm:define_states{{'B', SkillJumpState, skills = {{'fly'}}, final_to = 'A'}}",
            "state `B` runs the skill `fly`, which is unknown: is it in `depends_skills`?",
        ),
        (
            "fsm:add_transitions{{'A', 'A', cond = 'vars.x +'}}",
            "state `A`: condition `vars.x +`:1: unexpected symbol near <eof>",
        ),
    ];
    for (rest, expected) in defects {
        let error = refusal(&machine(&format!("{states}{rest}")));
        assert!(error.ends_with(expected), "{rest}: {error}");
    }
    let error = refusal(&skill("").replace("depends_actions", "depends_skills = {'fly'} depends_actions"));
    assert!(
        error.starts_with("it.lua:5: skill `it` depends on the skill `fly`, which is neither loaded nor"),
        "{error}"
    );
}

#[test]
fn an_interface_without_a_name_says_how_to_name_it() {
    let error = refusal(&skill("").replace(
        "depends_actions",
        "depends_interfaces = {{v = 'n', type = 'T', id = 'I'}} depends_actions",
    ));
    assert_eq!(
        error,
        "it.lua:5: `it` needs the interface `T::I`: name it with interface{type = \"T\", id = \"I\"} in interfaces.lua \
         beside the mission"
    );
}

#[test]
fn skills_that_need_each_other_are_refused() {
    let of = |name: &str, other: &str| {
        format!(
            "module(..., skillenv.module_init) name = '{name}' documentation = '' depends_skills = {{'{other}'}} \
             skillenv.skill_module(_M)"
        )
    };
    let files = SkillFiles::from_texts("a", &[("a", &of("a", "b")), ("b", &of("b", "a"))]);
    let error = BehaviorEngine::load(&files, "", BehaviorLimits::default()).unwrap_err();
    assert_eq!(error.to_string(), "b.lua:1: the skills `b` and `a` depend on each other");
}

#[test]
fn a_call_must_be_one_of_a_skill() {
    let text = machine("fsm:define_states{export_to = _M, {'A', JumpState}}");
    let files = SkillFiles::from_texts("it", &[("it", &text)]);
    let load = |call: &str| BehaviorEngine::load(&files, call, BehaviorLimits::default());
    assert!(load("it{").unwrap_err().to_string().starts_with("call `it{`:1: "));
    let mut engine = load("fly{x = 1}").unwrap();
    let error = engine.tick(0, &mut crate::common::Robot::default()).unwrap_err().to_string();
    assert!(error.contains("attempt to call a nil value (global 'fly')"), "{error}");
}

#[test]
fn a_file_needs_the_ending_of_lua() {
    let error = SkillFiles::open(std::path::Path::new("plan.xml")).unwrap_err().to_string();
    assert_eq!(error, "plan.xml: expected a file whose name ends in `.lua`");
}

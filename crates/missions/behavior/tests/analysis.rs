//! Defects that are found before a mission runs.

use slate_behavior::{MachineFinding, MachineFindingKind, check_machines};

use crate::common::{engine, machine};

fn findings(rest: &str, known: Option<&[String]>) -> Vec<(MachineFindingKind, String)> {
    let engine = engine(&machine(rest));
    let findings = check_machines(engine.machines(), engine.actions(), known);
    findings.into_iter().map(|MachineFinding { kind, text }| (kind, text)).collect()
}

#[test]
fn a_sound_machine_has_no_findings() {
    let rest =
        "fsm:define_states{export_to = _M, {'A', SkillJumpState, skills = {{go}}, final_to = 'FINAL'}}";
    assert_eq!(findings(rest, Some(&["Go".into()])), []);
    let engine = engine(&machine(rest));
    let state = engine.machines()[0].states.iter().find(|state| state.name == "A").unwrap();
    assert_eq!((state.skills.as_slice(), state.transitions.len()), (&["go".to_string()][..], 2));
}

#[test]
fn dead_ends_and_unreachable_states_are_found() {
    let rest = "fsm:define_states{export_to = _M, 'A', 'B', 'C'}
        fsm:add_transitions{{'A', 'B', cond = true}, {'C', 'FINAL', cond = true}, {'B', 'A', precond = 'vars.x'}}";
    let expected = [
        (MachineFindingKind::DeadEnd, "no transition leaves `it/B`".to_string()),
        (MachineFindingKind::UnreachableState, "no transition leads to `it/C`".to_string()),
        (MachineFindingKind::NoEnd, "`it` neither succeeds nor fails".to_string()),
    ];
    assert_eq!(findings(rest, None), expected);
}

#[test]
fn an_action_that_the_robot_lacks_is_found() {
    let rest = "fsm:define_states{export_to = _M, 'A'}\nfsm:add_transitions{{'A', 'FINAL', cond = true}}";
    let expected =
        [(MachineFindingKind::UnknownAction, "`it` performs the action `Go`, which is unknown".to_string())];
    assert_eq!(findings(rest, Some(&["Fly".into()])), expected);
}

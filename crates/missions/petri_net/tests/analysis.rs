//! Checks of nets.

use slate_petri_net::{CheckLimits, FindingKind, NetBuilder, NetReport, PetriNet, check_net, state_space};

use crate::common::net;

fn check(net: &PetriNet) -> NetReport {
    check_net(net, &CheckLimits::default())
}

fn found(report: &NetReport, kind: FindingKind) -> Option<(&str, Option<Vec<usize>>)> {
    let finding = report.findings.iter().find(|finding| finding.kind == kind)?;
    Some((&finding.text, finding.path.as_ref().map(|path| path.transitions.clone())))
}

#[test]
fn a_sound_plan_has_no_finding() {
    let net = net(
        "sound",
        &[("start", 1), ("a.exec", 0), ("b.exec", 0), ("goal", 0)],
        &[("*.start", &[0], &[1, 2]), ("*.end", &[1, 2], &[3])],
    );
    let report = check(&net);
    assert!(report.is_sound() && report.findings.is_empty(), "{report:?}");
    assert_eq!(report.states, 3);
}

#[test]
fn a_place_that_grows_is_found_with_the_loop_that_fills_it() {
    let net = net(
        "grows",
        &[("start", 1), ("run", 0), ("pile", 0), ("goal", 0)],
        &[("", &[0], &[1]), ("[more]", &[1], &[1, 2]), ("[done]", &[1], &[3])],
    );
    let report = check(&net);
    let expected = ("the tokens of pile grow without bound", Some(vec![0, 1]));
    assert_eq!(found(&report, FindingKind::Unbounded), Some(expected));
    assert_eq!(report.findings[0].path.as_ref().unwrap().repeated, Some(1));
    assert!(!report.is_sound());
}

#[test]
fn counting_up_to_a_goal_is_not_growth() {
    let net = net("count", &[("run", 1), ("goal(3)", 0)], &[("[lap]", &[0], &[0, 1])]);
    let report = check(&net);
    assert!(report.is_sound(), "{report:?}");
    assert_eq!(report.states, 4);
}

#[test]
fn a_deadlock_has_the_shortest_way_to_it() {
    let net = net(
        "stuck",
        &[("start", 1), ("a", 0), ("b", 0), ("goal", 0), ("key", 0)],
        &[
            ("[long]", &[0], &[1]),
            ("[longer]", &[1], &[2]),
            ("[short]", &[0], &[2]),
            ("open", &[2, 4], &[3]),
            ("[lucky]", &[1], &[3]),
        ],
    );
    let report = check(&net);
    assert_eq!(
        found(&report, FindingKind::Deadlock),
        Some(("no transition is enabled in the marking b", Some(vec![2])))
    );
    let dead = "transition t4 (open) never has the tokens of b, key";
    assert_eq!(found(&report, FindingKind::DeadTransition), Some((dead, None)));
    assert_eq!(found(&report, FindingKind::UnreachableGoal), None);
}

#[test]
fn unreachable_goal_differs_from_goal_without_arcs() {
    let apart = net(
        "apart",
        &[("P", 1), ("goal", 0), ("goal", 0)],
        &[("[a]", &[0], &[1]), ("[b]", &[0], &[2]), ("", &[1], &[0]), ("", &[2], &[0])],
    );
    let report = check(&apart);
    let text = "no marking that can be reached has exactly 1 in `goal` and 1 in `goal` tokens";
    assert_eq!(found(&report, FindingKind::UnreachableGoal), Some((text, None)));
    let endless = net("endless", &[("P", 1), ("goal", 0)], &[("[a]", &[0], &[0])]);
    let report = check(&endless);
    assert!(report.is_sound() && found(&report, FindingKind::NoGoal).is_some(), "{report:?}");
}

#[test]
fn two_tokens_in_a_place_are_found_with_the_way_to_them() {
    let net = net(
        "double",
        &[("a", 1), ("b", 1), ("c", 0), ("goal", 0)],
        &[("[x]", &[0], &[2]), ("[y]", &[1], &[2]), ("z", &[2, 2], &[3])],
    );
    let report = check(&net);
    let unsafe_place = found(&report, FindingKind::Unsafe);
    assert_eq!(unsafe_place, Some(("place `c` can have 2 tokens", Some(vec![0, 1]))));
}

#[test]
fn unknown_actions_and_labels_without_effect_are_found() {
    let net = net(
        "words",
        &[("start", 1), ("goto_1.exec", 0), ("wave.exce", 0), ("goal", 0)],
        &[("goto_1.start", &[0], &[1]), ("goto_1.stop [x]", &[1], &[2]), ("[y]", &[2], &[3])],
    );
    let is_known = |name: &str| name == "wave";
    let limits = CheckLimits { is_known_action: Some(&is_known), ..CheckLimits::default() };
    let report = check_net(&net, &limits);
    let text = "the robot has no action `goto`, which the plan calls `goto_1`";
    assert_eq!(found(&report, FindingKind::UnknownAction), Some((text, None)));
    let labels: Vec<&str> = report
        .findings
        .iter()
        .filter(|finding| finding.kind == FindingKind::UnknownLabel)
        .map(|finding| finding.text.split(':').next().unwrap())
        .collect();
    let expected =
        ["`goto_1.stop` of transition t2 (goto_1.stop [x])", "place p3 `wave.exce` runs no action"];
    assert_eq!(labels, expected);
}

#[test]
fn a_transition_that_never_wins_is_found() {
    let net = net("loses", &[("P", 1), ("goal", 0)], &[("", &[0], &[1]), ("[x]", &[0], &[0])]);
    let text = "transition t2 ([x]) loses its tokens to t1, which has no guard and stands before it";
    assert_eq!(found(&check(&net), FindingKind::Conflict), Some((text, None)));
}

#[test]
fn a_check_that_gives_up_says_so() {
    let mut builder = NetBuilder::new("many");
    for _ in 0..20 {
        let (one, other) = (builder.place("", 1), builder.place("", 0));
        builder.transition("[a]", &[(one, 1)], &[(other, 1)]);
        builder.transition("[b]", &[(other, 1)], &[(one, 1)]);
    }
    let net = builder.finish().unwrap();
    let report = check_net(&net, &CheckLimits { most_states: 1000, ..CheckLimits::default() });
    assert!(!report.is_sound() && !report.is_complete);
    let (text, _) = found(&report, FindingKind::Unfinished).unwrap();
    assert!(text.contains("more than 1000 markings"), "{text}");
    assert_eq!(found(&report, FindingKind::DeadTransition), None);
}

#[test]
fn a_state_space_has_all_markings_and_firings() {
    let net = net("cycle", &[("a", 2), ("b", 0)], &[("", &[0], &[1]), ("", &[1], &[0])]);
    let space = state_space(&net, 100, false);
    let markings: Vec<&[u32]> = (0..space.states()).map(|state| space.marking(state)).collect();
    assert_eq!(markings, [[2, 0], [1, 1], [0, 2]]);
    assert_eq!(space.edges(), [(0, 0, 1), (1, 0, 2), (1, 1, 0), (2, 1, 1)]);
    assert!(space.is_complete());
}

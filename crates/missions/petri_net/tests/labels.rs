//! Labels and guards.

use slate_petri_net::{ActionEvent, ActionQuery, NetBuilder, NetGuard, PetriNet};

use crate::common::net;

fn guarded(guard: &str) -> Result<PetriNet, String> {
    let mut net = NetBuilder::new("guarded");
    let place = net.place("go_1.exec", 1);
    net.transition(&format!("go_1.end [{guard}]"), &[(place, 1)], &[]);
    net.finish().map_err(|error| error.to_string())
}

/// Value of a guard for the conditions that hold, and those that are false.
fn value(guard: &str, holds: &[&str], fails: &[&str]) -> Option<bool> {
    let net = guarded(guard).unwrap();
    net.transitions()[0].guard.as_ref().unwrap().evaluate(&mut |atom| match atom {
        NetGuard::Condition(index) => {
            let name = net.conditions()[*index].as_str();
            if holds.contains(&name) { Some(true) } else { fails.contains(&name).then_some(false) }
        }
        _ => None,
    })
}

#[test]
fn places_have_actions_goals_and_failures_by_their_labels() {
    let labels = [
        ("goto_6_2_0.exec", Some("goto_6_2_0"), None, None),
        ("turn_-1.5.ex", Some("turn_-1.5"), None, None),
        ("ex.home", Some("home"), None, None),
        ("ex.home.goal(2)", Some("home"), Some(2), None),
        ("goal", None, Some(1), None),
        ("goal(3)", None, Some(3), None),
        ("fail(0)", None, None, Some(0)),
        ("goalkeeper", None, None, None),
        ("init", None, None, None),
        (" ", None, None, None),
        ("ex.exec", Some("ex"), None, None),
    ];
    for (label, action, goal, fail) in labels {
        let net = net("labels", &[(label, 0)], &[]);
        let place = &net.places()[0];
        assert_eq!(place.action.map(|action| net.actions()[action].as_str()), action, "{label}");
        assert_eq!((place.goal, place.fail), (goal, fail), "{label}");
    }
}

#[test]
fn a_star_stands_for_the_actions_before_or_after() {
    let net = net(
        "star",
        &[("a.exec", 1), ("b.exec", 1), ("c.exec", 0), ("P", 0)],
        &[("*.end *.start", &[0, 1], &[2, 3]), ("*.interr c.res", &[0, 1], &[2])],
    );
    let events = |transition: usize| -> Vec<(&str, ActionEvent)> {
        let events = net.transitions()[transition].events.iter();
        events.map(|(action, event)| (net.actions()[*action].as_str(), *event)).collect()
    };
    use ActionEvent::{End, Interrupt, Resume, Start};
    assert_eq!(events(0), [("a", End), ("b", End), ("c", Start)]);
    assert_eq!(events(1), [("a", Interrupt), ("b", Interrupt), ("c", Resume)]);
    let finished = |action| NetGuard::Action(action, ActionQuery::Finished);
    assert_eq!(net.transitions()[0].guard, Some(NetGuard::And(vec![finished(0), finished(1)])));
    assert_eq!(net.transitions()[1].guard, None);
}

#[test]
fn guards_are_expressions_with_the_operator_first() {
    assert_eq!(value("person", &["person"], &[]), Some(true));
    assert_eq!(value("not person", &["person"], &[]), Some(false));
    assert_eq!(value("and a b c", &["a", "b"], &["c"]), Some(false));
    assert_eq!(value("or a (and b (not c))", &["b"], &["a", "c"]), Some(true));
    assert_eq!(value(" ( or ( not a ) b ) ", &["a"], &["b"]), Some(false));
}

#[test]
fn an_unknown_condition_satisfies_no_guard() {
    assert_eq!(value("not a", &[], &[]), None);
    assert_eq!(value("or a b", &["b"], &[]), Some(true));
    assert_eq!(value("and a b", &[], &["b"]), Some(false));
    assert_eq!(value("and a b", &["b"], &[]), None);
}

#[test]
fn a_wrong_guard_is_refused_with_what_was_expected() {
    let error = |guard: &str| guarded(guard).unwrap_err();
    assert_eq!(error("(a"), "transition `t1`: expected `)`, found the end of the guard");
    assert!(error("a and b").contains("found `and`; operators stand before their operands"));
    assert!(error("and").contains("expected a condition, found the end of the guard"));
    assert!(error("come.finished").contains("the guard names the action `come`"));
    assert!(error(&"(".repeat(500)).contains("at most 64 levels"));
    assert!(error("a] [b").contains("at most one guard"));
    assert_eq!(guarded("go_1.failed").unwrap().conditions().len(), 0);
    assert_eq!(guarded("room.2").unwrap().conditions(), ["room.2"]);
}

//! Refused theories, with their places.

use slate_golog::*;

fn refused(text: &str) -> String {
    ActionTheory::parse(text).unwrap_err().to_string()
}

#[test]
fn an_error_shows_line_caret_and_help() {
    let text = "domain place = kitchen, hall\nfluent at: place = hall\nprocedure main { test att == hall }\n";
    let error = ActionTheory::parse(text).unwrap_err().of_file("tidy.golog".as_ref());
    let line = "tidy.golog:3:23: unknown fluent or value `att`; did you mean `at`?";
    assert_eq!(error.to_string(), line);
    let shown = "tidy.golog:3:23: unknown fluent or value `att`
    3 | procedure main { test att == hall }
      |                       ^^^
      = did you mean `at`?";
    assert_eq!(error.render(), shown);
}

#[test]
fn a_cycle_of_defined_fluents_is_named_by_its_path() {
    let text = "define a = b\ndefine b = not c\ndefine c = a or b\nprocedure main { test a }";
    let said = "line 1, column 8: defined fluents depend on each other: a -> b -> c -> a; make one of them a fluent \
                that actions change";
    assert_eq!(refused(text), said);
}

#[test]
fn recursion_before_any_step_is_refused() {
    let text = "action go\nprocedure main { nil | again }\nprocedure again { { main || go }; go }";
    let said = "line 2, column 11: the procedure calls itself before any step: main -> again -> main; put an action \
                or a test before the call";
    assert_eq!(refused(text), said);
    assert!(ActionTheory::parse("action go procedure main { go; main }").is_ok());
}

#[test]
fn endless_recursion_ends_with_words() {
    let text = "action go(n: 0..9) procedure main { dig(1) }\nprocedure dig(n: 0..9) { dig(n); go(n) }";
    let theory = ActionTheory::parse(text).unwrap();
    let limits = SolutionLimits { most_depth: 9, most_transitions: 99 };
    let error = solutions(&theory, &limits, |_| true).unwrap_err();
    assert_eq!(error.to_string(), "line 2: programs nest deeper than 400: check the recursion of procedures");
}

#[test]
fn types_arity_and_unknown_names_are_refused() {
    let head = "domain place = hall, attic domain tool = saw fluent at: place = hall fluent n: 0..3 = 0 \
                condition wet action go(p: place) at becomes p exogenous bell ";
    let cases = [
        ("procedure main { go }", "expected 1 arguments of `go`, found 0"),
        ("procedure main { go(saw) }", "expected a value of `place`, found a value of `tool`"),
        ("procedure main { walk(hall) }", "unknown action or procedure `walk`"),
        ("procedure main { goo(hall) }", "did you mean `go`?"),
        ("procedure main { wet }", "`test wet` waits until it holds"),
        ("procedure main { bell }", "found `bell`, an exogenous action"),
        ("procedure main { test n == 9 + saw }", "expected a number, found a value of `tool`"),
        ("procedure main { test at = hall }", "`==` compares"),
        ("procedure main { test n }", "expected true or false, found a number"),
        ("procedure main { go(hall) go(attic) }", "expected `;`, `|`, `||`, `>>` or `}`, found `go`"),
        ("procedure main { pick at: place { nil } }", "the name `at` is taken: it is a fluent"),
        ("procedure help { nil }", "expected `procedure main { ... }` without arguments"),
        ("action dry wet becomes false procedure main { nil }", "a condition that the robot reports"),
        ("action set n becomes 7 procedure main { nil }", "expected a value of 0..3, found 7"),
        ("fluent at procedure main { nil }", "the name `at` is taken: it is a fluent"),
        ("table x(place) = hall: 1.5 procedure main { nil }", "expected 2 entries of the table `x`"),
        ("procedure main { test 1 < 2.5 }", "expected a whole number, found 2.5"),
        ("procedure main { ", "found the end of the file"),
        ("procedure main { test 12x == 1 }", "expected a number such as `12` or `1.5`, found `12x`"),
        ("action see senses n procedure main { see }", "expected a fluent that is true or false"),
    ];
    for (text, expected) in cases {
        let said = refused(&format!("{head}{text}"));
        assert!(said.contains(expected), "{text}: {said}");
    }
}

#[test]
fn large_formulas_and_deep_texts_are_refused() {
    let text = "domain d = 1..1000 define a(x: d) = exists y: d (x == y)
        procedure main { test all x: d (all y: d (a(x))) }";
    assert!(refused(text).contains("visit at most 200000 parts"));
    let deep = format!("procedure main {}", "{".repeat(100));
    assert!(refused(&deep).contains("at most 64 nested parts"));
    let deep = format!("procedure main {{ test {}true }}", "not ".repeat(100));
    assert!(refused(&deep).contains("at most 64 nested parts"));
    assert!(refused("domain d = 0..2000000000 procedure main { nil }").contains("at most 1000 values"));
}

#[test]
fn a_value_out_of_range_stops_with_the_action() {
    let text = "fluent n: 0..1 = 0 action up n becomes n + 1 procedure main { up; up }";
    let theory = ActionTheory::parse(text).unwrap();
    let limits = SolutionLimits { most_depth: 9, most_transitions: 99 };
    let said = solutions(&theory, &limits, |_| true).unwrap_err().to_string();
    assert_eq!(said, "line 1: action `up`: expected a value of 0..1 for `n`, found 2; add a precondition");
}

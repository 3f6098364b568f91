//! Offline execution: constructs of Golog and ConGolog.

use crate::common::all;

/// Actions `a`, `b` and `c`, and a counter with its own.
const LETTERS: &str = "
domain letter = x, y, z
fluent n: 0..3 = 0
fluent seen
fluent marked(letter) = false
action a action b action c
action up possible if n < 3 n becomes n + 1
action mark(l: letter) possible if not marked(l) marked(l) becomes true
action look senses seen
";

fn of(program: &str) -> Vec<String> {
    all(&format!("{LETTERS} {program}"))
}

fn of_main(program: &str) -> Vec<String> {
    of(&format!("procedure main {{ {program} }}"))
}

#[test]
fn choices_come_in_the_order_of_the_text() {
    assert_eq!(of_main("a; b | c; a"), ["a b a", "a c a"]);
    assert_eq!(of_main("pick l: letter { mark(l) }; mark(y)"), ["mark(x) mark(y)", "mark(z) mark(y)"]);
    assert_eq!(of_main("nil | a"), ["", "a"]);
}

#[test]
fn a_test_and_a_first_step_are_one_transition() {
    assert_eq!(of_main("if n == 0 { up } else { a }"), ["up"]);
    assert_eq!(of_main("while n < 2 { up }; a"), ["up up a"]);
    assert_eq!(of_main("{ if n == 0 { a } || up }"), ["a up", "up"], "the test is not kept from before");
}

#[test]
fn repetition_tries_fewer_rounds_first() {
    assert_eq!(of_main("repeat { up }; test n == 2; c"), ["up up c"]);
    assert_eq!(of_main("repeat { up }")[..], ["", "up", "up up", "up up up"]);
}

#[test]
fn a_loop_over_a_domain_takes_each_value() {
    assert_eq!(of_main("for l: letter { mark(l) }"), ["mark(x) mark(y) mark(z)"]);
    assert_eq!(of_main("mark(y); for l: letter { if not marked(l) { mark(l) } }").len(), 1);
}

#[test]
fn concurrent_programs_interleave_with_the_left_first() {
    assert_eq!(of_main("a; b || c").len(), 2, "`||` binds tighter than `;`");
    assert_eq!(of_main("{ a; b } || c"), ["a b c", "a c b", "c a b"]);
    assert_eq!(of_main("parallel repeat { a }")[..3], ["", "a", "a a"]);
}

#[test]
fn the_lower_priority_goes_on_while_the_higher_is_blocked() {
    assert_eq!(of_main("{ test n == 1; a } >> { up; b }"), ["up a b"]);
    assert_eq!(of_main("{ interrupt n == 1 { a; up } } >> { up; b }"), ["up a up b"]);
}

#[test]
fn procedures_take_arguments_and_recur() {
    let program = "procedure climb(k: 0..3) { if k > 0 { up; climb(k - 1) } } procedure main { climb(2); a }";
    assert_eq!(of(program), ["up up a"]);
    let program = "procedure some { nil | { a; some } } procedure main { some; b }";
    let found = of(program);
    assert_eq!(found[found.len() - 3..], ["a a b", "a b", "b"]);
}

#[test]
fn sensed_fluents_are_unknown_in_search() {
    assert!(of_main("look; if seen { a } else { b }").is_empty());
    assert_eq!(of_main("look; if known seen { a } else { b }"), ["look b"]);
    assert_eq!(of_main("if seen or n == 0 { a }"), ["a"]);
    assert!(of_main("test seen or not seen; a").is_empty(), "it is unknown before, too");
}

#[test]
fn effects_see_the_situation_before_the_action() {
    let text = "fluent p = true fluent q = false fluent r = false
        action swap p becomes q q becomes p r becomes true if p r becomes false
        action d possible if q and not p and r
        procedure main { swap; d }";
    assert_eq!(all(text), ["swap d"]);
    let text =
        "domain cell = 0..2 fluent f(cell) = true action clear all c: cell: f(c) becomes false if c < 2
        action d possible if f(2) and not exists c: 0..1 (f(c)) procedure main { clear; d }";
    assert_eq!(all(text), ["clear d"]);
}

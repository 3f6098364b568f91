//! Control nodes.

use crate::common::trace;

#[test]
fn a_sequence_goes_on_where_it_was() {
    let answers = [("P", "S"), ("A", "RS"), ("B", "F")];
    let found = trace("<Sequence><P/><A/><B/></Sequence>", &answers, 3);
    assert_eq!(found, ["ask P, start A: Running", "go on A, start B: Failed", "ask P, start A: Running"]);
}

#[test]
fn a_sequence_with_memory_keeps_what_has_succeeded() {
    let node = "<RetryUntilSuccessful num_attempts=\"2\"><SequenceWithMemory><A/><B/></SequenceWithMemory>\
                </RetryUntilSuccessful>";
    let found = trace(node, &[("A", "S"), ("B", "FS")], 2);
    assert_eq!(found, ["start A: Running", "start B, start B: Succeeded"]);
}

#[test]
fn reactive_sequence_ticks_again_and_halts() {
    let answers = [("P", "SSF"), ("A", "R")];
    let found = trace("<ReactiveSequence><P/><A/></ReactiveSequence>", &answers, 3);
    assert_eq!(found, ["ask P, start A: Running", "ask P, go on A: Running", "ask P, halt A: Failed"]);
}

#[test]
fn a_reactive_fallback_prefers_the_first() {
    let answers = [("A", "FR"), ("B", "R")];
    let found = trace("<ReactiveFallback><A/><B/></ReactiveFallback>", &answers, 2);
    assert_eq!(found, ["start A, start B: Running", "start A, halt B: Running"]);
}

#[test]
fn a_fallback_tries_the_next_after_a_failure() {
    let found = trace("<Fallback><A/><B/></Fallback>", &[("A", "RF"), ("B", "RS")], 3);
    assert_eq!(found, ["start A: Running", "go on A, start B: Running", "go on B: Succeeded"]);
}

#[test]
fn a_parallel_ends_with_enough_successes_or_failures() {
    let node = "<Parallel success_count=\"2\" failure_count=\"2\"><A/><B/><C/></Parallel>";
    let found = trace(node, &[("A", "S"), ("B", "RS"), ("C", "R")], 2);
    assert_eq!(found, ["start A, start B, start C: Running", "go on B, halt C: Succeeded"]);
    let found = trace(node, &[("A", "F"), ("B", "RF"), ("C", "R")], 2);
    assert_eq!(found, ["start A, start B, start C: Running", "go on B, halt C: Failed"]);
    let found = trace("<Parallel success_count=\"-2\"><A/><B/></Parallel>", &[("A", "R"), ("B", "S")], 1);
    assert_eq!(found, ["start A, start B, halt A: Succeeded"]);
}

#[test]
fn a_parallel_all_waits_for_every_child() {
    let found =
        trace("<ParallelAll max_failures=\"1\"><A/><B/></ParallelAll>", &[("A", "F"), ("B", "RS")], 2);
    assert_eq!(found, ["start A, start B: Running", "go on B: Failed"]);
    let found =
        trace("<ParallelAll max_failures=\"2\"><A/><B/></ParallelAll>", &[("A", "F"), ("B", "RS")], 2);
    assert_eq!(found[1], "go on B: Succeeded");
}

#[test]
fn if_then_else_checks_once_and_while_do_else_each_tick() {
    let answers = [("P", "SFF"), ("A", "R"), ("B", "R")];
    let found = trace("<IfThenElse><P/><A/><B/></IfThenElse>", &answers, 2);
    assert_eq!(found, ["ask P, start A: Running", "go on A: Running"]);
    let found = trace("<WhileDoElse><P/><A/><B/></WhileDoElse>", &answers, 3);
    assert_eq!(
        found,
        ["ask P, start A: Running", "ask P, halt A, start B: Running", "ask P, go on B: Running"]
    );
}

#[test]
fn a_skipped_condition_skips_if_and_while() {
    for tag in ["IfThenElse", "WhileDoElse"] {
        let node = format!("<Sequence><{tag}><P/><A/></{tag}><B/></Sequence>");
        assert_eq!(trace(&node, &[("P", "K"), ("B", "S")], 1), ["ask P, start B: Succeeded"]);
    }
}

#[test]
fn a_switch_halts_the_case_that_no_longer_holds() {
    let node = "<ReactiveSequence>\
                  <Script code=\"n := 3; n = n - 1\" _skipIf=\"false\"/>\
                  <Switch2 variable=\"{n}\" case_1=\"1\" case_2=\"2\"><A/><B/><C/></Switch2>\
                </ReactiveSequence>";
    assert_eq!(trace(node, &[], 2), ["start B: Running", "go on B: Running"]);
    let node = "<ReactiveSequence>\
                  <RunOnce><Script code=\"n := 0\"/></RunOnce><Script code=\"n += 1\"/>\
                  <Switch2 variable=\"{n}\" case_1=\"1\" case_2=\"2\"><A/><B/><C/></Switch2>\
                </ReactiveSequence>";
    assert_eq!(
        trace(node, &[], 3),
        ["start A: Running", "halt A, start B: Running", "halt B, start C: Running"]
    );
}

#[test]
fn a_node_is_skipped_when_all_children_are() {
    let node = "<Fallback><Sequence><A _skipIf=\"true\"/><B _skipIf=\"true\"/></Sequence><C/></Fallback>";
    assert_eq!(trace(node, &[("C", "S")], 1), ["start C: Succeeded"]);
    assert_eq!(trace("<Sequence><A _skipIf=\"true\"/></Sequence>", &[], 1), [": Skipped"]);
}

#[test]
fn a_completed_tree_begins_anew() {
    assert_eq!(
        trace("<A/>", &[("A", "RS")], 3),
        ["start A: Running", "go on A: Succeeded", "start A: Running"]
    );
}

#[test]
fn the_last_child_is_ticked_when_another_has_failed() {
    let node = "<TryCatch><A/><B/><C/></TryCatch>";
    let answers = |b| [("A", "S"), ("B", b), ("C", "RS")];
    assert_eq!(trace(node, &answers("RS"), 2), ["start A, start B: Running", "go on B: Succeeded"]);
    assert_eq!(trace(node, &answers("F"), 2), ["start A, start B, start C: Running", "go on C: Failed"]);
    let skipped = "<TryCatch><A _skipIf=\"true\"/><B/></TryCatch>";
    assert_eq!(trace(skipped, &[], 1), [": Skipped"]);
}

#[test]
fn a_halt_is_caught_where_that_is_wanted() {
    for (port, expected) in [
        ("", "ask P, halt A: Succeeded"),
        ("catch_on_halt=\"true\"", "ask P, halt A, start B, halt B: Succeeded"),
    ] {
        let node = format!("<ReactiveFallback><P/><TryCatch {port}><A/><B/></TryCatch></ReactiveFallback>");
        assert_eq!(trace(&node, &[("P", "FS")], 2), ["ask P, start A: Running", expected]);
    }
}

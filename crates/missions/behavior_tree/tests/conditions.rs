//! Conditions before a node and scripts after it.

use slate_behavior_tree::{BoardValue, NodeStatus, TreeExecutor};

use crate::common::{Answers, step, trace, tree};

#[test]
fn conditions_before_a_node_end_it_in_their_order() {
    for (attributes, expected) in [
        ("_failureIf=\"true\" _successIf=\"true\"", ": Failed"),
        ("_successIf=\"true\" _skipIf=\"true\"", ": Succeeded"),
        ("_skipIf=\"true\"", ": Skipped"),
        ("_while=\"false\"", ": Skipped"),
        ("_while=\"true\" _failureIf=\"1 > 2\"", "start A: Running"),
    ] {
        assert_eq!(trace(&format!("<A {attributes}/>"), &[], 1), [expected], "{attributes}");
    }
}

#[test]
fn a_node_that_runs_is_halted_when_its_while_ends() {
    let mut executor = TreeExecutor::new(tree("<Sequence><A _while=\"go\" _skipIf=\"!go\"/><B/></Sequence>"));
    let mut host = Answers::default();
    assert!(executor.set_entry("go", BoardValue::Number(1.0)));
    assert_eq!(step(&mut executor, &mut host, 0), "start A: Running");
    executor.set_entry("go", BoardValue::Number(0.0));
    assert_eq!(step(&mut executor, &mut host, 1), "halt A, start B: Running");
}

#[test]
fn scripts_after_a_node_follow_its_status() {
    let node = "<Sequence _onHalted=\"log = log .. 'h'\">\
                  <A _onSuccess=\"log = log .. 's'\" _onFailure=\"log = log .. 'f'\" _post=\"log = log .. 'p'\"/>\
                </Sequence>";
    let mut executor = TreeExecutor::new(tree(node));
    executor.set_entry("log", BoardValue::Text(String::new()));
    let mut host = Answers::new(&[("A", "SFR")]);
    for tick in 0..3 {
        step(&mut executor, &mut host, tick);
    }
    assert_eq!(executor.entry("log"), Some(&BoardValue::Text("spfp".into())));
    executor.halt(0, &mut host).unwrap();
    assert_eq!(host.orders(), "halt A");
    assert_eq!(executor.entry("log"), Some(&BoardValue::Text("spfph".into())));
    assert!((0..2).all(|node| executor.status(node) == NodeStatus::Idle));
}

#[test]
fn an_error_of_a_tick_halts_the_tree() {
    let node = "<Parallel><A/><Script code=\"x := 1 / n\" name=\"divide\"/></Parallel>";
    let mut executor = TreeExecutor::new(tree(node));
    let mut host = Answers::default();
    let error = executor.tick(0, &mut host).unwrap_err();
    assert!(error.reason.contains("the entry `n` has no value yet"), "{error}");
    assert!(error.to_string().starts_with("node `main/2 divide` (line 3): script `x := 1 / n`: "), "{error}");
    assert_eq!(host.orders(), "start A, halt A");
    executor.set_entry("n", BoardValue::Number(0.0));
    let error = executor.tick(0, &mut host).unwrap_err();
    assert!(error.reason.contains("check for a division by zero"), "{error}");
    let mut host = Answers::new(&[("A", "I")]);
    let error = executor.tick(0, &mut host).unwrap_err();
    assert!(error.reason.contains("expected an answer of the host"), "{error}");
}

#[test]
fn ports_that_change_are_checked_in_each_tick() {
    for (node, expected) in [
        (
            "<Repeat num_cycles=\"{n}\"><A/></Repeat>",
            "expected an integer in the port `num_cycles`, found `1.5`",
        ),
        ("<Parallel success_count=\"{m}\"><A/></Parallel>", "expected at most the number of children, 1, in"),
        ("<Sleep msec=\"{negative}\"/>", "expected no negative number in the port `msec`, found -4"),
        ("<Timeout msec=\"{none}\"><A/></Timeout>", "expected an integer in the port `msec`, found none"),
    ] {
        let mut executor = TreeExecutor::new(tree(node));
        for (name, number) in [("n", 1.5), ("m", 2.0), ("negative", -4.0)] {
            executor.set_entry(name, BoardValue::Number(number));
        }
        let error = executor.tick(0, &mut Answers::default()).unwrap_err();
        assert!(error.reason.contains(expected), "{error}");
    }
}

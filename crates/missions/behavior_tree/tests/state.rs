//! States of runs: saved, restored, and carried into a changed tree.

use proptest::prelude::*;
use slate_behavior_tree::{BoardValue, NodeStatus, TreeExecutor, TreeState};

use crate::common::{Answers, step, tree};

const NODE: &str = "<Sequence name=\"round\">\
      <RunOnce><Script code=\"n := 0; log := ''\"/></RunOnce>\
      <Parallel success_count=\"2\" failure_count=\"2\">\
        <Timeout msec=\"350\"><A/></Timeout>\
        <SequenceWithMemory><B/><Delay delay_msec=\"250\"><C _onHalted=\"log = log .. 'h'\"/></Delay></SequenceWithMemory>\
        <ReactiveFallback><P/><RetryUntilSuccessful num_attempts=\"3\"><D/></RetryUntilSuccessful></ReactiveFallback>\
      </Parallel>\
      <Switch2 variable=\"{n}\" case_1=\"1\" case_2=\"3\"><A/><WhileDoElse><Q/><B/><C/></WhileDoElse>\
        <Repeat num_cycles=\"2\"><Sleep msec=\"100\" _post=\"n += 1\"/></Repeat></Switch2>\
      <Precondition if=\"n > 2\" else=\"SKIPPED\"><IfThenElse><P/><A/><D/></IfThenElse></Precondition>\
    </Sequence>";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_restored_run_goes_on_as_the_saved_one(
        letters in prop::collection::vec("[RRSF]{1,6}", 6),
        at in 0u64..40,
    ) {
        let answers: Vec<(&str, &str)> =
            ["A", "B", "C", "D", "P", "Q"].into_iter().zip(letters.iter().map(String::as_str)).collect();
        let mut executor = TreeExecutor::new(tree(NODE));
        let mut host = Answers::new(&answers);
        for tick in 0..at {
            step(&mut executor, &mut host, tick);
        }
        let text = serde_json::to_string(&executor.state()).unwrap();
        let state: TreeState = serde_json::from_str(&text).unwrap();
        let mut restored = TreeExecutor::restore(tree(NODE), &state).unwrap();
        let mut other = host.clone();
        for tick in at..at + 25 {
            prop_assert_eq!(step(&mut executor, &mut host, tick), step(&mut restored, &mut other, tick));
            prop_assert_eq!(executor.state(), restored.state());
        }
    }
}

#[test]
fn an_empty_state_is_the_start() {
    let mut executor = TreeExecutor::restore(tree("<A/>"), &TreeState::default()).unwrap();
    assert_eq!(step(&mut executor, &mut Answers::default(), 0), "start A: Running");
}

#[test]
fn a_changed_tree_takes_over_what_runs() {
    let mut executor = TreeExecutor::new(tree("<Sequence><Script code=\"n := 4\"/><A/></Sequence>"));
    let mut host = Answers::new(&[("A", "RS")]);
    step(&mut executor, &mut host, 0);
    executor.reload(tree("<Sequence><AlwaysSuccess/><A/><B n=\"{n}\"/></Sequence>")).unwrap();
    assert_eq!(step(&mut executor, &mut host, 1), "go on A, start B n=4: Running");
}

#[test]
fn a_tree_without_a_running_node_is_refused() {
    let mut executor = TreeExecutor::new(tree("<Sequence><A/></Sequence>"));
    let mut host = Answers::new(&[("A", "RS")]);
    step(&mut executor, &mut host, 0);
    let error = executor.reload(tree("<Sequence><B/></Sequence>")).unwrap_err().to_string();
    assert!(error.contains("the node `main/1 A` (`A`) runs, and is missing"), "{error}");
    assert_eq!(executor.tick(1, &mut host), Ok(NodeStatus::Succeeded));
}

#[test]
fn a_node_above_a_running_one_can_not_be_inserted() {
    let refused = |old: &str, new: &str| {
        let mut executor = TreeExecutor::new(tree(old));
        let mut host = Answers::new(&[("A", "RS"), ("P", "S"), ("Q", "S")]);
        step(&mut executor, &mut host, 0);
        let error = executor.reload(tree(new)).unwrap_err().to_string();
        assert_eq!(executor.tick(1, &mut host), Ok(NodeStatus::Succeeded), "the old tree goes on");
        error
    };
    let error =
        refused("<Sequence><P/><A/></Sequence>", "<Sequence><ForceSuccess><A/></ForceSuccess></Sequence>");
    assert!(error.contains("`main/2 A` runs, and `main/1 ForceSuccess` above it doesn't"), "{error}");
    let error = refused(
        "<Sequence><Inverter><Inverter><P/></Inverter></Inverter><A/></Sequence>",
        "<Sequence><P/><Q/><P/><A/></Sequence>",
    );
    assert!(error.contains("`main/4 A` runs, and `main/0 Sequence` is at another child"), "{error}");
}

#[test]
fn a_parallel_counts_the_children_it_still_has() {
    let mut executor = TreeExecutor::new(tree("<Parallel success_count=\"2\"><A/><B/><C/></Parallel>"));
    let mut host = Answers::new(&[("A", "S"), ("B", "RS"), ("C", "R"), ("D", "R")]);
    step(&mut executor, &mut host, 0);
    executor.reload(tree("<Parallel success_count=\"2\"><D/><B/><C/></Parallel>")).unwrap();
    assert_eq!(step(&mut executor, &mut host, 1), "start D, go on B, go on C: Running");
}

#[test]
fn an_action_is_halted_when_its_repetitions_become_fewer() {
    let node = "<Sequence><Script code=\"n := 2\" _skipIf=\"true\"/><Repeat num_cycles=\"{n}\"><A/></Repeat><B/></Sequence>";
    let mut executor = TreeExecutor::new(tree(node));
    executor.set_entry("n", BoardValue::Number(2.0));
    let mut host = Answers::default();
    step(&mut executor, &mut host, 0);
    executor.set_entry("n", BoardValue::Number(0.0));
    assert_eq!(step(&mut executor, &mut host, 1), "halt A, start B: Running");
    TreeExecutor::restore(tree(node), &executor.state()).unwrap();
}

#[test]
fn a_damaged_state_is_refused_or_harmless() {
    let node = "<Parallel success_count=\"-1\"><IfThenElse><P/><A/></IfThenElse><Sequence><Script code=\"x := 1\" \
                _skipIf=\"true\"/><Repeat num_cycles=\"-1\"><B/></Repeat></Sequence></Parallel>";
    let mut executor = TreeExecutor::new(tree(node));
    let mut host = Answers::new(&[("P", "S"), ("B", "S")]);
    step(&mut executor, &mut host, 0);
    let text = serde_json::to_string(&executor.state()).unwrap();
    for field in ["child", "count", "failures", "deadline"] {
        for value in ["0", "1", "2", "3", "4294967295"] {
            let mut damaged = text.clone();
            for old in ["0", "1", "2"] {
                damaged = damaged.replace(&format!("\"{field}\":{old},"), &format!("\"{field}\":{value},"));
            }
            let state: TreeState = serde_json::from_str(&damaged).unwrap();
            if let Ok(mut restored) = TreeExecutor::restore(tree(node), &state) {
                (1..5).for_each(|tick| drop(restored.tick(tick, &mut host)));
            }
        }
    }
}

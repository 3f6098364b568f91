//! Loops over queues, and nodes that wait for a new value of an entry.

use slate_behavior_tree::{BehaviorTree, BoardValue, TreeExecutor};

use crate::common::{Answers, document, models, step, trace, tree};

fn refused(node: &str) -> String {
    BehaviorTree::parse(document(node, "").as_bytes(), &models()).unwrap_err().to_string()
}

#[test]
fn a_loop_gives_its_child_one_value_in_a_tick() {
    for (tag, queue, expected) in [
        ("LoopInt", "1;-2", ["v=1", "v=-2"]),
        ("LoopDouble", "0.5;2e1;", ["v=0.5", "v=20"]),
        ("LoopString", "a b;", ["v=a b", ""]),
        ("LoopBool", "true;0", ["v=1", "v=0"]),
    ] {
        let node = format!("<{tag} queue=\"{queue}\" value=\"{{v}}\"><A v=\"{{v}}\"/></{tag}>");
        let found = trace(&node, &[("A", "S")], 2);
        let event = |value: &str| match value {
            "" => ": Succeeded".to_owned(),
            value => format!("start A {value}: Running"),
        };
        assert_eq!(found, expected.map(event), "{tag}");
    }
}

#[test]
fn a_loop_ends_with_a_failure_or_without_a_value() {
    let node = "<LoopInt queue=\"1;2;3\" value=\"{v}\" if_empty=\"FAILURE\"><A v=\"{v}\"/></LoopInt>";
    let found = trace(node, &[("A", "SRF")], 3);
    assert_eq!(found, ["start A v=1: Running", "start A v=2: Running", "go on A v=2: Failed"]);
    assert_eq!(trace(node, &[("A", "S")], 4)[3], ": Failed", "no value is left");
    assert_eq!(trace("<LoopInt queue=\"\" if_empty=\"SKIPPED\"><A/></LoopInt>", &[], 1), [": Skipped"]);
}

#[test]
fn a_loop_keeps_the_text_of_its_entry_from_the_start() {
    let node = "<Sequence><Script code=\"q := '1;2'\" _skipIf=\"q == '7'\"/>\
                <LoopInt queue=\"{q}\" value=\"{v}\"><A v=\"{v}\" _onSuccess=\"q := '7'\"/></LoopInt></Sequence>";
    let mut executor = TreeExecutor::new(tree(node));
    executor.set_entry("q", BoardValue::Text(String::new()));
    let mut host = Answers::new(&[("A", "S")]);
    let found: Vec<String> = (0..5).map(|tick| step(&mut executor, &mut host, tick)).collect();
    let expected = ["start A v=1: Running", "start A v=2: Running", ": Succeeded", "start A v=7: Running"];
    assert_eq!(found[..4], expected);
    assert_eq!(
        trace("<LoopInt queue=\"{q}\"><A/></LoopInt>", &[], 1),
        [": Succeeded"],
        "no value is not a queue"
    );
}

#[test]
fn queues_of_another_type_are_refused() {
    assert!(
        refused("<LoopInt queue=\"1;2.5\"><A/></LoopInt>")
            .contains("expected an integer between `;`, found `2.5`")
    );
    assert!(
        refused("<LoopBool queue=\"yes\"><A/></LoopBool>").contains("expected true or false between `;`")
    );
    assert!(
        refused("<LoopInt queue=\"1\" value=\"v\"><A/></LoopInt>").contains("an entry such as `{value}`")
    );
    assert!(refused("<LoopInt><A/></LoopInt>").contains("expected the port `queue`"));
    let node = "<Sequence><Script code=\"q := 'x'\"/><LoopDouble queue=\"{q}\"><A/></LoopDouble></Sequence>";
    let error = TreeExecutor::new(tree(node)).tick(0, &mut Answers::default()).unwrap_err();
    assert!(error.to_string().contains("port `queue`: expected a number between `;`, found `x`"), "{error}");
}

/// Ticks a node four times; `x` is written before the second and the third tick, the third time without a change.
fn with_writes(node: &str, answers: &str) -> Vec<String> {
    let mut executor = TreeExecutor::new(tree(node));
    let mut host = Answers::new(&[("A", answers)]);
    let mut found = Vec::new();
    for tick in 0..4 {
        if tick == 1 || tick == 2 {
            executor.set_entry("x", BoardValue::Number(1.0));
        }
        found.push(step(&mut executor, &mut host, tick));
    }
    found
}

#[test]
fn a_child_is_ticked_when_an_entry_was_written() {
    let found = with_writes("<SkipUnlessUpdated entry=\"{x}\"><A/></SkipUnlessUpdated>", "S");
    assert_eq!(found, [": Skipped", "start A: Succeeded", "start A: Succeeded", ": Skipped"]);
    let found = with_writes("<WaitValueUpdate entry=\"x\"><A/></WaitValueUpdate>", "RF");
    assert_eq!(found, [": Running", "start A: Running", "go on A: Failed", "start A: Running"]);
    let found = with_writes("<WasEntryUpdated entry=\"{x}\"/>", "");
    assert_eq!(found, [": Failed", ": Succeeded", ": Succeeded", ": Failed"]);
}

#[test]
fn an_entry_without_a_value_was_not_updated() {
    let node = "<Sequence><Script code=\"x := 1\"/><WasEntryUpdated entry=\"{x}\"/><UnsetBlackboard key=\"x\"/>\
                <Inverter><WasEntryUpdated entry=\"{x}\"/></Inverter></Sequence>";
    assert_eq!(trace(node, &[], 1), [": Succeeded"]);
    assert!(refused("<WasEntryUpdated entry=\"\"/>").contains("expected an entry such as `{n}`"));
}

#[test]
fn wait_for_value_halts_its_child() {
    let node =
        "<ReactiveFallback><P/><SkipUnlessUpdated entry=\"{x}\"><A/></SkipUnlessUpdated></ReactiveFallback>";
    let mut executor = TreeExecutor::new(tree(node));
    executor.set_entry("x", BoardValue::Number(1.0));
    let mut host = Answers::new(&[("P", "FSF")]);
    let found: Vec<String> = (0..3).map(|tick| step(&mut executor, &mut host, tick)).collect();
    assert_eq!(found, ["ask P, start A: Running", "ask P, halt A: Succeeded", "ask P: Failed"]);
}

//! Trees as monitors show them.

use std::sync::Arc;

use slate_behavior_tree::{BehaviorTree, BoardValue, NodeStatus, TreeExecutor};

use crate::common::{Answers, document, models, step, tree};

#[test]
fn a_monitor_gets_the_tree_with_the_numbers_of_its_nodes() {
    let text = document(
        "<Sequence name=\"a &lt; b\"><Script code=\"x := 1\"/><SubTree ID=\"go\" to=\"{x}\" name=\"first\"/>\
         <SubTree ID=\"go\" to=\"2\" _skipIf=\"x &lt; 0\"/></Sequence>",
        "<BehaviorTree ID=\"go\"><Inverter><Action ID=\"Go to\" x=\"{to}\"/></Inverter></BehaviorTree>",
    );
    let tree = Arc::new(BehaviorTree::parse(text.as_bytes(), &models()).unwrap());
    let xml = tree.monitor_xml().unwrap();
    let read = roxmltree::Document::parse(xml).unwrap();
    let numbered = read.descendants().filter(|node| node.attribute("_uid").is_some());
    let found: Vec<(u32, &str)> = numbered
        .map(|node| (node.attribute("_uid").unwrap().parse().unwrap(), node.attribute("name").unwrap()))
        .collect();
    let expected = [
        (1, "a < b"),
        (2, "Script"),
        (3, "first"),
        (6, "go"),
        (4, "Inverter"),
        (5, "Go to"),
        (7, "Inverter"),
        (8, "Go to"),
    ];
    assert_eq!(found, expected, "the nodes of each use of a sub-tree follow the main tree");
    let names = tree.nodes().iter().enumerate().map(|(index, node)| (index as u32 + 1, node.name()));
    assert!(names.into_iter().all(|node| expected.contains(&node)));
    assert!(xml.contains("_fullpath=\"main/2 first\"") && xml.contains("_skipIf=\"x &lt; 0\""), "{xml}");
    // What is shown is a tree, once the uses of a sub-tree have IDs of their own.
    assert!(xml.contains("<Action ID=\"Go to\"><inout_port name=\"x\"/></Action>"), "{xml}");
}

#[test]
fn an_idle_node_tells_the_status_that_it_had() {
    let mut executor = TreeExecutor::new(tree("<Fallback><A/><Sequence><B/><C/></Sequence><D/></Fallback>"));
    let mut host = Answers::new(&[("A", "F"), ("B", "S"), ("C", "RS")]);
    step(&mut executor, &mut host, 0);
    let statuses = |executor: &TreeExecutor| -> Vec<(NodeStatus, NodeStatus)> {
        (0..6).map(|node| (executor.status(node), executor.last_status(node))).collect()
    };
    use NodeStatus::{Failed, Idle, Running, Succeeded};
    let expected =
        [(Running, Idle), (Failed, Idle), (Running, Idle), (Succeeded, Idle), (Running, Idle), (Idle, Idle)];
    assert_eq!(statuses(&executor), expected);
    step(&mut executor, &mut host, 1);
    let expected = [
        (Idle, Succeeded),
        (Idle, Failed),
        (Idle, Succeeded),
        (Idle, Succeeded),
        (Idle, Succeeded),
        (Idle, Idle),
    ];
    assert_eq!(statuses(&executor), expected);
}

#[test]
fn entries_are_listed_with_the_board_that_they_are_of() {
    let text = document(
        "<Sequence><Script code=\"x := 1\"/><SubTree ID=\"go\" to=\"far/away\"/></Sequence>",
        "<BehaviorTree ID=\"go\"><Action ID=\"A\" x=\"{to}\" y=\"{none}\"/></BehaviorTree>",
    );
    let mut executor = TreeExecutor::new(BehaviorTree::parse(text.as_bytes(), &models()).unwrap().into());
    step(&mut executor, &mut Answers::default(), 0);
    let found: Vec<(&str, &str, &BoardValue)> = executor.board().collect();
    let (one, far) = (BoardValue::Number(1.0), BoardValue::Text("far/away".into()));
    assert_eq!(found, [("", "x", &one), ("main/2 go", "to", &far)]);
}

#[test]
fn another_file_is_another_tree() {
    let [one, same, other] = ["<A/>", "<A/>", "<B/>"].map(tree);
    assert_eq!(one.fingerprint(), same.fingerprint());
    assert_ne!(one.fingerprint(), other.fingerprint());
}

#[test]
fn a_tree_that_is_too_long_for_monitors_tells_its_size() {
    let leaf = format!("<A to=\"{}\"/>", "&quot;".repeat(1000));
    let tree = tree(&format!("<Sequence>{}</Sequence>", leaf.repeat(200)));
    assert!(tree.monitor_xml().is_err_and(|size| (1_200_000..1_300_000).contains(&size)));
}

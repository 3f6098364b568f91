//! Checks of trees.

use slate_behavior_tree::{BehaviorTree, TreeFindingKind, check_tree};

use crate::common::{document, models as models_of_tests, tree};

fn findings(node: &str) -> Vec<String> {
    let found = check_tree(&tree(node), None);
    found.into_iter().map(|finding| format!("{}: {}", finding.kind.name(), finding.text)).collect()
}

#[test]
fn a_plain_tree_has_no_finding() {
    assert!(findings("<Fallback><Sequence><P/><A/></Sequence><B/></Fallback>").is_empty());
    assert!(findings("<Sequence><AlwaysFailure _skipIf=\"true\"/><A/></Sequence>").is_empty());
    assert!(findings("<Sequence><A to=\"{x}\"/><Script code=\"y := x\"/></Sequence>").is_empty());
}

#[test]
fn a_node_behind_a_certain_end_is_dead() {
    let dead = "dead node: `main/2 A` is never ticked";
    for node in [
        "<Sequence><AlwaysFailure/><A/></Sequence>",
        "<Fallback><Script code=\"x := 1\"/><A/></Fallback>",
        "<ReactiveSequence><KeepRunningUntilFailure><P/></KeepRunningUntilFailure><A/></ReactiveSequence>",
        "<IfThenElse><AlwaysFailure/><A/><B/></IfThenElse>",
    ] {
        let found = findings(node);
        let expected = if node.contains("Keep") { dead.replace("2 A", "3 A") } else { dead.into() };
        assert!(found[0].starts_with(&expected), "{found:?}");
    }
    let found =
        findings("<Sequence><Inverter><AlwaysSuccess/></Inverter><Sequence><A/><B/></Sequence></Sequence>");
    assert_eq!(found.len(), 1, "{found:?}");
}

#[test]
fn an_entry_that_nothing_writes_is_found() {
    let found = findings("<Sequence><A _skipIf=\"go\"/><Repeat num_cycles=\"{n}\"><B/></Repeat></Sequence>");
    assert_eq!(found.len(), 2);
    assert!(found[0].contains("nothing in the tree writes the entry `go`"), "{found:?}");
}

#[test]
fn an_input_of_an_action_writes_nothing() {
    let models = "<TreeNodesModel><Action ID=\"Go\"><input_port name=\"to\"/><output_port name=\"end\"/></Action>\
                  </TreeNodesModel>";
    let parse =
        |node: &str| BehaviorTree::parse(document(node, models).as_bytes(), &models_of_tests()).unwrap();
    let found = check_tree(&parse("<Sequence>\n<Go to=\"{place}\"/></Sequence>"), None);
    assert_eq!((found.len(), found[0].line, found[0].kind), (1, 4, TreeFindingKind::UnsetEntry));
    assert!(
        check_tree(&parse("<Sequence><Go to=\"1\" end=\"{p}\"/><Go to=\"{p}\"/></Sequence>"), None)
            .is_empty()
    );
}

#[test]
fn a_tree_that_never_ends_is_found() {
    let found = findings("<Repeat num_cycles=\"-1\"><ForceSuccess><A/></ForceSuccess></Repeat>");
    assert!(found[0].starts_with("no end: "), "{found:?}");
}

#[test]
fn an_unknown_leaf_is_an_error() {
    let tree = tree("<Sequence>\n<P/><A/></Sequence>");
    let found = check_tree(&tree, Some(&|_, name| name == "A"));
    assert_eq!((found.len(), found[0].line, found[0].kind), (1, 4, TreeFindingKind::UnknownLeaf));
    assert!(found[0].kind.is_error() && found[0].text.contains("the condition `P` is unknown"));
}

//! Bad input.

use proptest::prelude::*;
use slate_behavior_tree::{BehaviorTree, TreeExecutor};

use crate::common::{Answers, document, models};

fn parse(text: &str) -> Result<BehaviorTree, String> {
    BehaviorTree::parse(text.as_bytes(), &models()).map_err(|error| error.to_string())
}

#[test]
fn a_defect_is_named_with_its_line_and_what_was_expected() {
    for (node, expected) in [
        ("<Walk/>", "unknown node `Walk`: expected a node of BehaviorTree.CPP, or one of `TreeNodesModel`"),
        ("<Sequnce><A/></Sequnce>", "unknown node `Sequnce`: did you mean `Sequence`?"),
        ("<A _skipif=\"true\"/>", "unknown attribute `_skipif`: did you mean `_skipIf`?"),
        ("<A _onsuccess=\"x := 1\"/>", "unknown attribute `_onsuccess`: did you mean `_onSuccess`?"),
        ("<A _guardian=\"x\"/>", "unknown attribute `_guardian`: those with `_` are _failureIf, _successIf,"),
        (
            "<SubTree ID=\"main\" _autormap=\"true\"/>",
            "unknown attribute `_autormap`: did you mean `_autoremap`?",
        ),
        (
            "<Parallel success_count=\"3\"><A/><B/></Parallel>",
            "expected at most the number of children, 2, in the port `success_count`, found 3",
        ),
        ("<Parallel failure_count=\"3\"><A/><B/></Parallel>", "in the port `failure_count`, found 3"),
        ("<ParallelAll max_failures=\"2\"><A/></ParallelAll>", "in the port `max_failures`, found 2"),
        (
            "<RunOnce then_skip=\"maybe\"><A/></RunOnce>",
            "expected true, false or an entry such as `{n}` in the port `then_skip`, found `maybe`",
        ),
        ("<Action/>", "expected the attribute `ID` of `Action`"),
        ("<Condition ID=\"A\"/>", "expected `A` as an action, as its model says"),
        ("<SubTree ID=\"other\"/>", "unknown sub-tree `other`; the file has: main"),
        ("<SubTree ID=\"main\"/>", "a sub-tree can't be a part of itself: main leads back to `main`"),
        ("<Sequence/>", "expected at least 1 child of `Sequence`, found 0"),
        ("<Inverter><A/><A/></Inverter>", "expected one child of `Inverter`, found 2"),
        ("<IfThenElse><A/></IfThenElse>", "expected 2 or 3 children of `IfThenElse`, found 1"),
        ("<A><B/></A>", "expected no child of `A`, found 1"),
        (
            "<Switch2 variable=\"{x}\" case_1=\"1\" case_2=\"2\"><A/><A/></Switch2>",
            "expected 3 children (one for each case, and the default) of `Switch2`, found 2",
        ),
        ("<Switch2 variable=\"{x}\" case_1=\"1\"><A/></Switch2>", "expected the port `case_2` of `Switch2`"),
        ("<Repeat><A/></Repeat>", "expected the port `num_cycles` of `Repeat`"),
        (
            "<Repeat num_cycles=\"many\"><A/></Repeat>",
            "expected an integer of at least -1 or an entry such as",
        ),
        (
            "<Sleep msec=\"-3\"/>",
            "expected an integer of at least 0 or an entry such as `{n}` in the port `msec`",
        ),
        ("<Sequence speed=\"3\"><A/></Sequence>", "`Sequence` has no port `speed`"),
        ("<SetBlackboard value=\"1\" output_key=\"{x}\"/>", "expected the name of an entry, without braces"),
        ("<Precondition if=\"true\" else=\"MAYBE\"><A/></Precondition>", "in the port `else`, found `MAYBE`"),
        ("<A _skipIf=\"x >\"/>", "script `x >`, column 4: expected a value, found the end"),
        ("<A/><B/>", "expected one node in the tree `main`, found 2; put them below a `Sequence`"),
    ] {
        let error = parse(&document(node, "")).unwrap_err();
        assert!(error.starts_with("line ") && error.contains(expected), "{node}: {error}");
    }
}

#[test]
fn notes_of_editors_are_accepted() {
    let notes = "_description=\"look around\" _uid=\"3\" _fullpath=\"main/look\"";
    parse(&document(&format!("<Sequence><A {notes}/></Sequence>"), "")).unwrap();
}

#[test]
fn a_document_that_is_no_tree_is_refused() {
    let tree = "<BehaviorTree ID=\"main\"><A/></BehaviorTree>";
    for (text, expected) in [
        ("<trees/>".to_owned(), "line 1: expected the element `root`, found `trees`"),
        (format!("<root>{tree}</root>"), "expected `BTCPP_format=\"4\"` in `root`"),
        ("<root BTCPP_format=\"4\"/>".to_owned(), "expected an element `BehaviorTree` in `root`"),
        (format!("<root BTCPP_format=\"4\">{tree}\n{tree}</root>"), "line 2: expected another ID"),
        (format!("<root BTCPP_format=\"4\"><include path=\"x\"/>{tree}</root>"), "expected no `include`"),
        (
            format!("<root BTCPP_format=\"4\" main_tree_to_execute=\"x\">{tree}</root>"),
            "no tree has the ID `x` of the main tree; the file has: main",
        ),
        ("<root BTCPP_format=\"4\"".to_owned(), "expected XML"),
        (
            document("<A/>", "<BehaviorTree ID=\"b\"><A/></BehaviorTree>").replace("main_tree", "first"),
            "several trees",
        ),
    ] {
        let error = parse(&text).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let bomb = "<!DOCTYPE a [<!ENTITY b \"c\">]><root BTCPP_format=\"4\">&b;</root>";
    assert!(parse(bomb).unwrap_err().contains("expected XML"));
    assert!(
        BehaviorTree::parse(b"\xff", &models()).unwrap_err().to_string().contains("line 1: expected UTF-8")
    );
}

#[test]
fn deep_and_huge_trees_are_refused() {
    let deep = format!("{}<A/>{}", "<Inverter>".repeat(70), "</Inverter>".repeat(70));
    assert!(parse(&document(&deep, "")).unwrap_err().contains("expected at most 64 levels of nodes"));
    let mut others = String::new();
    for level in 0..12 {
        let inner = format!("<SubTree ID=\"t{}\"/>", level + 1).repeat(4);
        others += &format!("<BehaviorTree ID=\"t{level}\"><Sequence>{inner}</Sequence></BehaviorTree>");
    }
    others += "<BehaviorTree ID=\"t12\"><A/></BehaviorTree>";
    let error = parse(&document("<SubTree ID=\"t0\"/>", &others)).unwrap_err();
    assert!(error.contains("expected at most 10000 nodes with all sub-trees"), "{error}");
    let inner =
        format!("<BehaviorTree ID=\"inner\"><Sequence>{}</Sequence></BehaviorTree>", "<A/>".repeat(1000));
    let long = format!("<SubTree ID=\"inner\" name=\"{}\"/>", "x".repeat(100_000));
    let error = parse(&document(&long, &inner)).unwrap_err();
    assert!(error.contains("bytes of names and attributes with all sub-trees"), "{error}");
}

#[test]
fn a_file_is_named_in_its_errors() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("behavior-trees");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("patrol.xml");
    std::fs::write(&file, document("<A/>", "")).unwrap();
    assert_eq!(BehaviorTree::read(&file, &models()).unwrap().name(), "main");
    std::fs::write(&file, document("<Walk/>", "")).unwrap();
    let error = BehaviorTree::read(&file, &models()).unwrap_err().to_string();
    assert!(error.contains("patrol.xml:3: unknown node `Walk`"), "{error}");
    assert!(
        BehaviorTree::read(&folder.join("none.xml"), &models())
            .unwrap_err()
            .to_string()
            .contains("can't be read")
    );
}

const MUTATED: &str = "<Fallback><Parallel success_count=\"1\" failure_count=\"2\"><A to=\"{x}\"/><B/></Parallel>\
    <Repeat num_cycles=\"3\"><Script code=\"x := 1 + 2; y := x > 2 ? 'a' : 'b'\"/></Repeat>\
    <Switch2 variable=\"{y}\" case_1=\"a\" case_2=\"b\"><A/><P _skipIf=\"x == 3\"/><SubTree ID=\"inner\" x=\"{x}\"/>\
    </Switch2></Fallback>";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn mutated_files_never_panic(
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0usize..40, any::<prop::sample::Index>(), 0usize..40), 1..6),
    ) {
        let text = document(MUTATED, "<BehaviorTree ID=\"inner\"><Timeout msec=\"5\"><C/></Timeout></BehaviorTree>");
        let mut bytes = text.as_bytes().to_vec();
        for (at, length, from, count) in cuts {
            let at = at.index(bytes.len() + 1);
            let end = (at + length).min(bytes.len());
            let source = from.index(text.len());
            bytes.splice(at..end, text.as_bytes()[source..(source + count).min(text.len())].to_vec());
        }
        if let Ok(tree) = BehaviorTree::parse(&bytes, &models()) {
            let mut executor = TreeExecutor::new(tree.into());
            for tick in 0..5 {
                let _ = executor.tick(tick, &mut Answers::default());
            }
        }
    }
}

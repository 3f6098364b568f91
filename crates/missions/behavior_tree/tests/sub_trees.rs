//! Sub-trees, their blackboards, and ports.

use std::sync::Arc;

use slate_behavior_tree::{
    BehaviorTree, BoardValue, LeafKind, LeafModel, LeafModels, PortDirection, PortModel, TreeExecutor,
};

use crate::common::{Answers, document, models, step};

fn executor(node: &str, others: &str) -> TreeExecutor {
    let tree = BehaviorTree::parse(document(node, others).as_bytes(), &models()).unwrap();
    TreeExecutor::new(Arc::new(tree))
}

const INNER: &str = "<BehaviorTree ID=\"inner\"><Sequence>\
                       <A goal=\"{goal}\" side=\"{side}\"/><Script code=\"result := goal * 2; _own := 1\"/>\
                     </Sequence></BehaviorTree>";

#[test]
fn ports_lead_to_entries_of_the_tree_above() {
    let node = "<Sequence><Script code=\"target := 4\"/>\
                <SubTree ID=\"inner\" goal=\"{target}\" side=\"left\" result=\"{=}\"/><B n=\"{result}\"/></Sequence>";
    let mut executor = executor(node, INNER);
    let mut host = Answers::new(&[("A", "S"), ("B", "S")]);
    assert_eq!(step(&mut executor, &mut host, 0), "start A goal=4 side=left, start B n=8: Succeeded");
    assert_eq!(executor.entry("result"), Some(&BoardValue::Number(8.0)));
}

#[test]
fn entries_without_a_port_belong_to_the_sub_tree() {
    let node = "<Sequence><SubTree ID=\"inner\" goal=\"3\" name=\"first\"/><SubTree ID=\"inner\" goal=\"5\"/></Sequence>";
    let mut executor = executor(node, INNER);
    let mut host = Answers::new(&[("A", "S")]);
    assert_eq!(step(&mut executor, &mut host, 0), "start A goal=3, start A goal=5: Succeeded");
    let names = executor.tree().entries();
    assert!(names.contains(&"main/1 first/result".to_owned()), "{names:?}");
    assert_eq!(executor.entry("main/2 inner/result"), Some(&BoardValue::Number(10.0)));
}

#[test]
fn an_open_sub_tree_shares_all_but_its_own_entries() {
    let node = "<Sequence><Script code=\"goal := 1; side := 'right'\"/><SubTree ID=\"inner\" _autoremap=\"true\"/>\
                <Script code=\"@root := result\"/></Sequence>";
    let mut executor = executor(node, INNER);
    let mut host = Answers::new(&[("A", "S")]);
    assert_eq!(step(&mut executor, &mut host, 0), "start A goal=1 side=right: Succeeded");
    assert_eq!(executor.entry("root"), Some(&BoardValue::Number(2.0)));
    assert!(executor.entry("main/2 inner/_own").is_some());
}

#[test]
fn an_action_writes_its_output_ports() {
    let models = "<TreeNodesModel><Action ID=\"Find\"><output_port name=\"to\"/>\
                  <input_port name=\"what\" default=\"ball\"/></Action></TreeNodesModel>";
    let mut executor = executor("<Sequence><Find to=\"{place}\"/><A at=\"{place}\"/></Sequence>", models);
    let mut host = Answers::new(&[("Find", "S"), ("A", "S")]);
    host.output = Some(BoardValue::Text("shelf".into()));
    assert_eq!(step(&mut executor, &mut host, 0), "start Find what=ball, start A at=shelf: Succeeded");
}

#[test]
fn explicit_and_compact_nodes_are_the_same() {
    let compact = "<Sequence><Inverter><P/></Inverter><A to=\"1\"/><Sleep msec=\"1\"/></Sequence>";
    let explicit = "<Control ID=\"Sequence\"><Decorator ID=\"Inverter\"><Condition ID=\"P\"/></Decorator>\
                    <Action ID=\"A\" to=\"1\"/><Action ID=\"Sleep\" msec=\"1\"/></Control>";
    let parse = |node: &str| BehaviorTree::parse(document(node, "").as_bytes(), &models()).unwrap();
    let (compact, explicit) = (parse(compact), parse(explicit));
    assert_eq!((compact.nodes(), compact.leaves()), (explicit.nodes(), explicit.leaves()));
}

#[test]
fn models_of_the_host_check_ports() {
    let port = |name: &str, default: Option<&str>| PortModel {
        name: name.into(),
        direction: PortDirection::Input,
        default: default.map(str::to_owned),
    };
    let ports = Some(vec![port("to", None), port("speed", Some("0.5"))]);
    let models = LeafModels::default().with("GoTo", LeafModel { kind: LeafKind::Action, ports });
    let parse = |node: &str| BehaviorTree::parse(document(node, "").as_bytes(), &models);
    let tree = parse("<GoTo to=\"door\"/>").unwrap();
    let literals: Vec<String> =
        tree.leaves()[0].literals().map(|(name, value)| format!("{name}={value}")).collect();
    assert_eq!(literals, ["to=door", "speed=0.5"]);
    assert!(parse("<GoTo/>").unwrap_err().to_string().contains("line 3: expected the port `to` of `GoTo`"));
    let error = parse("<GoTo to=\"a\" too=\"b\"/>").unwrap_err().to_string();
    assert!(error.contains("`GoTo` has no port `too`; its model has: to, speed"), "{error}");
}

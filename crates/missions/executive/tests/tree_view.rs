//! Views of monitors on a Plan that follows a tree.

use std::path::Path;

use slate_executive::behavior_tree_plan::{BehaviorTreePlan, BehaviorTreePlanParams};
use slate_executive::tree_view::{BLACKBOARDS, NODES, TREE, TreeView};
use slate_plugin::mapek::PlanBlock;
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::sent;

fn content(plan: &Fixture<PlanBlock<BehaviorTreePlan>>, port: &str) -> (u64, Vec<u8>) {
    let (fingerprint, size, content) =
        plan.read(port, |view: &TreeView| (view.fingerprint, view.size, view.content.to_vec())).unwrap();
    assert_eq!(size, content.len() as u64);
    (fingerprint, content)
}

#[test]
fn a_plan_shows_tree_statuses_and_blackboards() {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tree-view.xml");
    let text = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"main\"><Sequence><Script code=\"x := 2.5; say := 'a \\ &quot;b&quot;'\"/>\
                <Action ID=\"Go\" x=\"{x}\"/></Sequence></BehaviorTree></root>";
    std::fs::write(&file, text).unwrap();
    let tree_filename = Text::new(file.to_str().unwrap());
    let params = BehaviorTreePlanParams { tree_filename, ..BehaviorTreePlanParams::default() };
    let mut plan = Fixture::<PlanBlock<BehaviorTreePlan>>::with(params).unwrap();
    assert_eq!(sent(&mut plan), ["Go 2.5"]);
    let (fingerprint, xml) = content(&plan, TREE);
    assert!(String::from_utf8(xml).unwrap().contains("<Go name=\"Go\" _uid=\"3\" x=\"{x}\"/>"));
    assert_eq!(content(&plan, NODES), (fingerprint, vec![1, 2, 1]), "running, succeeded, running");
    let (_, json) = content(&plan, BLACKBOARDS);
    let found: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(found, serde_json::json!([["main", "x", 2.5], ["main", "say", "a \\ \"b\""]]));
    std::fs::write(&file, text.replace("2.5", "3.5")).unwrap();
    plan.params().revision = 1;
    sent(&mut plan);
    assert_ne!(content(&plan, NODES).0, fingerprint, "another file");
}

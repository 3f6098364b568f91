//! Behavior trees as XML, their checks, ticks and states.

use std::sync::Arc;

use slate_behavior_tree::{
    BehaviorTree, LeafModels, LeafPorts, NodeStatus, TreeExecutor, TreeHost, TreeLeaf, TreeState, check_tree,
};

use crate::memory::within;

/// A host whose answers come from a counter.
#[derive(Clone)]
struct Host(u32);

impl Host {
    fn answer(&mut self) -> NodeStatus {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        match self.0 >> 30 {
            0 => NodeStatus::Failed,
            1 => NodeStatus::Succeeded,
            _ => NodeStatus::Running,
        }
    }
}

impl TreeHost for Host {
    fn condition(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer()
    }

    fn start(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer()
    }

    fn progress(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer()
    }

    fn halt(&mut self, _: usize, _: &TreeLeaf) {}
}

/// Reads a tree; a valid one is checked and ticked.
/// It continues from its saved state as from its own.
pub fn run(bytes: &[u8]) {
    let models = LeafModels::default().action("A").action("B").condition("P");
    let Ok(tree) = within((16 << 20) + 1024 * bytes.len(), || BehaviorTree::parse(bytes, &models)) else {
        return;
    };
    check_tree(&tree, None);
    let tree = Arc::new(tree);
    let mut executor = TreeExecutor::new(Arc::clone(&tree));
    let mut host = Host(1);
    let tick =
        |executor: &mut TreeExecutor, host: &mut Host, tick: u64| executor.tick(tick * 50_000_000, host);
    for number in 0..8 {
        if tick(&mut executor, &mut host, number).is_err() {
            return;
        }
    }
    let text = serde_json::to_string(&executor.state()).expect("it has text keys");
    let state: TreeState = serde_json::from_str(&text).expect("it was written here");
    let mut restored = TreeExecutor::restore(tree, &state).expect("it is of this tree");
    let mut other = host.clone();
    for number in 8..16 {
        let (left, right) = (tick(&mut executor, &mut host, number), tick(&mut restored, &mut other, number));
        assert_eq!(left, right, "the restored run differs");
    }
    assert_eq!(executor.state(), restored.state(), "the restored state differs");
}

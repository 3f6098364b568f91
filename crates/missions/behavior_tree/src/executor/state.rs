//! State of a run by names, for snapshots and for a changed tree.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use super::TreeExecutor;
use super::node::NodeRecord;
use crate::error::TreeStateError;
use crate::tree::{BehaviorNode, BehaviorTree, NodeOperation, NodeStatus};
use crate::value::BoardValue;

/// State of a run by names, so that it fits into a changed tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TreeState {
    /// Number of ticks.
    pub ticks: u64,
    /// True if a node requests another tick at once.
    pub wants_tick: bool,
    /// Status that the last tick returned.
    pub outcome: NodeStatus,
    /// Nodes that are not as at the start.
    pub nodes: Vec<SavedNode>,
    /// Entries of the blackboards by their names, those without a value included.
    pub entries: Vec<(String, Option<BoardValue>)>,
    /// Number of writes of each of these entries.
    pub writes: Vec<u64>,
}

/// State of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedNode {
    /// Path of the node, such as `patrol/2 GoTo`.
    pub path: String,
    /// Type of the node.
    pub tag: String,
    record: NodeRecord,
}

impl TreeExecutor {
    /// Returns the state.
    pub fn state(&self) -> TreeState {
        let changed = self.tree.nodes.iter().zip(&self.records);
        let changed = changed.filter(|(_, record)| **record != NodeRecord::default());
        let nodes = changed.map(|(node, record)| SavedNode {
            path: node.path.clone(),
            tag: node.tag.clone(),
            record: *record,
        });
        TreeState {
            ticks: self.ticks,
            wants_tick: self.wants_tick,
            outcome: self.outcome,
            nodes: nodes.collect(),
            entries: self.entry_names().map(|(slot, name)| (name, self.values.get(slot).cloned())).collect(),
            writes: self.entry_names().map(|(slot, _)| self.values.writes(slot)).collect(),
        }
    }

    /// Creates an executor from a saved state, also of a changed tree.
    ///
    /// Nodes are found by their path; one that runs must be there. All nodes above a leaf that runs must run, and a
    /// node that ticks its children in turn must be at the one that runs.
    pub fn restore(tree: Arc<BehaviorTree>, state: &TreeState) -> Result<Self, TreeStateError> {
        let mut executor = Self::new(tree);
        (executor.ticks, executor.wants_tick, executor.outcome) =
            (state.ticks, state.wants_tick, state.outcome);
        let tree = Arc::clone(&executor.tree);
        let paths: SortedMap<&str, usize> =
            tree.nodes.iter().enumerate().map(|(index, node)| (node.path.as_str(), index)).collect();
        for SavedNode { path, tag, record } in &state.nodes {
            let found = paths.get(path.as_str()).copied();
            match found.filter(|index| fits(&tree.nodes[*index], tag, record)) {
                Some(index) => executor.records[index] = *record,
                None if record.status != NodeStatus::Running => {}
                None => {
                    return Err(TreeStateError(format!("the node `{path}` (`{tag}`) runs, and is missing")));
                }
            }
        }
        executor.check_running(&tree)?;
        executor.count_children(&tree);
        let names: SortedMap<&str, usize> =
            tree.entries.iter().enumerate().map(|(slot, name)| (name.as_str(), slot)).collect();
        for (number, (name, value)) in state.entries.iter().enumerate() {
            if let Some(slot) = names.get(name.as_str()) {
                let writes = state.writes.get(number).copied().unwrap_or(u64::from(value.is_some()));
                executor.values.restore(*slot, value.clone(), writes);
            }
        }
        Ok(executor)
    }

    fn entry_names(&self) -> impl Iterator<Item = (usize, String)> {
        self.tree.entries.iter().cloned().enumerate()
    }

    /// Checks that each leaf that runs is ticked and halted by the nodes above it.
    ///
    /// A node with children may keep the status of an earlier tick while the one above it has none.
    fn check_running(&self, tree: &BehaviorTree) -> Result<(), TreeStateError> {
        // Children have greater numbers.
        let mut has_running_leaf = vec![false; tree.nodes.len()];
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            let status = self.records[index].status;
            has_running_leaf[index] |= node.children.is_empty() && status == NodeStatus::Running;
            for (number, child) in node.children.iter().enumerate() {
                if !has_running_leaf[*child] {
                    continue;
                }
                has_running_leaf[index] = true;
                let (path, below) = (&node.path, &tree.nodes[*child].path);
                if status != NodeStatus::Running {
                    return Err(TreeStateError(format!("`{below}` runs, and `{path}` above it doesn't")));
                }
                if self.running_child(index, node).is_some_and(|expected| expected != number) {
                    return Err(TreeStateError(format!("`{below}` runs, and `{path}` is at another child")));
                }
            }
        }
        Ok(())
    }

    /// Returns the number of the only child that may run.
    fn running_child(&self, index: usize, node: &BehaviorNode) -> Option<usize> {
        let child = self.records[index].child as usize;
        match node.operation {
            NodeOperation::TryCatch { .. } if self.records[index].is_started => Some(node.children.len() - 1),
            NodeOperation::Sequence { .. }
            | NodeOperation::Fallback { .. }
            | NodeOperation::SequenceWithMemory
            | NodeOperation::IfThenElse
            | NodeOperation::TryCatch { .. } => Some(child),
            // A switch counts its running child from 1; 0 means that no child runs.
            NodeOperation::Switch { .. } => Some(child.wrapping_sub(1)),
            _ => None,
        }
    }

    /// Counts the children of parallel nodes that have ended, as some may be missing.
    fn count_children(&mut self, tree: &BehaviorTree) {
        self.records[0].is_counted = false;
        for (index, node) in tree.nodes.iter().enumerate() {
            let is_all = matches!(node.operation, NodeOperation::ParallelAll { .. });
            let is_parallel = is_all || matches!(node.operation, NodeOperation::Parallel { .. });
            let is_counting = is_parallel && self.records[index].status == NodeStatus::Running;
            let (mut succeeded, mut failed) = (0, 0);
            for child in &node.children {
                let child = &mut self.records[*child];
                child.is_counted &= is_counting && child.status.is_completed();
                succeeded += u32::from(child.is_counted && child.status == NodeStatus::Succeeded);
                failed += u32::from(child.is_counted && child.status == NodeStatus::Failed);
            }
            if is_parallel {
                let record = &mut self.records[index];
                (record.count, record.failures) = (if is_all { 0 } else { succeeded }, failed);
            }
        }
    }

    /// Exchanges the tree while it runs.
    ///
    /// The old one continues where the state does not fit.
    pub fn reload(&mut self, tree: Arc<BehaviorTree>) -> Result<(), TreeStateError> {
        *self = Self::restore(tree, &self.state())?;
        Ok(())
    }
}

/// Returns true if a saved node fits one of the tree: its next child exists.
fn fits(node: &BehaviorNode, tag: &str, record: &NodeRecord) -> bool {
    let most = match node.operation {
        NodeOperation::IfThenElse => node.children.len() - 1,
        _ => node.children.len(),
    };
    node.tag == tag && record.child as usize <= most
}

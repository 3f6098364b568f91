//! The state of a run by names, for snapshots and for a changed tree.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::TreeExecutor;
use super::node::NodeRecord;
use crate::error::TreeStateError;
use crate::tree::{BehaviorNode, BehaviorTree, NodeOperation, NodeStatus};
use crate::value::BoardValue;

/// State of a run: nodes and entries by their names, so that it fits into a changed tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TreeState {
    /// Number of ticks.
    pub ticks: u64,
    /// Whether a node wants another tick at once.
    pub wants_tick: bool,
    /// What the last tick returned.
    pub outcome: NodeStatus,
    /// Nodes that are not as at the start.
    pub nodes: Vec<SavedNode>,
    /// Entries of the blackboards by their names, those without a value included.
    pub entries: Vec<(String, Option<BoardValue>)>,
}

/// State of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedNode {
    /// Path of the node, such as `patrol/2 GoTo`.
    pub path: String,
    /// What it is.
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
            entries: self.tree.entries.iter().cloned().zip(self.values.iter().cloned()).collect(),
        }
    }

    /// Makes an executor that goes on from a state, also of another version of the tree.
    ///
    /// Nodes are found by their path; one that runs must be there.
    pub fn restore(tree: Arc<BehaviorTree>, state: &TreeState) -> Result<Self, TreeStateError> {
        let mut executor = Self::new(tree);
        (executor.ticks, executor.wants_tick, executor.outcome) =
            (state.ticks, state.wants_tick, state.outcome);
        let tree = Arc::clone(&executor.tree);
        let paths: BTreeMap<&str, usize> =
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
        let names: BTreeMap<&str, usize> =
            tree.entries.iter().enumerate().map(|(slot, name)| (name.as_str(), slot)).collect();
        for (name, value) in &state.entries {
            if let Some(slot) = names.get(name.as_str()) {
                executor.values[*slot] = value.clone();
            }
        }
        Ok(executor)
    }

    /// Exchanges the tree while it runs. The old one goes on where the state does not fit.
    pub fn reload(&mut self, tree: Arc<BehaviorTree>) -> Result<(), TreeStateError> {
        *self = Self::restore(tree, &self.state())?;
        Ok(())
    }
}

/// Whether a saved node may be one of the tree: the same thing, and its next child is there.
fn fits(node: &BehaviorNode, tag: &str, record: &NodeRecord) -> bool {
    let most = match node.operation {
        NodeOperation::IfThenElse => node.children.len() - 1,
        _ => node.children.len(),
    };
    node.tag == tag && record.child as usize <= most
}

//! Execution of trees, tick by tick.

mod control;
mod decorator;
mod node;
mod state;

use std::sync::Arc;

use node::{NodeRecord, TreeRun};
pub use state::{SavedNode, TreeState};

use crate::entries::EntryValues;
use crate::error::TickError;
use crate::ports::LeafPorts;
use crate::tree::{BehaviorTree, NodeStatus, TreeLeaf};
use crate::value::BoardValue;

/// Host of a tree: performs its actions and answers its conditions.
pub trait TreeHost {
    /// Answers a condition; one that is running is not known yet.
    fn condition(&mut self, index: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus;

    /// Starts an action and returns its progress.
    fn start(&mut self, index: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus;

    /// Returns how far an action has come that runs.
    ///
    /// A tick asks once for each; a skipped one has ended.
    fn progress(&mut self, index: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus;

    /// Stops an action that runs.
    fn halt(&mut self, index: usize, leaf: &TreeLeaf);
}

/// Executes a [`BehaviorTree`] with the semantics of BehaviorTree.CPP 4.
///
/// A tick allocates nothing unless a script uses a text or a node writes one.
#[derive(Clone, Debug)]
pub struct TreeExecutor {
    tree: Arc<BehaviorTree>,
    records: Vec<NodeRecord>,
    values: EntryValues,
    /// Status of each node before it became idle.
    last: Vec<NodeStatus>,
    wants_tick: bool,
    ticks: u64,
    outcome: NodeStatus,
}

impl TreeExecutor {
    /// Returns an executor at the start of the tree.
    pub fn new(tree: Arc<BehaviorTree>) -> Self {
        Self {
            records: vec![NodeRecord::default(); tree.nodes.len()],
            values: EntryValues::new(tree.initial.clone()),
            last: vec![NodeStatus::Idle; tree.nodes.len()],
            wants_tick: false,
            ticks: 0,
            outcome: NodeStatus::Idle,
            tree,
        }
    }

    /// Ticks the root once at the time `now`, ns, and returns its status.
    ///
    /// After it has completed, the next tick begins anew; the blackboard stays.
    pub fn tick(&mut self, now: u64, host: &mut impl TreeHost) -> Result<NodeStatus, TickError> {
        self.ticks += 1;
        self.wants_tick = false;
        let tree = Arc::clone(&self.tree);
        let mut run = self.run(&tree, now, host);
        let result = run.execute(0);
        match result {
            Ok(status) => {
                if status.is_completed() {
                    run.reset_status(0);
                }
                self.outcome = status;
                Ok(status)
            }
            Err(error) => {
                run.reset();
                self.outcome = NodeStatus::Failed;
                Err(error)
            }
        }
    }

    /// Returns whether a node of the last tick wants another one at once.
    ///
    /// `Repeat`, `RetryUntilSuccessful`, `SequenceWithMemory`, `AsyncSequence` and `AsyncFallback` leave the tick after
    /// a child that has begun and completed in it, so that what is above them can react.
    pub fn wants_tick(&self) -> bool {
        self.wants_tick
    }

    /// Halts the tree if it runs.
    ///
    /// The blackboard stays, and so does what `SequenceWithMemory` and `RunOnce` remember.
    pub fn halt(&mut self, now: u64, host: &mut impl TreeHost) -> Result<(), TickError> {
        let tree = Arc::clone(&self.tree);
        let mut run = self.run(&tree, now, host);
        let result = run.halt_child(0);
        if result.is_err() {
            run.reset();
        }
        self.outcome = NodeStatus::Idle;
        result
    }

    /// Returns the tree.
    pub fn tree(&self) -> &Arc<BehaviorTree> {
        &self.tree
    }

    /// Returns the number of ticks.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Returns the status of the last tick.
    pub fn outcome(&self) -> NodeStatus {
        self.outcome
    }

    /// Returns the status of a node.
    pub fn status(&self, node: usize) -> NodeStatus {
        self.records[node].status
    }

    /// Returns the status that an idle node had before.
    /// Idle if it had none, or the tree was restored since.
    ///
    /// For other nodes that of an earlier time.
    pub fn last_status(&self, node: usize) -> NodeStatus {
        self.last[node]
    }

    /// Returns the entries that have a value: path, name and value.
    /// The path of the sub-tree is empty for the main tree.
    pub fn board(&self) -> impl Iterator<Item = (&str, &str, &BoardValue)> {
        let entries = self.tree.entries.iter().zip(&self.tree.entry_names).enumerate();
        entries.filter_map(|(slot, (entry, start))| {
            let value = self.values.get(slot)?;
            Some((&entry[..start.saturating_sub(1)], &entry[*start..], value))
        })
    }

    /// Returns the value of an entry, by its name in [`BehaviorTree::entries`].
    pub fn entry(&self, name: &str) -> Option<&BoardValue> {
        self.values.get(self.slot(name)?)
    }

    /// Writes an entry; `false` if no node of the tree reads or writes it.
    pub fn set_entry(&mut self, name: &str, value: BoardValue) -> bool {
        match self.slot(name) {
            Some(slot) => {
                self.values.set(slot, value);
                true
            }
            None => false,
        }
    }

    fn slot(&self, name: &str) -> Option<usize> {
        self.tree.entries.iter().position(|own| own == name)
    }

    fn run<'a, H: TreeHost>(
        &'a mut self,
        tree: &'a BehaviorTree,
        now: u64,
        host: &'a mut H,
    ) -> TreeRun<'a, H> {
        TreeRun {
            tree,
            records: &mut self.records,
            values: &mut self.values,
            last: &mut self.last,
            wants_tick: &mut self.wants_tick,
            now,
            host,
        }
    }
}

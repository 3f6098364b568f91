//! Node's tick and its halt.

use serde::{Deserialize, Serialize};

use super::TreeHost;
use crate::entries::EntryValues;
use crate::error::TickError;
use crate::model::LeafKind;
use crate::ports::{LeafPorts, PortBinding};
use crate::script::{ScriptBoard, TreeScript, keep_type};
use crate::tree::{BehaviorTree, NodeOperation, NodeStatus};
use crate::value::BoardValue;

/// State of a node; the meaning of a number depends on the node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct NodeRecord {
    pub status: NodeStatus,
    /// Child that is next, or 1 more than the one that runs.
    pub child: u32,
    /// Children that were skipped, those that succeeded, or cycles.
    pub count: u32,
    /// Children that failed.
    pub failures: u32,
    /// True after the start of a timer, a guarded child, or a one-time child.
    /// A guarded child is the child of a precondition.
    pub is_started: bool,
    /// True if its timeout has passed.
    pub is_late: bool,
    /// True if the parallel node above has counted it.
    pub is_counted: bool,
    /// Status that the child of `RunOnce` returned.
    pub result: NodeStatus,
    /// Deadline of a timer, ns.
    pub deadline: u64,
    /// Number of writes seen of the entry that the node waits for.
    /// Or 1 for a loop that has begun.
    pub seen: u64,
}

/// Tick under way.
pub(super) struct TreeRun<'a, H> {
    pub tree: &'a BehaviorTree,
    pub records: &'a mut [NodeRecord],
    pub values: &'a mut EntryValues,
    pub last: &'a mut [NodeStatus],
    pub wants_tick: &'a mut bool,
    pub now: u64,
    pub host: &'a mut H,
}

impl<'a, H: TreeHost> TreeRun<'a, H> {
    /// Ticks a node, with its conditions before and scripts after.
    pub fn execute(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        let status = match self.precondition(node)? {
            Some(status) => status,
            None => self.tick(node)?,
        };
        if let Some(scripts) = &self.tree.nodes[node].scripts {
            let own = match status {
                NodeStatus::Succeeded => &scripts.on_success,
                NodeStatus::Failed => &scripts.on_failure,
                _ => &None,
            };
            self.perform(node, own.as_ref())?;
            self.perform(node, scripts.post.as_ref().filter(|_| status.is_completed()))?;
        }
        if status != NodeStatus::Skipped {
            self.records[node].status = status;
        }
        if self.tree.nodes[node].operation.is_decorator() {
            let child = self.child(node, 0);
            if self.records[child].status.is_completed() {
                self.reset_status(child);
            }
        }
        Ok(status)
    }

    fn precondition(&mut self, node: usize) -> Result<Option<NodeStatus>, TickError> {
        let tree = self.tree;
        let Some(scripts) = &tree.nodes[node].scripts else { return Ok(None) };
        match self.records[node].status {
            NodeStatus::Idle | NodeStatus::Skipped => {
                let ends = [
                    (&scripts.failure_if, NodeStatus::Failed),
                    (&scripts.success_if, NodeStatus::Succeeded),
                    (&scripts.skip_if, NodeStatus::Skipped),
                ];
                for (script, status) in ends {
                    if let Some(script) = script
                        && self.holds(node, script)?
                    {
                        return Ok(Some(status));
                    }
                }
                match &scripts.only_while {
                    Some(script) if !self.holds(node, script)? => Ok(Some(NodeStatus::Skipped)),
                    _ => Ok(None),
                }
            }
            NodeStatus::Running => match &scripts.only_while {
                Some(script) if !self.holds(node, script)? => {
                    self.halt(node)?;
                    Ok(Some(NodeStatus::Skipped))
                }
                _ => Ok(None),
            },
            NodeStatus::Succeeded | NodeStatus::Failed => Ok(None),
        }
    }

    fn tick(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        let tree = self.tree;
        match &tree.nodes[node].operation {
            NodeOperation::AlwaysSuccess => Ok(NodeStatus::Succeeded),
            NodeOperation::AlwaysFailure => Ok(NodeStatus::Failed),
            NodeOperation::SetBlackboard { value, entry } => self.set_entry(node, value, *entry),
            NodeOperation::UnsetBlackboard { entry } => {
                self.values.unset(*entry);
                Ok(NodeStatus::Succeeded)
            }
            NodeOperation::WasUpdated { entry } => Ok(match self.is_updated(node, *entry) {
                true => NodeStatus::Succeeded,
                false => NodeStatus::Failed,
            }),
            NodeOperation::Script(script) => {
                self.perform(node, Some(script))?;
                Ok(NodeStatus::Succeeded)
            }
            NodeOperation::ScriptCondition(script) => Ok(match self.holds(node, script)? {
                true => NodeStatus::Succeeded,
                false => NodeStatus::Failed,
            }),
            NodeOperation::Sleep { milliseconds } => self.sleep(node, milliseconds),
            NodeOperation::Leaf(leaf) => self.leaf(node, *leaf),
            operation if operation.is_decorator() => self.decorate(node, operation),
            operation => self.control(node, operation),
        }
    }

    fn leaf(&mut self, node: usize, index: usize) -> Result<NodeStatus, TickError> {
        let tree = self.tree;
        let leaf = &tree.leaves[index];
        let mut ports = LeafPorts { ports: &leaf.ports, values: self.values };
        let status = match (leaf.kind, self.records[node].status) {
            (LeafKind::Condition, _) => self.host.condition(index, leaf, &mut ports),
            (LeafKind::Action, NodeStatus::Idle | NodeStatus::Skipped) => {
                self.host.start(index, leaf, &mut ports)
            }
            (LeafKind::Action, NodeStatus::Running) => self.host.progress(index, leaf, &mut ports),
            (LeafKind::Action, completed) => completed,
        };
        match status {
            NodeStatus::Idle => Err(self.error(node, "expected an answer of the host, found `Idle`")),
            NodeStatus::Skipped => {
                // It does not run any more.
                self.reset_status(node);
                Ok(status)
            }
            status => Ok(status),
        }
    }

    fn sleep(&mut self, node: usize, milliseconds: &PortBinding) -> Result<NodeStatus, TickError> {
        match self.records[node].status {
            NodeStatus::Idle | NodeStatus::Skipped => {
                let deadline = self.deadline(node, milliseconds, "msec")?;
                self.records[node].deadline = deadline;
            }
            NodeStatus::Running => {}
            completed => return Ok(completed),
        }
        Ok(match self.now >= self.records[node].deadline {
            true => NodeStatus::Succeeded,
            false => NodeStatus::Running,
        })
    }

    fn set_entry(&mut self, node: usize, value: &PortBinding, entry: usize) -> Result<NodeStatus, TickError> {
        let Some(value) = value.read(self.values).cloned() else {
            return match value {
                PortBinding::Entry(slot) => {
                    let name = &self.tree.entries[*slot];
                    Err(self.error(node, format!("the entry `{name}` of the port `value` has no value yet")))
                }
                PortBinding::Literal(_) => Ok(NodeStatus::Failed),
            };
        };
        self.assign(node, entry, value)?;
        Ok(NodeStatus::Succeeded)
    }

    /// Writes an entry, which keeps its type.
    pub fn assign(&mut self, node: usize, entry: usize, value: BoardValue) -> Result<(), TickError> {
        let value = keep_type(self.values.get(entry), value, &self.tree.enumerations).map_err(|value| {
            let name = &self.tree.entries[entry];
            self.error(
                node,
                format!("the entry `{name}` is a number, expected one, found the text '{value}'"),
            )
        })?;
        self.values.set(entry, value);
        Ok(())
    }

    /// Resets a child, and halts it if it runs.
    pub fn halt_child(&mut self, child: usize) -> Result<(), TickError> {
        if self.records[child].status == NodeStatus::Running {
            self.halt(child)?;
        }
        self.reset_status(child);
        Ok(())
    }

    /// Resets a node to idle.
    pub fn reset_status(&mut self, node: usize) {
        let status = std::mem::take(&mut self.records[node].status);
        if status != NodeStatus::Idle {
            self.last[node] = status;
        }
    }

    /// Resets the children of a node, and halts those that run.
    pub fn halt_children(&mut self, node: usize) -> Result<(), TickError> {
        let tree = self.tree;
        tree.nodes[node].children.iter().try_for_each(|child| self.halt_child(*child))
    }

    /// Halts a node and all below, and performs its script for that.
    fn halt(&mut self, node: usize) -> Result<(), TickError> {
        let tree = self.tree;
        let own = &tree.nodes[node];
        if let NodeOperation::Leaf(index) = own.operation
            && self.records[node].status == NodeStatus::Running
            && tree.leaves[index].kind == LeafKind::Action
        {
            self.host.halt(index, &tree.leaves[index]);
        }
        if let NodeOperation::TryCatch { on_halt } = &own.operation {
            self.catch_on_halt(node, on_halt)?;
        }
        let old = self.records[node];
        self.reset_status(node);
        self.records[node] = match own.operation {
            // It continues where it was.
            NodeOperation::SequenceWithMemory => {
                NodeRecord { child: old.child, count: old.count, ..NodeRecord::default() }
            }
            // A node that has run once stays so.
            NodeOperation::RunOnce { .. } => {
                NodeRecord { is_started: old.is_started, result: old.result, ..NodeRecord::default() }
            }
            // It begins anew only where it is idle when it is ticked.
            NodeOperation::Loop(_) => NodeRecord { status: NodeStatus::Idle, ..old },
            // A value that was seen is not new.
            NodeOperation::OnUpdate { .. } => NodeRecord { seen: old.seen, ..NodeRecord::default() },
            _ => NodeRecord::default(),
        };
        self.records[node].is_counted = old.is_counted;
        if matches!(own.operation, NodeOperation::Parallel { .. } | NodeOperation::ParallelAll { .. }) {
            self.forget_counted(node);
        }
        self.halt_children(node)?;
        match &own.scripts {
            Some(scripts) => self.perform(node, scripts.on_halted.as_ref()),
            None => Ok(()),
        }
    }

    /// Stops all actions that run and resets all nodes, without scripts.
    pub fn reset(&mut self) {
        let tree = self.tree;
        for (index, leaf) in tree.leaves.iter().enumerate() {
            if leaf.kind == LeafKind::Action && self.records[leaf.node].status == NodeStatus::Running {
                self.host.halt(index, leaf);
            }
        }
        (0..self.records.len()).for_each(|node| self.reset_status(node));
        self.records.fill(NodeRecord::default());
    }

    pub fn child(&self, node: usize, number: usize) -> usize {
        self.tree.nodes[node].children[number]
    }

    fn perform(&mut self, node: usize, script: Option<&TreeScript>) -> Result<(), TickError> {
        let Some(script) = script else { return Ok(()) };
        let result = script.evaluate(&mut self.script_board());
        result.map(|_| ()).map_err(|reason| self.error(node, reason))
    }

    pub fn holds(&mut self, node: usize, script: &TreeScript) -> Result<bool, TickError> {
        let result = script.holds(&mut self.script_board());
        result.map_err(|reason| self.error(node, reason))
    }

    fn script_board(&mut self) -> ScriptBoard<'_> {
        let BehaviorTree { entries: names, enumerations, .. } = self.tree;
        ScriptBoard { values: self.values, names, enumerations }
    }

    /// Returns the integer in a port.
    pub fn integer(&self, node: usize, binding: &PortBinding, port: &str) -> Result<i32, TickError> {
        let value = binding.read(self.values);
        let number = value.and_then(BoardValue::number);
        let is_integer = |number: &f64| *number == f64::from(*number as i32);
        number.filter(is_integer).map(|number| number as i32).ok_or_else(|| {
            let found = value.map_or("none".into(), |value| format!("`{value}`"));
            self.error(node, format!("expected an integer in the port `{port}`, found {found}"))
        })
    }

    /// Returns the truth value in a port.
    pub fn truth(&self, node: usize, binding: &PortBinding, port: &str) -> Result<bool, TickError> {
        let value = binding.read(self.values);
        value.and_then(BoardValue::truth).ok_or_else(|| {
            let found = value.map_or("none".into(), |value| format!("`{value}`"));
            self.error(node, format!("expected true or false in the port `{port}`, found {found}"))
        })
    }

    /// Returns the end of a timer of so many milliseconds.
    pub fn deadline(&self, node: usize, binding: &PortBinding, port: &str) -> Result<u64, TickError> {
        let milliseconds = self.integer(node, binding, port)?;
        let milliseconds = u64::try_from(milliseconds).map_err(|_| {
            self.error(
                node,
                format!("expected no negative number in the port `{port}`, found {milliseconds}"),
            )
        })?;
        Ok(self.now.saturating_add(milliseconds * 1_000_000))
    }

    pub fn error(&self, node: usize, reason: impl Into<String>) -> TickError {
        let own = &self.tree.nodes[node];
        let file = own.file.as_deref().map(Into::into);
        TickError { path: own.path.clone(), file, line: own.line, reason: reason.into() }
    }
}

//! Ticks of decorators.

use super::TreeHost;
use super::node::TreeRun;
use crate::error::TickError;
use crate::ports::PortBinding;
use crate::tree::{LoopQueue, NodeOperation, NodeStatus, TreeLoop};
use crate::value::BoardValue;

impl<H: TreeHost> TreeRun<'_, H> {
    pub fn decorate(&mut self, node: usize, operation: &NodeOperation) -> Result<NodeStatus, TickError> {
        use NodeStatus::{Failed, Running, Succeeded};
        match operation {
            NodeOperation::Inverter => self.map(node, |succeeded| if succeeded { Failed } else { Succeeded }),
            NodeOperation::ForceSuccess => self.map(node, |_| Succeeded),
            NodeOperation::ForceFailure => self.map(node, |_| Failed),
            NodeOperation::KeepRunningUntilFailure => {
                let status = self.map(node, |succeeded| if succeeded { Running } else { Failed })?;
                Ok(if status == NodeStatus::Skipped { Running } else { status })
            }
            NodeOperation::Repeat { count } => self.cycle(node, count, "num_cycles", Succeeded),
            NodeOperation::Retry { count } => self.cycle(node, count, "num_attempts", Failed),
            NodeOperation::Delay { milliseconds } => self.delay(node, milliseconds),
            NodeOperation::Timeout { milliseconds } => self.timeout(node, milliseconds),
            NodeOperation::RunOnce { then_skip } => self.run_once(node, then_skip),
            NodeOperation::Precondition { condition, otherwise } => {
                if !self.records[node].is_started && !self.holds(node, condition)? {
                    return Ok(*otherwise);
                }
                self.records[node].is_started = true;
                let status = self.execute_child(node)?;
                self.records[node].is_started = !status.is_completed();
                Ok(status)
            }
            NodeOperation::Loop(own) => self.item_loop(node, own),
            NodeOperation::OnUpdate { entry, otherwise } => self.on_update(node, *entry, *otherwise),
            NodeOperation::SubTree => {
                if self.records[node].status == NodeStatus::Idle {
                    self.records[node].status = Running;
                }
                self.execute_child(node)
            }
            // No other has one child.
            _ => Err(self.error(node, "expected a decorator")),
        }
    }

    /// Ticks the child, and resets it when it has completed.
    pub fn execute_child(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        let child = self.child(node, 0);
        let status = self.execute(child)?;
        if status.is_completed() {
            self.halt_child(child)?;
        }
        Ok(status)
    }

    /// Ticks the child, and returns another status when it has succeeded or failed.
    fn map(&mut self, node: usize, other: fn(bool) -> NodeStatus) -> Result<NodeStatus, TickError> {
        self.records[node].status = NodeStatus::Running;
        Ok(match self.execute_child(node)? {
            NodeStatus::Succeeded => other(true),
            NodeStatus::Failed => other(false),
            status => status,
        })
    }

    /// Ticks the child again as long as it ends with `passing`, once in a tick.
    fn cycle(
        &mut self,
        node: usize,
        count: &PortBinding,
        port: &str,
        passing: NodeStatus,
    ) -> Result<NodeStatus, TickError> {
        let child = self.child(node, 0);
        let mut most = self.integer(node, count, port)?;
        self.records[node].status = NodeStatus::Running;
        while most == -1 || i64::from(self.records[node].count) < i64::from(most) {
            let was = self.records[child].status;
            let status = self.execute(child)?;
            if status == NodeStatus::Running {
                return Ok(status);
            }
            self.halt_child(child)?;
            if status == NodeStatus::Skipped {
                return Ok(status);
            }
            if status != passing {
                self.records[node].count = 0;
                return Ok(status);
            }
            self.records[node].count = self.records[node].count.saturating_add(1);
            if passing == NodeStatus::Failed {
                // The child may have changed it.
                most = self.integer(node, count, port)?;
            }
            let goes_on = most == -1 || i64::from(self.records[node].count) < i64::from(most);
            if was == NodeStatus::Idle && goes_on {
                *self.wants_tick = true;
                return Ok(NodeStatus::Running);
            }
        }
        // It runs where the count has become smaller meanwhile.
        self.halt_child(child)?;
        self.records[node].count = 0;
        Ok(passing)
    }

    fn delay(&mut self, node: usize, milliseconds: &PortBinding) -> Result<NodeStatus, TickError> {
        if !self.records[node].is_started {
            let deadline = self.deadline(node, milliseconds, "delay_msec")?;
            let record = &mut self.records[node];
            (record.is_started, record.deadline, record.status) = (true, deadline, NodeStatus::Running);
        }
        if self.now < self.records[node].deadline {
            return Ok(NodeStatus::Running);
        }
        let status = self.execute_child(node)?;
        if status.is_completed() {
            self.records[node].is_started = false;
        }
        Ok(status)
    }

    /// Halts the child when the time is over.
    ///
    /// A timeout of 0 never passes. One that passes while the child does not run has no effect.
    fn timeout(&mut self, node: usize, milliseconds: &PortBinding) -> Result<NodeStatus, TickError> {
        let child = self.child(node, 0);
        if !self.records[node].is_started {
            let deadline = self.deadline(node, milliseconds, "msec")?;
            let record = &mut self.records[node];
            (record.is_started, record.deadline, record.status) = (true, deadline, NodeStatus::Running);
            record.is_late = deadline == self.now;
        } else if !self.records[node].is_late && self.now >= self.records[node].deadline {
            self.records[node].is_late = true;
            if self.records[child].status == NodeStatus::Running {
                self.records[node].is_started = false;
                self.halt_child(child)?;
                return Ok(NodeStatus::Failed);
            }
        }
        let status = self.execute_child(node)?;
        if status.is_completed() {
            self.records[node].is_started = false;
        }
        Ok(status)
    }

    fn run_once(&mut self, node: usize, then_skip: &PortBinding) -> Result<NodeStatus, TickError> {
        if self.records[node].is_started {
            let skips = self.truth(node, then_skip, "then_skip")?;
            return Ok(if skips { NodeStatus::Skipped } else { self.records[node].result });
        }
        self.records[node].status = NodeStatus::Running;
        let status = self.execute_child(node)?;
        if status.is_completed() {
            (self.records[node].is_started, self.records[node].result) = (true, status);
        }
        Ok(status)
    }

    /// Ticks the child with the next value, once in a tick.
    /// It ends when the child fails or no value is left.
    pub fn item_loop(&mut self, node: usize, own: &TreeLoop) -> Result<NodeStatus, TickError> {
        if self.records[node].status == NodeStatus::Idle {
            let record = &mut self.records[node];
            (record.count, record.is_started, record.seen) = (0, false, 1);
            if let LoopQueue::Entry { entry, kept } = own.queue {
                match self.values.get(entry) {
                    Some(queue) => self.values.set(kept, BoardValue::Text(queue.to_string())),
                    None => self.values.unset(kept),
                }
            }
        }
        if !self.records[node].is_started {
            let Some(value) = self.next_item(node, own)? else { return Ok(own.if_empty) };
            self.records[node].count = self.records[node].count.saturating_add(1);
            if let Some(entry) = own.value {
                self.assign(node, entry, value)?;
            }
        }
        if self.records[node].status == NodeStatus::Idle {
            self.records[node].status = NodeStatus::Running;
        }
        let status = self.execute_child(node)?;
        self.records[node].is_started = status == NodeStatus::Running;
        Ok(if status == NodeStatus::Failed { status } else { NodeStatus::Running })
    }

    fn next_item(&self, node: usize, own: &TreeLoop) -> Result<Option<BoardValue>, TickError> {
        if self.records[node].seen == 0 {
            return Ok(None);
        }
        let number = self.records[node].count as usize;
        match &own.queue {
            LoopQueue::Items(items) => Ok(items.get(number).cloned()),
            LoopQueue::Entry { kept, .. } => {
                let Some(BoardValue::Text(text)) = self.values.get(*kept) else { return Ok(None) };
                let item = own.kind.items(text).nth(number).transpose();
                item.map_err(|reason| self.error(node, format!("port `queue`: {reason}")))
            }
        }
    }

    /// Ticks the child if the entry was written since it was ticked last.
    pub fn on_update(
        &mut self,
        node: usize,
        entry: usize,
        otherwise: NodeStatus,
    ) -> Result<NodeStatus, TickError> {
        if !self.records[node].is_started && !self.is_updated(node, entry) {
            return Ok(otherwise);
        }
        let status = self.execute(self.child(node, 0))?;
        self.records[node].is_started = status == NodeStatus::Running;
        Ok(status)
    }

    /// Returns whether an entry was written since the last call.
    pub fn is_updated(&mut self, node: usize, entry: usize) -> bool {
        let writes = self.values.writes(entry);
        let is_there = self.values.get(entry).is_some();
        // An entry without a value keeps the seen count.
        is_there && std::mem::replace(&mut self.records[node].seen, writes) != writes
    }
}

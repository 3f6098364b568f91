//! Ticks of control nodes.

use super::TreeHost;
use super::node::TreeRun;
use crate::build::too_many_children;
use crate::error::TickError;
use crate::ports::PortBinding;
use crate::tree::{NodeOperation, NodeStatus};

impl<H: TreeHost> TreeRun<'_, H> {
    pub fn control(&mut self, node: usize, operation: &NodeOperation) -> Result<NodeStatus, TickError> {
        use NodeStatus::{Failed, Succeeded};
        match operation {
            NodeOperation::Sequence { is_async } => self.in_turn(node, Succeeded, *is_async),
            NodeOperation::Fallback { is_async } => self.in_turn(node, Failed, *is_async),
            NodeOperation::SequenceWithMemory => self.sequence_with_memory(node),
            NodeOperation::ReactiveSequence => self.reactive(node, Succeeded),
            NodeOperation::ReactiveFallback => self.reactive(node, Failed),
            NodeOperation::Parallel { successes, failures } => self.parallel(node, successes, failures),
            NodeOperation::ParallelAll { failures } => self.parallel_all(node, failures),
            NodeOperation::IfThenElse => self.if_then_else(node),
            NodeOperation::WhileDoElse => self.while_do_else(node),
            NodeOperation::TryCatch { .. } => self.try_catch(node),
            NodeOperation::Switch { variable, cases } => self.switch(node, variable, cases),
            // No other has several children.
            _ => Err(self.error(node, "expected a control node")),
        }
    }

    /// Ticks children in turn as long as they end with `passing`.
    ///
    /// A sequence passes on success, a fallback on failure.
    fn in_turn(&mut self, node: usize, passing: NodeStatus, is_async: bool) -> Result<NodeStatus, TickError> {
        let count = self.begin_turn(node);
        while (self.records[node].child as usize) < count {
            let child = self.child(node, self.records[node].child as usize);
            let was = self.records[child].status;
            match self.execute(child)? {
                NodeStatus::Running => return Ok(NodeStatus::Running),
                NodeStatus::Skipped => self.pass_skipped(node),
                status if status == passing => {
                    if self.pass(node, is_async && was == NodeStatus::Idle, count) {
                        return Ok(NodeStatus::Running);
                    }
                }
                status => {
                    self.halt_children(node)?;
                    self.records[node].child = 0;
                    return Ok(status);
                }
            }
        }
        self.end_turn(node, count, passing)
    }

    fn sequence_with_memory(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        let count = self.begin_turn(node);
        while (self.records[node].child as usize) < count {
            let child = self.child(node, self.records[node].child as usize);
            let was = self.records[child].status;
            match self.execute(child)? {
                NodeStatus::Failed => {
                    for later in self.records[node].child as usize..count {
                        self.halt_child(self.child(node, later))?;
                    }
                    return Ok(NodeStatus::Failed);
                }
                NodeStatus::Skipped => self.pass_skipped(node),
                NodeStatus::Succeeded => {
                    if self.pass(node, was == NodeStatus::Idle, count) {
                        return Ok(NodeStatus::Running);
                    }
                }
                NodeStatus::Running | NodeStatus::Idle => return Ok(NodeStatus::Running),
            }
        }
        self.end_turn(node, count, NodeStatus::Succeeded)
    }

    fn begin_turn(&mut self, node: usize) -> usize {
        let record = &mut self.records[node];
        if record.status != NodeStatus::Running {
            record.count = 0;
        }
        record.status = NodeStatus::Running;
        self.tree.nodes[node].children.len()
    }

    /// Advances to the next child; returns true if it waits for the next tick.
    fn pass(&mut self, node: usize, lets_others_run: bool, count: usize) -> bool {
        self.records[node].child += 1;
        let must_wait = lets_others_run && (self.records[node].child as usize) < count;
        *self.wants_tick |= must_wait;
        must_wait
    }

    fn pass_skipped(&mut self, node: usize) {
        self.records[node].child += 1;
        self.records[node].count = self.records[node].count.saturating_add(1);
    }

    fn end_turn(&mut self, node: usize, count: usize, passed: NodeStatus) -> Result<NodeStatus, TickError> {
        let is_skipped = self.records[node].count as usize == count;
        self.halt_children(node)?;
        (self.records[node].child, self.records[node].count) = (0, 0);
        Ok(if is_skipped { NodeStatus::Skipped } else { passed })
    }

    fn reactive(&mut self, node: usize, passing: NodeStatus) -> Result<NodeStatus, TickError> {
        self.records[node].status = NodeStatus::Running;
        let tree = self.tree;
        let children = &tree.nodes[node].children;
        let mut is_skipped = true;
        for child in children {
            match self.execute(*child)? {
                NodeStatus::Running => {
                    let others = children.iter().filter(|other| *other != child);
                    others.into_iter().try_for_each(|other| self.halt_child(*other))?;
                    return Ok(NodeStatus::Running);
                }
                NodeStatus::Skipped => self.halt_child(*child)?,
                status if status == passing => is_skipped = false,
                status => {
                    self.halt_children(node)?;
                    return Ok(status);
                }
            }
        }
        self.halt_children(node)?;
        Ok(if is_skipped { NodeStatus::Skipped } else { passing })
    }

    fn parallel(
        &mut self,
        node: usize,
        successes: &PortBinding,
        failures: &PortBinding,
    ) -> Result<NodeStatus, TickError> {
        let tree = self.tree;
        let children = &tree.nodes[node].children;
        let is_relative = self.integer(node, successes, "success_count")? < 0;
        let most_failures = self.threshold(node, failures, "failure_count")?;
        let least_successes = self.threshold(node, successes, "success_count")?;
        self.records[node].status = NodeStatus::Running;
        let mut skipped = 0;
        for child in children {
            if !self.records[*child].is_counted {
                match self.execute(*child)? {
                    NodeStatus::Skipped => skipped += 1,
                    NodeStatus::Succeeded => {
                        self.records[*child].is_counted = true;
                        self.records[node].count = self.records[node].count.saturating_add(1);
                    }
                    NodeStatus::Failed => {
                        self.records[*child].is_counted = true;
                        self.records[node].failures = self.records[node].failures.saturating_add(1);
                    }
                    NodeStatus::Running | NodeStatus::Idle => {}
                }
            }
            let (succeeded, failed) =
                (self.records[node].count as usize, self.records[node].failures as usize);
            let is_done =
                succeeded >= least_successes || is_relative && succeeded + skipped >= least_successes;
            let can_not_succeed =
                children.len().saturating_sub(failed) < least_successes || failed == most_failures;
            if is_done || can_not_succeed {
                self.forget_counted(node);
                self.halt_children(node)?;
                return Ok(if is_done { NodeStatus::Succeeded } else { NodeStatus::Failed });
            }
        }
        Ok(if skipped == children.len() { NodeStatus::Skipped } else { NodeStatus::Running })
    }

    fn parallel_all(&mut self, node: usize, failures: &PortBinding) -> Result<NodeStatus, TickError> {
        let tree = self.tree;
        let children = &tree.nodes[node].children;
        let most_failures = self.threshold(node, failures, "max_failures")?;
        self.records[node].status = NodeStatus::Running;
        let (mut skipped, mut completed) = (0, 0);
        for child in children {
            if !self.records[*child].is_counted {
                let status = self.execute(*child)?;
                skipped += usize::from(status == NodeStatus::Skipped);
                let failed = u32::from(status == NodeStatus::Failed);
                self.records[node].failures = self.records[node].failures.saturating_add(failed);
                self.records[*child].is_counted = status.is_completed();
            }
            completed += usize::from(self.records[*child].is_counted);
        }
        if skipped == children.len() {
            return Ok(NodeStatus::Skipped);
        }
        if skipped + completed < children.len() {
            return Ok(NodeStatus::Running);
        }
        let failed = self.records[node].failures as usize;
        self.halt_children(node)?;
        self.forget_counted(node);
        Ok(if failed >= most_failures { NodeStatus::Failed } else { NodeStatus::Succeeded })
    }

    /// Returns the number of children in a port; -1 means all.
    fn threshold(&self, node: usize, binding: &PortBinding, port: &str) -> Result<usize, TickError> {
        let count = self.tree.nodes[node].children.len();
        let number = i64::from(self.integer(node, binding, port)?);
        let number = if number < 0 { (count as i64 + number + 1).max(0) } else { number };
        match usize::try_from(number) {
            Ok(number) if number <= count => Ok(number),
            _ => Err(self.error(node, too_many_children(count, port, number as f64))),
        }
    }

    /// Forgets which children of a parallel node have ended.
    pub fn forget_counted(&mut self, node: usize) {
        let tree = self.tree;
        for child in &tree.nodes[node].children {
            self.records[*child].is_counted = false;
        }
        (self.records[node].count, self.records[node].failures) = (0, 0);
    }

    fn if_then_else(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        self.records[node].status = NodeStatus::Running;
        if self.records[node].child == 0 {
            let has_else = self.tree.nodes[node].children.len() == 3;
            match self.execute(self.child(node, 0))? {
                NodeStatus::Running | NodeStatus::Idle => return Ok(NodeStatus::Running),
                NodeStatus::Succeeded => self.records[node].child = 1,
                NodeStatus::Failed if has_else => self.records[node].child = 2,
                NodeStatus::Failed => return Ok(NodeStatus::Failed),
                NodeStatus::Skipped => {
                    self.halt_children(node)?;
                    return Ok(NodeStatus::Skipped);
                }
            }
        }
        let status = self.execute(self.child(node, self.records[node].child as usize))?;
        if status != NodeStatus::Running {
            self.halt_children(node)?;
            self.records[node].child = 0;
        }
        Ok(status)
    }

    fn while_do_else(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        self.records[node].status = NodeStatus::Running;
        let has_else = self.tree.nodes[node].children.len() == 3;
        let status = match self.execute(self.child(node, 0))? {
            NodeStatus::Running | NodeStatus::Idle => return Ok(NodeStatus::Running),
            NodeStatus::Succeeded => {
                if has_else {
                    self.halt_child(self.child(node, 2))?;
                }
                self.execute(self.child(node, 1))?
            }
            NodeStatus::Failed if has_else => {
                self.halt_child(self.child(node, 1))?;
                self.execute(self.child(node, 2))?
            }
            other => other,
        };
        if status != NodeStatus::Running {
            self.halt_children(node)?;
        }
        Ok(status)
    }

    fn switch(
        &mut self,
        node: usize,
        variable: &PortBinding,
        cases: &[PortBinding],
    ) -> Result<NodeStatus, TickError> {
        let value = variable.read(self.values);
        let is_case = |case: &PortBinding| match (value, case.read(self.values)) {
            (Some(value), Some(case)) => value.is_same(case, &self.tree.enumerations),
            _ => false,
        };
        let matching = cases.iter().position(is_case).unwrap_or(cases.len());
        let running = self.records[node].child as usize;
        if running > 0 && running - 1 != matching {
            self.halt_child(self.child(node, running - 1))?;
        }
        let status = self.execute(self.child(node, matching))?;
        self.records[node].child = match status {
            NodeStatus::Running => matching as u32 + 1,
            NodeStatus::Skipped => 0,
            _ => {
                self.halt_children(node)?;
                0
            }
        };
        Ok(status)
    }

    /// Ticks all children but the last in turn.
    /// It ticks the last one when one of them has failed.
    pub fn try_catch(&mut self, node: usize) -> Result<NodeStatus, TickError> {
        if self.records[node].status != NodeStatus::Running {
            (self.records[node].count, self.records[node].is_started) = (0, false);
        }
        self.records[node].status = NodeStatus::Running;
        let tried = self.tree.nodes[node].children.len() - 1;
        while !self.records[node].is_started && (self.records[node].child as usize) < tried {
            match self.execute(self.child(node, self.records[node].child as usize))? {
                NodeStatus::Running | NodeStatus::Idle => return Ok(NodeStatus::Running),
                NodeStatus::Failed => {
                    self.halt_children(node)?;
                    (self.records[node].child, self.records[node].is_started) = (0, true);
                }
                status => {
                    let record = &mut self.records[node];
                    record.child += 1;
                    record.count = record.count.saturating_add(u32::from(status == NodeStatus::Skipped));
                }
            }
        }
        let has_caught = self.records[node].is_started;
        if has_caught && self.execute(self.child(node, tried))? == NodeStatus::Running {
            return Ok(NodeStatus::Running);
        }
        let is_skipped = self.records[node].count as usize == tried;
        self.halt_children(node)?;
        let record = &mut self.records[node];
        (record.child, record.count, record.is_started) = (0, 0, false);
        Ok(match (has_caught, is_skipped) {
            (true, _) => NodeStatus::Failed,
            (false, true) => NodeStatus::Skipped,
            (false, false) => NodeStatus::Succeeded,
        })
    }

    /// Ticks the last child once when the others are halted, if the node wants that.
    pub fn catch_on_halt(&mut self, node: usize, on_halt: &PortBinding) -> Result<(), TickError> {
        let record = self.records[node];
        if record.is_started
            || record.status != NodeStatus::Running
            || !self.truth(node, on_halt, "catch_on_halt")?
        {
            return Ok(());
        }
        self.halt_children(node)?;
        let last = self.child(node, self.tree.nodes[node].children.len() - 1);
        self.execute(last)?;
        // A child that would take longer is halted.
        self.halt_child(last)
    }
}

//! Defects of a tree, found before it runs.

use std::path::PathBuf;

use crate::model::LeafKind;
use crate::ports::PortBinding;
use crate::script::{Expression, TreeScript};
use crate::tree::{BehaviorTree, LoopQueue, NodeOperation, NodeScripts, NodeStatus};

/// Kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TreeFindingKind {
    /// Action or a condition that the robot does not have.
    UnknownLeaf,
    /// Node that is never ticked.
    DeadNode,
    /// Entry of the blackboard without a writer.
    UnsetEntry,
    /// Tree that neither succeeds nor fails: it runs until it is stopped.
    NoEnd,
}

impl TreeFindingKind {
    /// Returns whether the tree can't work.
    pub fn is_error(self) -> bool {
        self == Self::UnknownLeaf
    }

    /// Returns the name, such as `dead node`.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnknownLeaf => "unknown leaf",
            Self::DeadNode => "dead node",
            Self::UnsetEntry => "unset entry",
            Self::NoEnd => "no end",
        }
    }
}

/// Defect of a tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeFinding {
    /// Kind.
    pub kind: TreeFindingKind,
    /// File, if the tree's file includes that.
    pub file: Option<PathBuf>,
    /// Line in the file, from 1.
    pub line: usize,
    /// Description of the defect.
    pub text: String,
}

/// Predicate: true if the robot has an action or a condition.
pub type KnownLeaf<'a> = dyn Fn(LeafKind, &str) -> bool + 'a;

/// Finds defects of a tree, in the order of their kinds and of the file.
///
/// `is_known` returns whether the robot has an action or a condition; `None` if it has every one.
pub fn check_tree(tree: &BehaviorTree, is_known: Option<&KnownLeaf<'_>>) -> Vec<TreeFinding> {
    let mut findings = Vec::new();
    for leaf in tree.leaves().iter().filter(|leaf| is_known.is_some_and(|known| !known(leaf.kind, &leaf.id)))
    {
        let kind = if leaf.kind == LeafKind::Action { "action" } else { "condition" };
        let text = format!("the {kind} `{}` is unknown", leaf.id);
        let finding = finding(tree, leaf.node, TreeFindingKind::UnknownLeaf, text);
        // A sub-tree may be there several times.
        if !findings.contains(&finding) {
            findings.push(finding);
        }
    }
    let outcomes = possible_outcomes(tree);
    dead_nodes(tree, &outcomes, &mut findings);
    unset_entries(tree, &mut findings);
    if outcomes[0] & (SUCCESS | FAILURE) == 0 {
        let text = "the tree neither succeeds nor fails: it runs until it is stopped".into();
        findings.push(finding(tree, 0, TreeFindingKind::NoEnd, text));
    }
    findings
}

fn finding(tree: &BehaviorTree, node: usize, kind: TreeFindingKind, text: String) -> TreeFinding {
    let node = &tree.nodes[node];
    TreeFinding { kind, file: node.file().map(Into::into), line: node.line, text }
}

const SUCCESS: u8 = 1;
const FAILURE: u8 = 2;
const RUNNING: u8 = 4;
const SKIPPED: u8 = 8;
const ANY: u8 = SUCCESS | FAILURE | RUNNING | SKIPPED;

/// Statuses that each node may return, at least.
fn possible_outcomes(tree: &BehaviorTree) -> Vec<u8> {
    let mut outcomes = vec![0; tree.nodes.len()];
    // Children have greater numbers.
    for index in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[index];
        let children: Vec<u8> = node.children.iter().map(|child| outcomes[*child]).collect();
        let mut own = operation_outcomes(&node.operation, &children);
        if let Some(scripts) = &node.scripts {
            own |= if scripts.failure_if.is_some() { FAILURE } else { 0 };
            own |= if scripts.success_if.is_some() { SUCCESS } else { 0 };
            own |= if scripts.skip_if.is_some() || scripts.only_while.is_some() { SKIPPED } else { 0 };
        }
        outcomes[index] = own;
    }
    outcomes
}

fn operation_outcomes(operation: &NodeOperation, children: &[u8]) -> u8 {
    let ends = SUCCESS | FAILURE;
    let first = children.first().copied().unwrap_or(0);
    match operation {
        NodeOperation::AlwaysSuccess | NodeOperation::UnsetBlackboard { .. } | NodeOperation::Script(_) => {
            SUCCESS
        }
        NodeOperation::AlwaysFailure => FAILURE,
        NodeOperation::SetBlackboard { .. } => SUCCESS,
        NodeOperation::ScriptCondition(_) => ends,
        NodeOperation::WasUpdated { .. } => ends,
        NodeOperation::Sleep { .. } => SUCCESS | RUNNING,
        NodeOperation::Sequence { .. }
        | NodeOperation::SequenceWithMemory
        | NodeOperation::ReactiveSequence => in_turn(operation, children, SUCCESS),
        NodeOperation::Fallback { .. } | NodeOperation::ReactiveFallback => {
            in_turn(operation, children, FAILURE)
        }
        NodeOperation::Inverter => first & !ends | (first & SUCCESS) << 1 | (first & FAILURE) >> 1,
        NodeOperation::ForceSuccess => first & !ends | if first & ends != 0 { SUCCESS } else { 0 },
        NodeOperation::ForceFailure => first & !ends | if first & ends != 0 { FAILURE } else { 0 },
        NodeOperation::KeepRunningUntilFailure => first & FAILURE | RUNNING,
        NodeOperation::Repeat { count } if is_endless(count) => first & !SUCCESS | RUNNING,
        NodeOperation::Retry { count } if is_endless(count) => first & !FAILURE | RUNNING,
        NodeOperation::Loop(own) => first & FAILURE | RUNNING | bit(own.if_empty),
        NodeOperation::OnUpdate { otherwise, .. } => first | bit(*otherwise),
        NodeOperation::SubTree => first,
        NodeOperation::Precondition { otherwise, .. } => first | bit(*otherwise),
        _ => ANY,
    }
}

fn in_turn(operation: &NodeOperation, children: &[u8], passing: u8) -> u8 {
    let reached = reached_in_turn(children, passing);
    let mut own = if children.len() > 1 && !matches!(operation, NodeOperation::Sequence { is_async: false }) {
        RUNNING
    } else {
        0
    };
    for (child, is_reached) in children.iter().zip(&reached) {
        own |= if *is_reached { child & !(passing | SKIPPED) } else { 0 };
    }
    let is_passed =
        children.last().is_some_and(|last| last & (passing | SKIPPED) != 0) && reached.last() == Some(&true);
    if is_passed {
        own |= if children.iter().any(|child| child & passing != 0) { passing } else { 0 };
        own |= if children.iter().all(|child| child & SKIPPED != 0) { SKIPPED } else { 0 };
    }
    own
}

/// Returns for each child whether a sequence or a fallback can reach it.
fn reached_in_turn(children: &[u8], passing: u8) -> Vec<bool> {
    let mut is_reached = true;
    let next = |child: &u8| {
        let own = is_reached;
        is_reached &= child & (passing | SKIPPED) != 0;
        own
    };
    children.iter().map(next).collect()
}

/// Returns for each child whether a `TryCatch` can reach it.
fn reached_in_try(children: &[u8], catches_halts: bool) -> Vec<bool> {
    let Some((_, tried)) = children.split_last() else { return Vec::new() };
    let mut reached = reached_in_turn(tried, SUCCESS);
    let can_fail = tried.iter().zip(&reached).any(|(child, is_reached)| *is_reached && child & FAILURE != 0);
    reached.push(can_fail || catches_halts);
    reached
}

fn is_false(port: &PortBinding) -> bool {
    matches!(port, PortBinding::Literal(value) if value.truth() == Some(false))
}

fn is_endless(count: &PortBinding) -> bool {
    matches!(count, PortBinding::Literal(value) if value.number() == Some(-1.0))
}

fn bit(status: NodeStatus) -> u8 {
    match status {
        NodeStatus::Succeeded => SUCCESS,
        NodeStatus::Failed => FAILURE,
        NodeStatus::Running => RUNNING,
        NodeStatus::Skipped => SKIPPED,
        NodeStatus::Idle => 0,
    }
}

fn dead_nodes(tree: &BehaviorTree, outcomes: &[u8], findings: &mut Vec<TreeFinding>) {
    let mut alive = vec![true; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        let children: Vec<u8> = node.children.iter().map(|child| outcomes[*child]).collect();
        let reached = match &node.operation {
            NodeOperation::Sequence { .. }
            | NodeOperation::SequenceWithMemory
            | NodeOperation::ReactiveSequence => reached_in_turn(&children, SUCCESS),
            NodeOperation::Fallback { .. } | NodeOperation::ReactiveFallback => {
                reached_in_turn(&children, FAILURE)
            }
            NodeOperation::TryCatch { on_halt } => reached_in_try(&children, !is_false(on_halt)),
            NodeOperation::IfThenElse | NodeOperation::WhileDoElse => {
                let condition = children[0];
                vec![true, condition & SUCCESS != 0, condition & FAILURE != 0]
            }
            _ => vec![true; children.len()],
        };
        for (child, is_reached) in node.children.iter().zip(reached) {
            alive[*child] = alive[index] && is_reached;
            if alive[index] && !is_reached {
                let dead = &tree.nodes[*child];
                let text =
                    format!("`{}` is never ticked, because of the result of the node before it", dead.path);
                findings.push(finding(tree, *child, TreeFindingKind::DeadNode, text));
            }
        }
    }
}

/// Entries that are read and written.
struct EntryUses {
    /// First node that reads it.
    read: Vec<Option<usize>>,
    is_written: Vec<bool>,
}

fn unset_entries(tree: &BehaviorTree, findings: &mut Vec<TreeFinding>) {
    let is_written = tree.initial.iter().map(Option::is_some).collect();
    let mut uses = EntryUses { read: vec![None; tree.entries.len()], is_written };
    for (index, node) in tree.nodes.iter().enumerate() {
        uses.take_operation(&node.operation, index);
        for script in node.scripts.iter().flat_map(|scripts| all_scripts(scripts)) {
            uses.take_script(script, index);
        }
    }
    for leaf in &tree.leaves {
        for port in &leaf.ports {
            let PortBinding::Entry(slot) = port.binding else { continue };
            uses.is_written[slot] |= port.is_written();
            if port.is_read() {
                uses.read[slot].get_or_insert(leaf.node);
            }
        }
    }
    for (slot, node) in uses.read.iter().enumerate() {
        if let Some(node) = node.filter(|_| !uses.is_written[slot]) {
            let text =
                format!("nothing in the tree writes the entry `{}`, which is read", tree.entries[slot]);
            findings.push(finding(tree, node, TreeFindingKind::UnsetEntry, text));
        }
    }
}

fn all_scripts(scripts: &NodeScripts) -> impl Iterator<Item = &TreeScript> {
    [&scripts.failure_if, &scripts.success_if, &scripts.skip_if, &scripts.only_while]
        .into_iter()
        .chain([&scripts.on_halted, &scripts.on_failure, &scripts.on_success, &scripts.post])
        .flatten()
}

impl EntryUses {
    fn take_operation(&mut self, operation: &NodeOperation, node: usize) {
        match operation {
            NodeOperation::Parallel { successes, failures } => {
                self.take_ports(&[successes, failures], node);
            }
            NodeOperation::ParallelAll { failures: port }
            | NodeOperation::Repeat { count: port }
            | NodeOperation::Retry { count: port }
            | NodeOperation::Delay { milliseconds: port }
            | NodeOperation::Timeout { milliseconds: port }
            | NodeOperation::Sleep { milliseconds: port }
            | NodeOperation::RunOnce { then_skip: port } => self.take_ports(&[port], node),
            NodeOperation::Switch { variable, cases } => {
                self.take_ports(&[variable], node);
                self.take_ports(&cases.iter().collect::<Vec<_>>(), node);
            }
            NodeOperation::TryCatch { on_halt: port } => self.take_ports(&[port], node),
            NodeOperation::Loop(own) => {
                if let LoopQueue::Entry { entry, .. } = own.queue {
                    self.read[entry].get_or_insert(node);
                }
                own.value.into_iter().for_each(|entry| self.is_written[entry] = true);
            }
            NodeOperation::OnUpdate { entry, .. } | NodeOperation::WasUpdated { entry } => {
                self.read[*entry].get_or_insert(node);
            }
            NodeOperation::SetBlackboard { value, entry } => {
                self.take_ports(&[value], node);
                self.is_written[*entry] = true;
            }
            NodeOperation::Precondition { condition: script, .. }
            | NodeOperation::Script(script)
            | NodeOperation::ScriptCondition(script) => self.take_script(script, node),
            _ => {}
        }
    }

    fn take_ports(&mut self, ports: &[&PortBinding], node: usize) {
        for port in ports {
            if let PortBinding::Entry(slot) = port {
                self.read[*slot].get_or_insert(node);
            }
        }
    }

    fn take_script(&mut self, script: &TreeScript, node: usize) {
        script.statements.iter().for_each(|statement| self.take(statement, node));
    }

    fn take(&mut self, expression: &Expression, node: usize) {
        match expression {
            Expression::Number(_) | Expression::Text(_) => {}
            Expression::Entry(slot) => {
                self.read[*slot].get_or_insert(node);
            }
            Expression::Negation(inner) | Expression::Not(inner) | Expression::Complement(inner) => {
                self.take(inner, node);
            }
            Expression::Binary(parts, _) => parts.iter().for_each(|part| self.take(part, node)),
            Expression::Choice(parts) => parts.iter().for_each(|part| self.take(part, node)),
            Expression::Comparison(first, others) => {
                self.take(first, node);
                others.iter().for_each(|(_, other)| self.take(other, node));
            }
            Expression::Assignment(slot, _, value) => {
                self.take(value, node);
                self.is_written[*slot] = true;
            }
        }
    }
}

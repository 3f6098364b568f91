//! View of a behavior tree: its nodes with their status.

use slate_behavior_tree::{BehaviorNode, BehaviorTree, LeafKind, NodeStatus, TreeExecutor, TreeLeaf};

use super::activity::{ActivityWriter, MissionItemStatus, MissionSight};
use super::drawing::{MissionDrawing, MissionElementKind, MissionMark};
use crate::activity_hash::ActivityHash;

/// Returns the leaf of a node, with its number.
pub fn leaf(tree: &BehaviorTree, node: usize) -> Option<(usize, &TreeLeaf)> {
    tree.leaves().iter().enumerate().find(|(_, leaf)| leaf.node() == node)
}

/// Draws the nodes, each with the number that it has in the tree.
pub fn draw(tree: &BehaviorTree) -> MissionDrawing {
    let mut drawing = MissionDrawing::new(tree.name());
    let mut parents = vec![usize::MAX; tree.nodes().len()];
    for (number, node) in tree.nodes().iter().enumerate() {
        node.children().iter().for_each(|child| parents[*child] = number);
        let kind = match leaf(tree, number).map(|(_, leaf)| leaf.kind()) {
            Some(LeafKind::Action) => MissionElementKind::ACTION,
            Some(LeafKind::Condition) => MissionElementKind::CONDITION,
            None if node.children().is_empty() => MissionElementKind::STEP,
            None => MissionElementKind::CONTROL,
        };
        drawing.node(kind, MissionMark::PLAIN, parents[number], &label(node));
    }
    drawing
}

fn label(node: &BehaviorNode) -> String {
    match node.name() == node.tag() {
        true => node.tag().into(),
        false => format!("{}: {}", node.tag(), node.name()),
    }
}

/// Hashes the status of all nodes.
pub fn hash(executor: &TreeExecutor, hash: &mut ActivityHash) {
    (0..executor.tree().nodes().len()).for_each(|node| hash.number(executor.status(node) as u64));
}

/// Describes the nodes that are not idle.
pub fn describe(executor: &TreeExecutor, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
    let tree = executor.tree();
    for node in 0..tree.nodes().len() {
        let status = match executor.status(node) {
            NodeStatus::Idle => continue,
            NodeStatus::Running => MissionItemStatus::RUNNING,
            NodeStatus::Succeeded => MissionItemStatus::SUCCEEDED,
            NodeStatus::Failed => MissionItemStatus::FAILED,
            NodeStatus::Skipped => MissionItemStatus::SKIPPED,
        };
        match leaf(tree, node) {
            Some((_, leaf)) if leaf.kind() == LeafKind::Condition => match seen.conditions.get(leaf.id()) {
                None => activity.element(
                    node,
                    MissionItemStatus::WAITING,
                    0,
                    format_args!("`{}` is unknown", leaf.id()),
                ),
                Some(holds) => activity.element(node, status, 0, format_args!("`{}` is {holds}", leaf.id())),
            },
            Some((index, _)) if seen.actions.runs(index) => {
                activity.element(node, status, 0, format_args!("{}", seen.actions.text(index)));
            }
            _ => activity.element(node, status, 0, format_args!("")),
        }
    }
    let conditions = tree.leaves().iter().filter(|leaf| leaf.kind() == LeafKind::Condition);
    let unknown = conditions.filter(|leaf| seen.conditions.get(leaf.id()).is_none());
    unknown.for_each(|leaf| activity.unknown(leaf.id()));
}

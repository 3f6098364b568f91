//! Defects of a behavior tree.

use std::path::Path;

use serde_json::json;
use slate_behavior_tree::{BehaviorTree, KnownLeaf, LeafKind, LeafModels, TreeFinding, check_tree};

use super::findings::{CheckedMission, MissionFinding};
use crate::failure::Failure;

/// Reads a tree from a file with the models of its actions and conditions.
pub fn read(file: &Path) -> Result<BehaviorTree, Failure> {
    Ok(BehaviorTree::read(file, &LeafModels::default())?)
}

/// Checks a tree, and prints the findings; returns the exit code.
pub fn check(file: &Path, actions: &[String], json: bool) -> Result<u8, Failure> {
    let tree = read(file)?;
    let is_known =
        |kind: LeafKind, id: &str| kind == LeafKind::Condition || actions.iter().any(|action| action == id);
    let is_known: Option<&KnownLeaf<'_>> = if actions.is_empty() { None } else { Some(&is_known) };
    let finding = |TreeFinding { kind, file, line, text }| MissionFinding {
        kind: kind.name(),
        is_error: kind.is_error(),
        included: file,
        line: Some(line),
        text,
    };
    let [nodes, entries] = [tree.nodes().len(), tree.entries().len()];
    let [actions, conditions] = [LeafKind::Action, LeafKind::Condition].map(|kind| ids(&tree, kind));
    let checked = CheckedMission {
        file,
        title: tree.name().into(),
        counts: format!(
            "{nodes} nodes, {} actions, {} conditions, {entries} entries",
            actions.len(),
            conditions.len()
        ),
        parts: json!({
            "nodes": nodes,
            "actions": actions,
            "conditions": conditions,
            "entries": tree.entries(),
        }),
        findings: check_tree(&tree, is_known).into_iter().map(finding).collect(),
    };
    Ok(checked.report(json))
}

/// Actions or conditions of a tree, each once.
fn ids(tree: &BehaviorTree, kind: LeafKind) -> Vec<&str> {
    let mut ids: Vec<&str> =
        tree.leaves().iter().filter(|leaf| leaf.kind() == kind).map(|leaf| leaf.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

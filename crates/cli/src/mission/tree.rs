//! Defects of a behaviour tree.

use std::path::Path;

use serde_json::{Value, json};
use slate_behavior_tree::{BehaviorTree, KnownLeaf, LeafKind, LeafModels, TreeFinding, check_tree};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

/// Reads a tree whose file has the models of its actions and conditions.
pub fn read(file: &Path) -> Result<BehaviorTree, Failure> {
    Ok(BehaviorTree::read(file, &LeafModels::default())?)
}

/// Checks a tree, and prints what is found; returns the exit code.
pub fn check(file: &Path, actions: &[String], json: bool) -> Result<u8, Failure> {
    let tree = read(file)?;
    let is_known =
        |kind: LeafKind, id: &str| kind == LeafKind::Condition || actions.iter().any(|action| action == id);
    let is_known: Option<&KnownLeaf<'_>> = if actions.is_empty() { None } else { Some(&is_known) };
    let findings = check_tree(&tree, is_known);
    let is_sound = !findings.iter().any(|finding| finding.kind.is_error());
    if json {
        output::json(&json!({
            "schema": "slate.mission.check/1",
            "sound": is_sound,
            "plans": [document(&tree, &findings, is_sound)],
        }));
    } else {
        print(file, &tree, &findings, is_sound);
    }
    Ok(if is_sound { 0 } else { ASSERTION_FALSE })
}

fn print(file: &Path, tree: &BehaviorTree, findings: &[TreeFinding], is_sound: bool) {
    for TreeFinding { kind, line, text } in findings {
        let level = if kind.is_error() { "error" } else { "warning" };
        output::line(format!("{level}: {}:{line}: {}: {text}", file.display(), kind.name()));
    }
    output::line(format!(
        "{}: {}; {} nodes, {} actions, {} conditions, {} entries",
        tree.name(),
        if is_sound { "sound" } else { "not sound" },
        tree.nodes().len(),
        ids(tree, LeafKind::Action).len(),
        ids(tree, LeafKind::Condition).len(),
        tree.entries().len()
    ));
}

fn document(tree: &BehaviorTree, findings: &[TreeFinding], is_sound: bool) -> Value {
    let finding = |finding: &TreeFinding| {
        json!({
            "kind": finding.kind.name(),
            "error": finding.kind.is_error(),
            "line": finding.line,
            "text": finding.text,
        })
    };
    json!({
        "plan": tree.name(),
        "sound": is_sound,
        "nodes": tree.nodes().len(),
        "actions": ids(tree, LeafKind::Action),
        "conditions": ids(tree, LeafKind::Condition),
        "entries": tree.entries(),
        "findings": findings.iter().map(finding).collect::<Vec<Value>>(),
    })
}

/// Actions or conditions of a tree, each once.
fn ids(tree: &BehaviorTree, kind: LeafKind) -> Vec<&str> {
    let mut ids: Vec<&str> =
        tree.leaves().iter().filter(|leaf| leaf.kind() == kind).map(|leaf| leaf.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

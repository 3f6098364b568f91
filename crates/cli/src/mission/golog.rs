//! Defects and drawings of Golog theories.

use std::path::Path;

use serde_json::json;
use slate_golog::{ActionTheory, GologFinding, check_theory, outline};

use super::findings::{CheckedMission, MissionFinding};
use super::tree_svg::{self, DrawnRow};
use crate::failure::Failure;

/// Returns whether a file is a theory, by its name.
pub fn is_theory(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "golog")
}

/// Checks a theory, and prints the findings; returns the exit code.
pub fn check(file: &Path, actions: &[String], json: bool) -> Result<u8, Failure> {
    let theory = ActionTheory::read(file)?;
    let is_known = |name: &str| actions.iter().any(|action| action == name);
    let is_known: Option<&dyn Fn(&str) -> bool> = if actions.is_empty() { None } else { Some(&is_known) };
    let finding = |GologFinding { kind, line, text }| MissionFinding {
        kind: kind.name(),
        is_error: kind.is_error(),
        included: None,
        line: Some(line),
        text,
    };
    let checked = CheckedMission {
        file,
        title: theory.name().into(),
        counts: format!(
            "{} fluents, {} actions, {} procedures, {} conditions",
            theory.fluents(),
            theory.actions().count(),
            theory.procedures().count(),
            theory.conditions().len()
        ),
        parts: json!({
            "fluents": theory.fluents(),
            "actions": theory.actions().collect::<Vec<&str>>(),
            "procedures": theory.procedures().collect::<Vec<&str>>(),
            "conditions": theory.conditions(),
        }),
        findings: check_theory(&theory, is_known).into_iter().map(finding).collect(),
    };
    Ok(checked.report(json))
}

/// Returns the procedures of a theory as an SVG document.
pub fn draw(file: &Path) -> Result<String, Failure> {
    let theory = ActionTheory::read(file)?;
    let rows = outline(&theory).into_iter().map(|row| DrawnRow {
        parent: row.parent,
        level: row.level,
        class: match (row.parent, row.is_action) {
            (None, _) => "control",
            (_, true) => "leaf",
            _ => "",
        },
        title: row.text,
    });
    Ok(tree_svg::draw(theory.name(), &rows.collect::<Vec<DrawnRow>>()))
}

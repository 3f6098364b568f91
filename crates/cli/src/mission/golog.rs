//! Defects and drawings of Golog theories.

use std::path::Path;

use serde_json::{Value, json};
use slate_golog::{ActionTheory, GologFinding, check_theory, outline};

use super::tree_svg::{self, DrawnRow};
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

/// Whether a file is a theory, by its name.
pub fn is_theory(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "golog")
}

/// Checks a theory, and prints what is found; returns the exit code.
pub fn check(file: &Path, actions: &[String], json: bool) -> Result<u8, Failure> {
    let theory = ActionTheory::read(file)?;
    let is_known = |name: &str| actions.iter().any(|action| action == name);
    let is_known: Option<&dyn Fn(&str) -> bool> = if actions.is_empty() { None } else { Some(&is_known) };
    let findings = check_theory(&theory, is_known);
    let is_sound = !findings.iter().any(|finding| finding.kind.is_error());
    if json {
        output::json(&json!({
            "schema": "slate.mission.check/1",
            "sound": is_sound,
            "plans": [document(&theory, &findings, is_sound)],
        }));
    } else {
        print(file, &theory, &findings, is_sound);
    }
    Ok(if is_sound { 0 } else { ASSERTION_FALSE })
}

fn print(file: &Path, theory: &ActionTheory, findings: &[GologFinding], is_sound: bool) {
    for GologFinding { kind, line, text } in findings {
        let level = if kind.is_error() { "error" } else { "warning" };
        output::line(format!("{level}: {}:{line}: {}: {text}", file.display(), kind.name()));
    }
    output::line(format!(
        "{}: {}; {} fluents, {} actions, {} procedures, {} conditions",
        theory.name(),
        if is_sound { "sound" } else { "not sound" },
        theory.fluents(),
        theory.actions().count(),
        theory.procedures().count(),
        theory.conditions().len()
    ));
}

fn document(theory: &ActionTheory, findings: &[GologFinding], is_sound: bool) -> Value {
    let finding = |finding: &GologFinding| {
        json!({
            "kind": finding.kind.name(),
            "error": finding.kind.is_error(),
            "line": finding.line,
            "text": finding.text,
        })
    };
    json!({
        "plan": theory.name(),
        "sound": is_sound,
        "fluents": theory.fluents(),
        "actions": theory.actions().collect::<Vec<&str>>(),
        "procedures": theory.procedures().collect::<Vec<&str>>(),
        "conditions": theory.conditions(),
        "findings": findings.iter().map(finding).collect::<Vec<Value>>(),
    })
}

/// The procedures of a theory as an SVG document.
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

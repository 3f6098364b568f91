//! Findings of a check, printed as lines or as JSON.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::failure::ASSERTION_FALSE;
use crate::output;

/// Mission that was checked.
pub struct CheckedMission<'a> {
    /// File that was checked.
    pub file: &'a Path,
    /// Name of the mission.
    pub title: String,
    /// Numbers of its parts, such as `3 nodes, 1 actions`.
    pub counts: String,
    /// Parts, for JSON.
    pub parts: Value,
    /// Findings.
    pub findings: Vec<MissionFinding>,
}

/// Defect of a mission.
pub struct MissionFinding {
    /// Kind, such as `dead node`.
    pub kind: &'static str,
    /// Severity: true if the mission can't work.
    pub is_error: bool,
    /// Other file, which that of the mission includes.
    pub included: Option<PathBuf>,
    /// Line in the file, from 1.
    pub line: Option<usize>,
    /// Description of the defect.
    pub text: String,
}

impl CheckedMission<'_> {
    /// Prints the findings; returns the exit code.
    pub fn report(self, json: bool) -> u8 {
        let is_sound = !self.findings.iter().any(|finding| finding.is_error);
        if json {
            let plans = [self.document(is_sound)];
            output::json(&json!({ "schema": "slate.mission.check/1", "sound": is_sound, "plans": plans }));
        } else {
            self.print(is_sound);
        }
        if is_sound { 0 } else { ASSERTION_FALSE }
    }

    fn print(&self, is_sound: bool) {
        for MissionFinding { kind, is_error, included, line, text } in &self.findings {
            let level = if *is_error { "error" } else { "warning" };
            let file = included.as_deref().unwrap_or(self.file).display();
            let line = line.map(|line| format!(":{line}")).unwrap_or_default();
            output::line(format!("{level}: {file}{line}: {kind}: {text}"));
        }
        let verdict = if is_sound { "sound" } else { "not sound" };
        output::line(format!("{}: {verdict}; {}", self.title, self.counts));
    }

    fn document(&self, is_sound: bool) -> Value {
        let mut plan = match &self.parts {
            Value::Object(parts) => parts.clone(),
            _ => Map::new(),
        };
        plan.insert("plan".into(), self.title.as_str().into());
        plan.insert("sound".into(), is_sound.into());
        plan.insert("findings".into(), self.findings.iter().map(MissionFinding::document).collect());
        plan.into()
    }
}

impl MissionFinding {
    fn document(&self) -> Value {
        let mut own = Map::new();
        own.insert("kind".into(), self.kind.into());
        own.insert("error".into(), self.is_error.into());
        own.insert("text".into(), self.text.as_str().into());
        if let Some(line) = self.line {
            own.insert("line".into(), line.into());
        }
        if let Some(file) = &self.included {
            own.insert("file".into(), file.display().to_string().into());
        }
        own.into()
    }
}

//! `[snapshot]`: the trigger of automatic snapshots.

use super::problems::Problems;
use super::source::{Sources, Spanned};
use super::value::Table;
use crate::trigger::{SnapshotCondition, SnapshotTrigger};

/// Reader of `[snapshot]`.
pub(super) struct SnapshotReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl SnapshotReader<'_> {
    pub(super) fn snapshot(&mut self, root: &Table) -> Option<SnapshotTrigger> {
        let table = self.problems.table(root, "snapshot")?;
        self.problems.unknown_keys(table, "in [snapshot]", &["at", "when", "file"]);
        let span = root.get("snapshot").map(|value| value.span)?;
        let at = self.problems.duration(table, "at");
        let when = self.problems.text(table, "when", "/r2/battery/charge < 0.2").and_then(|text| {
            let condition = SnapshotCondition::parse(&text.value);
            let wrong = |error| self.problems.add(text.span, format!("`when` can't be read: {error}"), WHEN);
            Some(Spanned::new(condition.map_err(wrong).ok()?, text.span))
        });
        if table.get("at").is_none() && table.get("when").is_none() {
            self.problems.add(span, "[snapshot] has no trigger", "write at = \"30s\", or `when`");
        }
        if table.get("file").is_none() {
            self.problems.add(span, "[snapshot] has no file", "write file = \"exp1.snapshot\"");
        }
        let file = self.problems.text(table, "file", "exp1.snapshot")?;
        Some(SnapshotTrigger { at, when, file: self.sources.beside(&file) })
    }
}

const WHEN: &str = "write a field, a sign and a number: when = \"/r2/battery/charge < 0.2\"";

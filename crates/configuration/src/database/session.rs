use super::super::compare::leaves;
use super::super::path::render;
use super::super::value::{Table, Value};

/// Changes made at run time, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct ChangeSession(pub(super) Vec<SessionChange>);

/// Changed setting; its value is a table only if that is empty.
#[derive(Clone, Debug)]
pub(super) struct SessionChange {
    pub(super) path: Vec<String>,
    pub(super) value: Value,
}

impl ChangeSession {
    /// Adds the settings of a change.
    pub(super) fn add(&mut self, change: &Table) {
        leaves(change, &[], &mut |path, value| {
            // An earlier change that this one covers says nothing any more.
            if value.as_table().is_none() {
                self.0.retain(|earlier| !earlier.path.starts_with(&path));
            }
            self.0.push(SessionChange { path, value: value.value.clone() });
        });
    }

    /// Returns true if the session has a change at a path, above or below it.
    pub(super) fn has(&self, path: &[String]) -> bool {
        self.0.iter().any(|change| change.path.starts_with(path) || path.starts_with(&change.path))
    }

    /// Returns the changes as texts, to be read again.
    pub(super) fn texts(&self) -> Vec<String> {
        self.0.iter().map(|change| format!("{}={}", render(&change.path), change.value)).collect()
    }
}

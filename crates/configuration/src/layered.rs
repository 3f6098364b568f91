//! Configuration as text, layer by layer.
//! Another process can revert changes made at run time.

use serde::{Deserialize, Serialize};

use super::compare::{differences, leaves, same};
use super::exclusive::counterpart;
use super::path::render;
use super::source::SourceKind;
use super::value::Table;
use super::{Configuration, Database, Options, Report};

/// Layers of a configuration.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layered {
    /// The settings of the files and the defaults of the program, as TOML.
    pub files: String,
    /// Settings of the command line, `path=value`, later ones last.
    pub sets: Vec<String>,
    /// Changes made at run time, `path=value`, later ones last.
    pub changes: Vec<String>,
}

impl Configuration {
    /// Returns the files' settings, a line each, except those that `is_left_out`.
    pub fn file_lines(&self, is_left_out: &dyn Fn(&str) -> bool) -> Vec<String> {
        lines(&self.base, &|path| !is_left_out(&render(path)))
    }

    /// Returns this agent's settings of a layer above the files, in order.
    pub fn lines_of(&self, kind: SourceKind, is_left_out: &dyn Fn(&str) -> bool) -> Vec<String> {
        let is_own = |path: &[String]| {
            let owner = &path[..path.len().min(2)];
            !matches!(path[0].as_str(), "modules" | "actuators" | "links")
                || [&self.base, &self.merged].iter().any(|table| table.entry(owner).is_some())
        };
        let tables = self.upper.iter().filter(|(own, _)| *own == kind);
        tables
            .flat_map(|(_, table)| lines(table, &|path| is_own(path) && !is_left_out(&render(path))))
            .collect()
    }

    /// Returns true if another configuration has the same value at a path.
    pub fn agrees_with(&self, other: &Self, names: &[String]) -> bool {
        match (self.merged.entry(names), other.merged.entry(names)) {
            (Some(own), Some(other)) => same(&own.value, &other.value),
            (None, None) => true,
            _ => false,
        }
    }

    /// Returns true if another configuration has the same settings.
    /// Their origins do not matter.
    pub fn is_same_as(&self, other: &Self) -> bool {
        differences(&self.merged, &other.merged).is_empty()
    }
}

fn lines(table: &Table, is_kept: &dyn Fn(&[String]) -> bool) -> Vec<String> {
    let mut lines = Vec::new();
    leaves(table, &[], &mut |path, value| {
        if is_kept(&path) {
            lines.push(format!("{} = {}", render(&path), value.value));
        }
    });
    lines
}

impl Layered {
    /// Makes the configuration of the layers.
    /// `sets` are settings of the command line above all of them.
    ///
    /// # Errors
    /// All errors in any of the layers.
    pub fn database(
        &self,
        name: &str,
        extra_tables: Vec<String>,
        sets: Vec<String>,
    ) -> Result<Database, Report> {
        let over: Vec<_> = sets.iter().flat_map(|set| super::set::flat_paths(set)).collect();
        let over: Vec<_> = over.iter().filter_map(|path| counterpart(path)).chain(over.clone()).collect();
        let sets = self.sets.iter().cloned().chain(sets).collect();
        let options = Options { sets, extra_tables, is_recorded: true, ..Options::default() };
        Database::with_changes(name, &self.files, options, (&self.changes, &over))
    }
}

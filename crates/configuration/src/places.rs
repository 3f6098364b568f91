//! Places of modules' complaints, and robots without content.

use toml_edit::TableLike;

use super::model::Module;
use super::source::{Span, Spanned};
use super::value::Value;
use crate::Configuration;

impl Module {
    /// Returns the place of the module's complaint about one of its parameters.
    /// An example is `params.sensor_rules.1: a distance`. It is the place of the parameter, or of its item; `None` if
    /// the complaint begins with no written parameter.
    pub fn place_of(&self, complaint: &str) -> Option<Span> {
        let (path, _) = complaint.split_once(": ")?;
        let mut names = path.strip_prefix("params.")?.split('.');
        let mut place = self.params.get(names.next()?)?;
        for name in names {
            let part = match &place.value {
                Value::List(items) => name.parse().ok().and_then(|index: usize| items.get(index)),
                Value::Table(table) => table.get(name),
                _ => None,
            };
            let Some(part) = part else { break };
            place = part;
        }
        Some(place.span)
    }
}

/// Returns the robots without a module whose tables are empty.
pub fn empty_robots(configuration: &Configuration) -> Vec<Spanned<String>> {
    let mut found: Vec<Spanned<String>> = Vec::new();
    for (source, text) in configuration.sources.0.iter().enumerate() {
        let robots = text.document().and_then(|document| document.get("robots")?.as_table_like());
        for (name, robot) in robots.into_iter().flat_map(TableLike::iter) {
            let is_empty = |table: &dyn TableLike| table.is_empty();
            // Links alone may be of a robot that another agent of the file runs.
            let says_nothing = robot.as_table_like().is_some_and(|sections| {
                sections.iter().all(|(_, section)| section.as_table_like().is_some_and(is_empty))
            });
            let is_known = found.iter().any(|other| other.value == name);
            if !says_nothing || is_known || has_robot(configuration, name) {
                continue;
            }
            let key = robots.and_then(|robots| robots.key(name)?.span()).unwrap_or_default();
            found.push(Spanned::new(name.into(), Span { source, start: key.start, end: key.end }));
        }
    }
    found
}

/// Returns true if a module belongs to a robot of that name.
fn has_robot(configuration: &Configuration, name: &str) -> bool {
    let is_of =
        |module: &Module| module.name.value.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
    configuration.modules().iter().any(is_of)
}

//! Changes of the configuration that modules ask for, and how changes are told.

use toml_edit::Key;

use super::composer::Composer;
use crate::configuration::{Change, Report, Value};

impl Composer {
    /// Makes the changes that a module asks for, a line each: `path=value`, or a path alone, which takes back what was
    /// changed there. Says what has changed.
    ///
    /// # Errors
    /// What does not fit; nothing is changed then.
    pub(crate) fn change_for(&self, module: &str, lines: &str) -> Result<String, Report> {
        let database = self.composition().database()?;
        let lines = lines.lines().filter(|line| !line.trim().is_empty());
        let (set, taken_back): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.contains('='));
        let mut changes = Vec::new();
        for line in set {
            changes.push(crate::configuration::parse_change(line)?);
        }
        let changes = self.commit(|| database.propose_instead(&taken_back, &changes))?;
        self.say_changes(&format!("{module} has changed"), &changes);
        let changed: Vec<_> = changes.iter().map(|change| self.told(change)).collect();
        Ok(changed.join(", "))
    }

    /// Tells who reads the log later why the robot is another one from here on.
    pub(crate) fn say_changes(&self, what: &str, changes: &[Change]) {
        changes.iter().for_each(|change| self.say(&format!("{what} {}", self.told(change))));
    }

    /// A change with what holds where nothing is said.
    fn told(&self, Change { path, before, after, .. }: &Change) -> String {
        let default =
            || self.default_at(path).map_or("none".into(), |default| format!("{default} (default)"));
        let value = |value: &Option<Value>| value.as_ref().map_or_else(default, Value::to_string);
        format!("{path}: {} -> {}", value(before), value(after))
    }

    /// The value that a module has where nothing says another.
    pub(crate) fn default_at(&self, path: &str) -> Option<String> {
        let names = Key::parse(path).ok()?;
        let names: Vec<&str> = names.iter().map(Key::get).collect();
        let [section, module, part, name] = names[..] else { return None };
        let value = self.default_of(module, name).filter(|_| (section, part) == ("modules", "params"))?;
        serde_json::to_string(&value).ok()
    }
}

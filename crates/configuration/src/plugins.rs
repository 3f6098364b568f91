//! Plugins that are libraries, and named lists of plugins.

use super::model::PluginEntry;
use super::problems::Problems;
use super::source::{Sources, Spanned};
use super::value::{Table, TableEntry};

/// Reader of `[plugins]`.
pub(super) struct PluginReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl PluginReader<'_> {
    /// Reads the plugins by name; errors are added to the problems.
    pub(super) fn plugins(&mut self, root: &Table) -> Vec<PluginEntry> {
        let table = self.problems.table(root, "plugins");
        let entries: Vec<_> = table
            .into_iter()
            .flat_map(Table::iter)
            .filter_map(|(name, entry)| self.plugin(name, entry))
            .collect();
        for entry in &entries {
            self.circle(&entries, entry, &mut vec![&entry.name.value]);
        }
        entries
    }

    /// Refuses a list of plugins that contains itself.
    fn circle<'a>(&mut self, entries: &'a [PluginEntry], entry: &'a PluginEntry, path: &mut Vec<&'a str>) {
        for member in entry.members.iter().flatten() {
            if member.value == path[0] {
                let circle: Vec<_> = path.iter().chain(&path[..1]).copied().collect();
                let message = format!("a list of plugins is a part of itself: {}", circle.join(" -> "));
                self.problems.add(member.span, message, "take it out of the list");
            } else if !path.contains(&member.value.as_str())
                && let Some(entry) = entries.iter().find(|entry| entry.name.value == member.value)
            {
                path.push(&entry.name.value);
                self.circle(entries, entry, path);
                path.pop();
            }
        }
    }

    fn plugin(&mut self, name: &str, entry: &TableEntry) -> Option<PluginEntry> {
        // A plugin is called as its package, which may have hyphens.
        if !self.problems.name("a plugin", &name.replace('-', "_"), false, entry.key) {
            return None;
        }
        let table = self.problems.as_table(&format!("plugins.{name}"), entry)?;
        self.problems.unknown_keys(table, &format!("in plugin `{name}`"), &["file", "load", "plugins"]);
        let file = match table.get("file") {
            Some(value) => {
                let text = self.problems.as_text("file", value, "plugins/libfollower.so")?;
                Some(self.sources.beside(&text))
            }
            None => None,
        };
        let members = table.entries.get("plugins");
        if let (Some(file), Some(_)) = (&file, members) {
            let help = "a list of plugins has no library of its own";
            self.problems.add(file.span, "`file` and `plugins` exclude each other", help);
            return None;
        }
        let members = members.map(|members| self.problems.texts("plugins", &members.value, "localizer"));
        let load = match table.get("load") {
            Some(_) => self.problems.flag(table, "load")?.value,
            None => true,
        };
        Some(PluginEntry { name: Spanned::new(name.into(), entry.key), file, members, load })
    }
}

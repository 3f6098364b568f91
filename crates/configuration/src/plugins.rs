//! The plugins that are libraries, and named lists of plugins.

use std::path::PathBuf;

use super::Configuration;
use super::build::Build;
use super::source::{Source, SourceKind, Span, Spanned};
use super::value::{Entry, Table};
use super::{Isolation, Module, PluginEntry};

impl Build<'_> {
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

    /// Refuses a list of plugins that has itself in it.
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

    fn plugin(&mut self, name: &str, entry: &Entry) -> Option<PluginEntry> {
        // A plugin is called as its package, which may have hyphens.
        if !self.problems.name("a plugin", &name.replace('-', "_"), false, entry.key) {
            return None;
        }
        let table = self.problems.as_table(&format!("plugins.{name}"), entry)?;
        self.problems.unknown_keys(table, &format!("in plugin `{name}`"), &["file", "load", "plugins"]);
        let file = match table.get("file") {
            Some(value) => {
                let text = self.problems.as_text("file", value, "plugins/libfollower.so")?;
                Some(self.beside(&text))
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

    /// A path as it is written in a file: relative to that file. The command line's are relative to where it was given.
    pub(super) fn beside(&self, text: &Spanned<String>) -> Spanned<PathBuf> {
        Spanned::new(self.sources.folder(text.span).join(&text.value), text.span)
    }
}

impl Configuration {
    /// The folder that paths at a place are relative to: that of the file that they are written in.
    pub fn folder_of(&self, span: Span) -> PathBuf {
        self.sources.folder(span)
    }

    /// The plugins that are libraries, and named lists of plugins, by name.
    pub fn plugins(&self) -> &[PluginEntry] {
        &self.plugins
    }

    /// The same with another module of that kind, which a plugin brought that was loaded by hand from `origin`.
    pub fn with_module(&self, name: &str, kind: &str, origin: &str) -> Self {
        let mut configuration = self.clone();
        let text = format!("modules.\"{name}\".kind = \"{kind}\"");
        let span = Span { source: configuration.sources.0.len(), start: 0, end: text.len() };
        let rank = configuration.sources.0.iter().map(|source| source.rank).max().unwrap_or(0) + 1;
        configuration.sources.0.push(Source {
            name: origin.into(),
            kind: SourceKind::Plugin,
            path: None,
            text: text.into(),
            rank,
            place: Default::default(),
            document: None,
        });
        configuration.modules.push(Module {
            name: Spanned::new(name.into(), span),
            kind: Spanned::new(kind.into(), span),
            enabled: Spanned::new(true, span),
            isolated: Spanned::new(false, span),
            isolation: Isolation::default(),
            memory: None,
            stage: None,
            trigger: None,
            deadline: None,
            params: Table::default(),
            inputs: Table::default(),
        });
        configuration
    }

    /// The same with the modules that [`with_module`](Configuration::with_module) added to another one, and with its links
    /// that are not written.
    pub fn with_loaded_of(&self, other: &Self) -> Self {
        let missing = |module: &&Module| {
            other.is_loaded(module) && !self.modules.iter().any(|own| own.name.value == module.name.value)
        };
        let add = |configuration: Self, module: &Module| {
            let origin = &other.sources.of(module.name.span).name;
            configuration.with_module(&module.name, &module.kind, origin)
        };
        let configuration = other.modules.iter().filter(missing).fold(self.clone(), add);
        let links = configuration.inferred_of(other);
        configuration.with_inferred(links)
    }

    /// Whether a module of this configuration came with a plugin that was loaded by hand.
    pub fn is_loaded(&self, module: &Module) -> bool {
        self.sources.of(module.name.span).kind == SourceKind::Plugin
    }

    /// The same without those modules that [`with_module`](Configuration::with_module) added.
    pub fn without_loaded(&self, names: &[String]) -> Self {
        let mut configuration = self.clone();
        configuration
            .modules
            .retain(|module| !(self.is_loaded(module) && names.contains(&module.name.value)));
        configuration
    }
}

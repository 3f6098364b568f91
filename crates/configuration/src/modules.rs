//! `[modules]`: the modules of an agent.

use slate_module::{Stage, Trigger};

use super::exclusive::one_of;
use super::model::{Isolation, Module};
use super::problems::Problems;
use super::source::{Sources, Span, Spanned};
use super::value::{Table, TableEntry};
use crate::error_code::ErrorCode;

/// Reader of `[modules]`.
pub(super) struct ModuleReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl ModuleReader<'_> {
    /// Reads the modules, by name.
    pub(super) fn modules(&mut self, root: &Table) -> Vec<Module> {
        let table = self.problems.table(root, "modules");
        table.into_iter().flat_map(Table::iter).filter_map(|(name, entry)| self.module(name, entry)).collect()
    }

    fn module(&mut self, name: &str, entry: &TableEntry) -> Option<Module> {
        let known = [
            "kind",
            "enabled",
            "isolated",
            "isolation",
            "memory",
            "stage",
            "every",
            "on",
            "deadline",
            "params",
            "inputs",
        ];
        let table = self.problems.as_table(&format!("modules.{name}"), entry)?;
        let type_name = name.rsplit('/').next().unwrap_or(name);
        let kind = self.kind(name, table, type_name, entry.key, &known)?;
        let stage = table.get("stage").and_then(|value| {
            self.problems.choice("stage", value, &Stage::ALL.map(|stage| (stage.name(), stage)))
        });
        let mut part = |part| self.problems.table(table, part).cloned().unwrap_or_default();
        Some(Module {
            name: Spanned::new(name.into(), entry.key),
            kind,
            stage,
            params: part("params"),
            inputs: part("inputs"),
            enabled: match table.get("enabled") {
                Some(_) => self.problems.flag(table, "enabled")?,
                None => Spanned::new(true, entry.key),
            },
            isolated: match table.get("isolated") {
                Some(_) => self.problems.flag(table, "isolated")?,
                None => Spanned::new(false, entry.key),
            },
            isolation: self.isolation(name, table),
            memory: self.problems.text(table, "memory", "r2.memory").map(|file| self.sources.beside(&file)),
            trigger: self.trigger(table),
            deadline: self.problems.duration(table, "deadline"),
        })
    }

    /// Returns the kind of a module; the default is its own name.
    /// Also reports unknown keys.
    fn kind(
        &mut self,
        name: &str,
        table: &Table,
        usual: &str,
        key: Span,
        known: &[&str],
    ) -> Option<Spanned<String>> {
        let mut table = table.clone();
        if let Some(old) = table.entries.remove("plugin") {
            let kind = old.value.value.as_str().unwrap_or(usual);
            let message = ErrorCode::Key
                .of(format!("module `{name}` has `plugin`, which is called `kind` in a module"));
            self.problems.add(old.key, message, format!("write kind = \"{kind}\"; a plugin is a library"));
        }
        self.problems.unknown_keys(&table, &format!("in module `{name}`"), known);
        match table.get("kind") {
            Some(value) => self.problems.as_text("kind", value, usual),
            None => Some(Spanned::new(usual.into(), key)),
        }
    }

    fn isolation(&mut self, name: &str, table: &Table) -> Isolation {
        let usual = Isolation::default();
        let Some(table) = self.problems.table(table, "isolation") else { return usual };
        self.problems.unknown_keys(table, &format!("in the isolation of `{name}`"), &["memory", "rearm"]);
        Isolation {
            memory: table
                .get("memory")
                .and_then(|memory| self.problems.size("memory", memory))
                .unwrap_or(usual.memory),
            memory_at: table.get("memory").map(|memory| memory.span),
            rearm: match table.get("rearm") {
                Some(_) => self.problems.flag(table, "rearm").is_some_and(|rearm| rearm.value),
                None => usual.rearm,
            },
        }
    }

    fn trigger(&mut self, table: &Table) -> Option<Spanned<Trigger>> {
        match one_of(self.sources, self.problems, table, "every", "on")? {
            ("on", value) => {
                let ports = self.problems.texts("on", &value.value, "scans");
                if ports.is_empty() && value.value.as_list().is_some_and(<[_]>::is_empty) {
                    self.problems.add(
                        value.value.span,
                        "`on` names no port",
                        "name one or more, such as on = \"scans\"",
                    );
                }
                let ports = ports.into_iter().map(|port| port.value).collect();
                Some(Spanned::new(Trigger::On { ports, timeout: None }, value.value.span))
            }
            _ => {
                let period = self.problems.duration(table, "every")?;
                Some(Spanned::new(Trigger::Every(period.value), period.span))
            }
        }
    }
}

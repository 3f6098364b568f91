//! Description of several agents in one file.

use slate_sorted::SortedMap;

use super::division::Division;
use super::problems::{Problem, Problems, suggestion};
use super::source::{SourceKind, Span, Spanned};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Agent among several, with the names of the others.
#[derive(Clone, Debug)]
pub(super) struct Described {
    pub(super) name: String,
    pub(super) others: Vec<String>,
}

/// Agents that the texts of a configuration describe, and the wanted one.
#[derive(Default)]
pub(super) struct AgentTables {
    /// Name of the wanted agent, if given.
    pub(super) wanted: Option<String>,
    /// Names of all agents, with the first place of each.
    pub(super) known: SortedMap<String, Span>,
    /// Parts of the file that each of them runs.
    pub(super) division: Division,
    /// True if the wanted agent's table sets its name.
    is_named: bool,
    /// True if another agent has the module that is the time source.
    pub(super) clock_elsewhere: bool,
}

impl AgentTables {
    /// Makes empty tables.
    pub(super) fn of(wanted: Option<String>) -> Self {
        Self { wanted, ..Self::default() }
    }

    /// Returns the wanted agent, if the texts describe it.
    pub(super) fn chosen(&self) -> Option<String> {
        self.wanted.clone().filter(|wanted| self.known.contains_key(wanted))
    }

    /// Returns the wanted agent and the others, if the texts describe it.
    pub(super) fn described(&self) -> Option<Described> {
        let name = self.chosen()?;
        let others = self.known.keys().filter(|other| **other != name).cloned().collect();
        Some(Described { name, others })
    }

    /// Notes the agents that a text describes; false after a problem with all of it.
    pub(super) fn note(&mut self, agents: &TableEntry, problems: &mut Problems) -> bool {
        let Some(agents) = problems.as_table("agents", agents) else { return false };
        for (name, entry) in agents.iter() {
            let good = problems.agent_name(name, entry.key);
            if let Some(table) = problems.as_table(&format!("agents.{name}"), entry).filter(|_| good) {
                self.known.entry(name.into()).or_insert(entry.key);
                self.division.note(name, entry, table, problems);
            }
        }
        true
    }

    /// Notes if the wanted agent's table names it.
    pub(super) fn note_name(&mut self, own: &Table) {
        self.is_named |= own.at(["agent", "name"].into_iter()).is_some();
    }

    /// Returns the setting that names the agent after its table.
    /// `None` if its table sets another name. An included file may belong to other agents too, so its name does not
    /// count.
    pub(super) fn own_name(&self) -> Option<Table> {
        let wanted = self.wanted.as_ref().filter(|_| !self.is_named)?;
        let (name, &key) = self.known.get_key_value(wanted)?;
        let entry = |value| TableEntry { key, value: Spanned::new(value, key) };
        let table = |name: &str, entry| Table { entries: [(name.to_owned(), entry)].into() };
        let name = table("name", entry(Value::Text(name.clone())));
        Some(table("agent", entry(Value::Table(name))))
    }

    /// Returns the part of a setting for the wanted agent.
    /// `None` if the setting is for another agent, or wrong. Texts may be missing if they are `incomplete`.
    pub(super) fn of_wanted(
        &mut self,
        kind: SourceKind,
        mut setting: Table,
        incomplete: bool,
        problems: &mut Problems,
    ) -> Option<Table> {
        let Some(entry) = setting.entries.remove("agents") else { return Some(setting) };
        let mut own = None;
        for (name, entry) in problems.as_table("agents", &entry)?.iter() {
            let is_wanted = self.wanted.as_deref() == Some(name) && self.known.contains_key(name);
            if !self.known.contains_key(name) {
                self.unknown(name, Some(entry.key), incomplete, problems);
            } else if let Some(table) = problems.as_table(&format!("agents.{name}"), entry) {
                self.division.note(name, entry, table, problems);
                if is_wanted {
                    let mut table = table.clone();
                    // It is noted.
                    table.entries.remove("runs");
                    own = Some(table);
                } else if kind == SourceKind::Change {
                    let help =
                        format!("change it there: --agent {name}, and the setting without `agents.{name}.`");
                    let message = ErrorCode::OtherAgent.of(format!("`{name}` is another agent"));
                    problems.add(entry.key, message, help);
                }
            }
        }
        own
    }

    /// Returns true if one agent is chosen, else reports a problem.
    pub(super) fn is_chosen(&self, incomplete: bool, problems: &mut Problems) -> bool {
        let first = self.known.values().next().copied();
        match (self.wanted.as_deref(), first) {
            (None, Some(first)) => {
                let names: Vec<_> = self.known.keys().map(|name| format!("`{name}`")).collect();
                let message =
                    format!("several agents are described, and none is chosen: {}", names.join(", "));
                let name = self.known.keys().next().map_or("", String::as_str);
                let help = format!("`slate run` starts them all, `slate run --agent {name}` one of them");
                problems.add(first, message, help);
                false
            }
            (Some(name), Some(first)) if !self.known.contains_key(name) => {
                self.unknown(name, Some(first), incomplete, problems);
                false
            }
            _ => true,
        }
    }

    /// Reports a name that no agent has.
    /// With `incomplete` texts it reports nothing, as the name may be in an unreadable text.
    pub(super) fn unknown(&self, name: &str, span: Option<Span>, incomplete: bool, problems: &mut Problems) {
        if incomplete {
            return;
        }
        let known: Vec<&str> = self.known.keys().map(String::as_str).collect();
        let help = match known[..] {
            [] => "the configuration is that of one agent: leave the name out".into(),
            _ => suggestion(name, &known),
        };
        let message = ErrorCode::OtherAgent.of(format!("no agent is called `{name}`"));
        problems.0.push(Problem { span, message, help: Some(help) });
    }
}

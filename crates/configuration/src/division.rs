//! Division of a file's modules, links and actuators among several agents.
//! Tables outside of `agents` are divided, so that one file serves robots in one agent and robots in agents of their
//! own.

use slate_blackboard::Url;
use slate_sorted::{SortedMap, SortedSet};

use super::external::ExternalUrl;
use super::problems::{Problems, suggestion};
use super::scope::{SECTIONS, each_text};
use super::senders::{make_commands, make_table};
use super::source::{SourceKind, Sources, Span, Spanned};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Agents of a file, with the parts that each runs.
#[derive(Default)]
pub(super) struct Division(SortedMap<String, AgentPart>);

struct AgentPart {
    /// Name under which others find it.
    called: String,
    /// Place of its description.
    key: Span,
    /// Robots and modules that it runs; `None` without `runs`.
    runs: Option<Vec<Spanned<String>>>,
}

impl Division {
    /// Notes the table of an agent in a text; a later one overrides it.
    pub(super) fn note(&mut self, agent: &str, entry: &TableEntry, table: &Table, problems: &mut Problems) {
        let part = self.0.entry(agent.into()).or_insert_with(|| AgentPart {
            called: agent.into(),
            key: entry.key,
            runs: None,
        });
        if let Some(runs) = table.get("runs") {
            part.runs = Some(problems.texts("runs", runs, "r2"));
        }
        if let Some(name) = table.at(["agent", "name"].into_iter()).and_then(|name| name.as_str()) {
            part.called = name.into();
        }
    }

    /// Reduces `merged` to the modules, links and actuators of one agent.
    /// Properties of other agents that it reads get their names. Returns true if another agent has the clock.
    pub(super) fn leave(
        &self,
        agent: &str,
        merged: &mut Table,
        sources: &Sources,
        extra_tables: &[String],
        changes: &[Table],
        problems: &mut Problems,
    ) -> bool {
        if self.0.values().all(|part| part.runs.is_none()) || !self.0.contains_key(agent) {
            return false;
        }
        let side = AgentSide { parts: &self.0, agent, names: ScopeNames::of(merged, sources) };
        side.check(problems);
        side.check_changes(changes, problems);
        for section in SECTIONS {
            let Some(Value::Table(table)) =
                merged.entries.get_mut(section).map(|entry| &mut entry.value.value)
            else {
                continue;
            };
            table.entries.retain(|name, entry| side.keeps(owner_of(name, entry), entry, sources, problems));
            for entry in table.entries.values_mut() {
                match section {
                    "links" => make_table(&mut entry.value, &|url| side.address(url), problems),
                    "actuators" => make_commands(&mut entry.value, &|url| side.address(url), problems),
                    // The reader of the section reports a value that is not a table.
                    _ => {}
                }
            }
        }
        for name in extra_tables.iter().map(String::as_str).chain(["mission"]) {
            if let Some(entry) = merged.entries.get_mut(name) {
                each_text(&mut entry.value.value, &|text| side.address(text));
            }
        }
        let source = merged.at(["time", "source"].into_iter()).and_then(|source| source.as_str());
        let keeper = source.and_then(|source| side.owner(first(source)));
        let is_elsewhere = keeper.is_some_and(|keeper| keeper != agent);
        if is_elsewhere {
            merged.entries.remove("time");
        }
        self.add_default_addresses(agent, merged);
        is_elsewhere
    }

    /// Adds the endpoints of the other agents on this machine.
    /// Endpoints of the file take precedence.
    fn add_default_addresses(&self, agent: &str, merged: &mut Table) {
        let empty = |key| TableEntry { key, value: Spanned::new(Value::Table(Table::default()), key) };
        let mut table = merged;
        let key = self.0[agent].key;
        for name in ["share", "agents"] {
            let entry = table.entries.entry(name.into()).or_insert_with(|| empty(key));
            // The reader of the section reports a value that is not a table.
            let Value::Table(inner) = &mut entry.value.value else { return };
            table = inner;
        }
        for (_, part) in self.0.iter().filter(|(name, _)| *name != agent) {
            table.entries.entry(part.called.clone()).or_insert_with(|| empty(part.key));
        }
    }
}

/// First parts of the names of modules and actuators.
/// For those of a robot it is the robot's name.
struct ScopeNames {
    /// Place where each is written first.
    common: SortedMap<String, Span>,
    /// The names in the agent's own table.
    own: SortedSet<String>,
}

impl ScopeNames {
    fn of(merged: &Table, sources: &Sources) -> Self {
        let mut names = Self { common: SortedMap::new(), own: SortedSet::new() };
        let tables =
            ["modules", "actuators"].into_iter().filter_map(|section| merged.get(section)?.as_table());
        for (name, entry) in tables.flat_map(Table::iter) {
            match is_own(sources, entry.key) {
                true => drop(names.own.insert(first(name).into())),
                false => drop(names.common.entry(first(name).into()).or_insert(entry.key)),
            }
        }
        names
    }
}

/// View of a file for one of its agents.
struct AgentSide<'a> {
    parts: &'a SortedMap<String, AgentPart>,
    agent: &'a str,
    names: ScopeNames,
}

impl AgentSide<'_> {
    /// Returns the agent whose `runs` contains a name.
    fn runner(&self, name: &str) -> Option<&str> {
        let runs = |part: &AgentPart| part.runs.iter().flatten().any(|run| run.value == name);
        self.parts.iter().find(|(_, part)| runs(part)).map(|(agent, _)| agent.as_str())
    }

    /// Returns the agents without `runs`, which run the rest.
    fn others(&self) -> impl Iterator<Item = &str> {
        self.parts.iter().filter(|(_, part)| part.runs.is_none()).map(|(agent, _)| agent.as_str())
    }

    /// Returns the agent that has a module or robot; `None` if it is unknown.
    fn owner(&self, name: &str) -> Option<&str> {
        if let Some(runner) = self.runner(name) {
            return Some(runner);
        }
        let is_here = self.others().any(|other| other == self.agent);
        match self.names.common.contains_key(name) && !is_here {
            true => self.others().next(),
            false => (is_here || self.names.own.contains(name)).then_some(self.agent),
        }
    }

    fn check(&self, problems: &mut Problems) {
        let known: Vec<&str> = self.names.common.keys().chain(&self.names.own).map(String::as_str).collect();
        for run in self.parts[self.agent].runs.iter().flatten() {
            if !known.contains(&run.value.as_str()) {
                let message = ErrorCode::Name.of(format!("no robot or module is called `{}`", run.value));
                problems.add(run.span, message, suggestion(run, &known));
            }
            if let Some(other) = self.runner(run).filter(|other| *other != self.agent) {
                let message = format!("`{other}` runs `{}`, too", run.value);
                problems.add(run.span, message, "name it in the `runs` of one agent");
            }
        }
        let rest = self.names.common.iter().filter(|(name, _)| self.runner(name).is_none());
        let others: Vec<_> = self.others().map(|other| format!("`{other}`")).collect();
        for (name, key) in rest {
            let help =
                "name it in the `runs` of one agent; an agent without `runs` runs all that no other one does";
            match others.len() {
                0 => problems.add(*key, format!("no agent runs `{name}`"), help),
                1 => {}
                _ => {
                    let message = format!("several agents run `{name}`: {}", others.join(", "));
                    problems.add(*key, message, help);
                }
            }
        }
    }

    /// Reports changes at run time that belong to other agents.
    /// They would be lost here.
    fn check_changes(&self, changes: &[Table], problems: &mut Problems) {
        let sections = changes.iter().flat_map(|change| SECTIONS.map(|section| change.get(section)));
        let tables = sections.flatten().filter_map(|section| section.as_table());
        for (name, entry) in tables.flat_map(Table::iter) {
            if let Some(owner) = self.owner(first(name)).filter(|owner| *owner != self.agent) {
                let called = &self.parts[owner].called;
                let message = format!("agent `{called}` runs `{}`", first(name));
                problems.add(entry.key, message, format!("change it there: --agent {called}"));
            }
        }
    }

    /// Returns true if the agent has a module, an actuator or the input of a link.
    fn keeps(&self, name: &str, entry: &TableEntry, sources: &Sources, problems: &mut Problems) -> bool {
        let is_own = is_own(sources, entry.key);
        match self.runner(first(name)) {
            Some(runner) if is_own && runner != self.agent => {
                let help = format!("write it in [agents.{runner}]");
                problems.add(entry.key, format!("`{runner}` runs `{}`", first(name)), help);
                false
            }
            Some(runner) => runner == self.agent,
            None => is_own || self.parts[self.agent].runs.is_none(),
        }
    }

    /// Returns the URL of another agent's property, for a path in the file.
    fn address(&self, text: &str) -> Option<String> {
        let url = Url::parse(text).ok().filter(|url| url.agent().is_none() && text.starts_with('/'))?;
        let path = url.path_in("");
        let owner = self.owner(first(&path)).filter(|owner| *owner != self.agent)?;
        Some(format!("slate://{}/{path}", self.parts[owner].called))
    }
}

/// Returns the name that decides on the owner of a setting.
/// It is the setting's name, or for a link out of all agents that of its property.
fn owner_of<'t>(name: &'t str, entry: &'t TableEntry) -> &'t str {
    if ExternalUrl::parse(name).is_none() {
        return name;
    }
    let source = match &entry.value.value {
        Value::Table(table) => table.get("from").and_then(|from| from.as_str()),
        _ => entry.value.as_str(),
    };
    source.map_or(name, |source| source.trim_start_matches('/'))
}

/// Returns true if a place is in one agent's table, or a change at run time.
fn is_own(sources: &Sources, span: Span) -> bool {
    let source = &sources.0[span.source];
    source.place.own || source.kind == SourceKind::Change
}

/// Returns the first part of a name, up to a slash.
fn first(name: &str) -> &str {
    name.split('/').next().unwrap_or(name)
}

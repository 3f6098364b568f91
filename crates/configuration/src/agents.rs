//! Several agents in one file.

use std::collections::BTreeSet;

use super::files::Files;
use super::layers::Layers;
use super::problems::suggestion;
use super::read::{Main, Read, Request, layers, read};
use super::source::{SourceKind, Span, Spanned};
use super::value::{Entry, Table, Value};
use super::{Diagnostic, Options, Report, report};
use crate::mistake::Mistake;

/// One of several agents.
#[derive(Clone, Debug)]
pub(super) struct Described {
    pub(super) name: String,
    pub(super) others: Vec<String>,
}

/// Reads a configuration, and looks for mistakes in what the file says of other agents: whoever starts one of them
/// may be far away.
pub(super) fn read_all(main: &Main, options: &Options) -> Read {
    let mut read_one = read(&Request::new(main, options), Files::default());
    let mut said = BTreeSet::new();
    let mut diagnostics: Vec<Diagnostic> = Vec::new();
    let mut add = |report: &Report| {
        // What stands outside of `agents` is wrong for all of them.
        let new = report.diagnostics().iter().filter(|diagnostic| said.insert(diagnostic.in_a_line()));
        diagnostics.extend(new.cloned());
    };
    if let Err(report) = &read_one.result {
        add(report);
    }
    for other in &read_one.others {
        // The command line and the file of this computer are for the one that is started here.
        let options = Options { agent: Some(other.clone()), sets: Vec::new(), host: None, ..options.clone() };
        let request = Request { elsewhere: true, ..Request::new(main, &options) };
        match (read(&request, read_one.files.clone()).result, &read_one.result) {
            (Err(report), _) => add(&report),
            (Ok(configuration), Ok(own)) if configuration.agent_name() == own.agent_name() => {
                let message = format!("two agents are called `{}`", own.agent_name());
                let help = "an agent is found by its name; leave `agent.name` out, and each is called like its table";
                let name = &configuration.agent.name;
                add(&configuration.diagnostic(name.span, message, Some(help.into())).into());
            }
            _ => {}
        }
    }
    if !diagnostics.is_empty() {
        read_one.result = Err(diagnostics.into());
    }
    read_one
}

/// The names of the agents that a file describes.
pub(super) fn names(main: &Main, options: &Options) -> Result<Vec<String>, Report> {
    let layers = layers(&Request::new(main, options), Files::default());
    if layers.incomplete {
        return Err(report(&layers.sources, layers.problems));
    }
    Ok(layers.agents.into_keys().collect())
}

impl Layers {
    /// Notes the agents that a text describes, and reads what it says of the wanted one.
    pub(super) fn agents(&mut self, text: usize, agents: &Entry) {
        if self.own {
            let help = "one agent has no others in it: write them in the file that includes this one";
            return self.problems.add(agents.key, "`agents` stands in what belongs to one agent", help);
        }
        let Some(agents) = self.problems.as_table("agents", agents) else { return };
        for (name, entry) in agents.iter() {
            let good = self.problems.agent_name(name, entry.key);
            if let Some(table) = self.problems.as_table(&format!("agents.{name}"), entry).filter(|_| good) {
                self.agents.entry(name.into()).or_insert(entry.key);
                self.division.note(name, entry, table, &mut self.problems);
            }
        }
        let Some(wanted) = self.agent.clone().filter(|wanted| self.agents.contains_key(wanted)) else {
            return;
        };
        let part = self.part(text);
        let document = self.sources.0[text].document.as_ref();
        let own = document
            .and_then(|document| document.get("agents")?.as_table_like()?.get(&wanted)?.as_table_like());
        let Some(own) = own else { return };
        let mut table = Table::of_item(own, part, &mut self.problems);
        // It is noted.
        table.entries.remove("runs");
        self.is_named |= table.at(["agent", "name"].into_iter()).is_some();
        self.own = true;
        self.table(part, table);
        self.own = false;
    }

    /// Names the agent like its table, unless that says otherwise: files that it includes may be those of others too.
    pub(super) fn name_agent(&mut self) {
        let wanted = self.agent.as_ref().filter(|_| !self.is_named);
        let Some((name, &key)) = wanted.and_then(|wanted| self.agents.get_key_value(wanted)) else { return };
        let entry = |value| Entry { key, value: Spanned::new(value, key) };
        let table = |name: &str, entry| Table { entries: [(name.to_owned(), entry)].into() };
        let name = table("name", entry(Value::Text(name.clone())));
        self.merged.merge(table("agent", entry(Value::Table(name))));
    }

    /// What a setting says of the wanted agent; nothing if it is of another one, or wrong.
    pub(super) fn of_wanted(&mut self, kind: SourceKind, mut setting: Table) -> Option<Table> {
        let Some(entry) = setting.entries.remove("agents") else { return Some(setting) };
        let mut own = None;
        for (name, entry) in self.problems.as_table("agents", &entry)?.iter() {
            let is_wanted = self.agent.as_deref() == Some(name) && self.agents.contains_key(name);
            if !self.agents.contains_key(name) {
                self.unknown(name, Some(entry.key));
            } else if let Some(table) = self.problems.as_table(&format!("agents.{name}"), entry) {
                self.division.note(name, entry, table, &mut self.problems);
                if is_wanted {
                    let mut table = table.clone();
                    // It is noted.
                    table.entries.remove("runs");
                    own = Some(table);
                } else if kind == SourceKind::Change {
                    let help =
                        format!("change it there: --agent {name}, and the setting without `agents.{name}.`");
                    self.problems.add(
                        entry.key,
                        Mistake::OtherAgent.of(format!("`{name}` is another agent")),
                        help,
                    );
                }
            }
        }
        own
    }

    /// Whether it is clear which agent is meant; else a problem is added.
    pub(super) fn is_chosen(&mut self) -> bool {
        let first = self.agents.values().next().copied();
        match (self.agent.clone(), first) {
            (None, Some(first)) => {
                let names: Vec<_> = self.agents.keys().map(|name| format!("`{name}`")).collect();
                let message =
                    format!("several agents are described, and none is chosen: {}", names.join(", "));
                let name = self.agents.keys().next().map_or("", String::as_str);
                let help = format!("`slate run` starts them all, `slate run --agent {name}` one of them");
                self.problems.add(first, message, help);
                false
            }
            (Some(name), Some(first)) if !self.agents.contains_key(&name) => {
                self.unknown(&name, Some(first));
                false
            }
            _ => true,
        }
    }

    /// A name that no agent has.
    pub(super) fn unknown(&mut self, name: &str, span: Option<Span>) {
        // It may stand in what could not be read.
        if self.incomplete {
            return;
        }
        let known: Vec<&str> = self.agents.keys().map(String::as_str).collect();
        let help = match known[..] {
            [] => "the configuration is that of one agent: leave the name out".into(),
            _ => suggestion(name, &known),
        };
        self.problems.0.push(super::problems::Problem {
            span,
            message: Mistake::OtherAgent.of(format!("no agent is called `{name}`")),
            help: Some(help),
        });
    }
}

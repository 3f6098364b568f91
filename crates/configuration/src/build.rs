use std::cmp::Ordering;
use std::path::Path;

use super::layers::CHOICES;
use super::links::WrittenLinks;
use super::model::{Agent, Mission, Module};
use super::path::absolute;
use super::problems::Problems;
use super::source::{Sources, Span, Spanned};
use super::stages::LoopReader;
use super::value::{Table, Value};
use crate::error_code::ErrorCode;

/// Reader of an agent's model from the merged settings.
/// It adds errors to `problems`.
pub(super) struct Build<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl Build<'_> {
    pub(super) fn top(&mut self, root: &Table, extra: &[String]) {
        let mut known =
            vec!["agent", "loop", "time", "mission", "log", "share", "snapshot", "record", CHOICES];
        known.extend(["plugins", "modules", "links", "actuators", "robots"]);
        known.extend(extra.iter().map(String::as_str));
        let choices = self.choices(root, &known);
        known.extend(choices);
        self.problems.unknown_keys(root, "at the top", &known);
    }

    /// Returns the names of the settings that choose a variant.
    /// Reports invalid choices, and unknown keys in variants.
    fn choices<'a>(&mut self, root: &'a Table, sections: &[&str]) -> Vec<&'a str> {
        let Some(choices) = self.problems.table(root, CHOICES) else { return Vec::new() };
        // Invalid settings of a variant are reported where they are read.
        let reported = ["include", "agents"].into_iter().chain(choices.iter().map(|(name, _)| name));
        let settable: Vec<&str> = sections.iter().copied().chain(reported).collect();
        for (name, entry) in choices.iter() {
            if sections.contains(&name) {
                let message = ErrorCode::Key.of(format!("`{name}` is a section and chooses no variant"));
                self.problems.add(entry.key, message, "give the choice another name");
                continue;
            }
            let Some(variants) = self.problems.as_table(&format!("{CHOICES}.{name}"), entry) else {
                continue;
            };
            for (variant, entry) in variants.iter() {
                let settings = entry.value.as_table().into_iter();
                let place = format!("in [{CHOICES}.{name}.{variant}]");
                settings.for_each(|settings| self.problems.unknown_keys(settings, &place, &settable));
            }
            let known: Vec<_> = variants.iter().map(|(known, _)| known).collect();
            let expected = match known[..] {
                [] => format!("write a variant, such as [{CHOICES}.{name}.usual]"),
                _ => format!("expected one of {}", known.join(", ")),
            };
            match root.get(name) {
                Some(chosen) if chosen.as_str().is_some_and(|chosen| known.contains(&chosen)) => {}
                Some(chosen) => {
                    let found =
                        chosen.as_str().map_or_else(|| chosen.describe().into(), |name| format!("`{name}`"));
                    let message =
                        ErrorCode::Value.of(format!("`{name}` chooses {found}, which is not a variant"));
                    self.problems.add(chosen.span, message, expected);
                }
                None => {
                    let message = ErrorCode::Value.of(format!("no variant of `{name}` is chosen"));
                    let help = format!("write {name} = \"...\" at the top; {expected}");
                    self.problems.add(entry.key, message, help);
                }
            }
        }
        choices.iter().map(|(name, _)| name).collect()
    }

    /// Reads the agent's name, seed and loop; `None` only after a problem.
    /// The built-in defaults contain everything that has no other default.
    pub(super) fn agent(&mut self, root: &Table, main: Span) -> Option<Agent> {
        let empty = Table::default();
        let agent = self.problems.table(root, "agent").unwrap_or(&empty);
        self.problems.unknown_keys(agent, "in [agent]", &["name", "seed"]);
        let name = match agent.get("name") {
            Some(value) => {
                let name = self.problems.as_text("name", value, "robot1");
                name.filter(|name| self.problems.agent_name(name, name.span))
            }
            None => Some(Spanned::new(name_of_file(&self.sources.of(main).name), main)),
        };
        let seed = agent.get("seed").and_then(|value| self.seed(value));
        let main_loop = LoopReader { problems: self.problems }.main_loop(root);
        Some(Agent { name: name?, seed: seed?, main_loop: main_loop? })
    }

    fn seed(&mut self, value: &Spanned<Value>) -> Option<Spanned<u64>> {
        let found = match value.as_integer().map(|number| (number, u64::try_from(number))) {
            Some((_, Ok(seed))) => return Some(Spanned::new(seed, value.span)),
            Some((number, Err(_))) => number.to_string(),
            None => value.describe().into(),
        };
        let message = ErrorCode::Value.of(format!("`seed` takes a whole number from 0, found {found}"));
        self.problems.add(value.span, message, "write a number such as seed = 1");
        None
    }

    pub(super) fn time_source(&mut self, root: &Table) -> Option<Spanned<String>> {
        let table = self.problems.table(root, "time")?;
        self.problems.unknown_keys(table, "in [time]", &["source"]);
        let source = self.problems.text(table, "source", "simulator")?;
        self.problems.name("a module", &source, true, source.span).then_some(source)
    }

    pub(super) fn mission(&mut self, root: &Table) -> Option<Mission> {
        let table = self.problems.table(root, "mission")?;
        self.problems.unknown_keys(table, "in [mission]", &["outcome"]);
        // A layer above takes the mission of one below away.
        if table.get("outcome").is_some_and(|outcome| outcome.value == Value::Bool(false)) {
            return None;
        }
        let outcome = self.problems.text(table, "outcome", "referee/verdict")?;
        let url = self.problems.url(&outcome, outcome.span)?;
        Some(Mission { outcome: Spanned::new(absolute(&url, ""), outcome.span) })
    }

    fn later(&self, first: Span, second: Span) -> Ordering {
        self.sources.rank(first).cmp(&self.sources.rank(second))
    }

    /// Leaves either the link or the value of each input, that of the later layer.
    pub(super) fn links_or_values(&mut self, modules: &mut [Module], links: &mut WrittenLinks) {
        for module in modules {
            let name = &module.name.value;
            module.inputs.entries.retain(|port, entry| {
                let path = format!("{name}/{port}");
                let Some(place) = links.place_of(&path) else { return true };
                match self.later(place, entry.key) {
                    Ordering::Less => {
                        links.remove(&path);
                        true
                    }
                    Ordering::Greater => false,
                    Ordering::Equal => {
                        let help = format!(
                            "remove the value or the link; the link is at {}",
                            self.sources.origin(place)
                        );
                        self.problems.add(
                            entry.key,
                            ErrorCode::TwoSources.of(format!("input `{path}` has both a link and a value")),
                            help,
                        );
                        true
                    }
                }
            });
        }
    }
}

/// Returns the stem of a file's name, restricted to an agent's letters.
fn name_of_file(file: &str) -> String {
    let stem =
        Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let all = stem.chars().map(|c| if letter(c) { c } else { '_' });
    let name: String = all.take(super::problems::LONGEST_AGENT_NAME).collect();
    if name.is_empty() { "agent".into() } else { name }
}

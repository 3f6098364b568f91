use std::cmp::Ordering;
use std::path::Path;

use slate_blackboard::Url;
use slate_module::{Stage, Trigger};

use super::model::{Actuator, Agent, Isolation, Limit, Link, Mission, Module, RateLimit};
use super::problems::Problems;
use super::source::{Sources, Span, Spanned};
use super::value::{Entry, Table, Value};
use crate::mistake::Mistake;

/// How long a command is followed when nothing else is said, nanoseconds.
const TIME_TO_LIVE: u64 = 100_000_000;

/// Makes the model out of the merged settings; what is wrong is added to `problems`.
pub(super) struct Build<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl Build<'_> {
    pub(super) fn top(&mut self, root: &Table, extra: &[String]) {
        let mut known = vec!["agent", "loop", "time", "mission", "log", "share", "snapshot", "record"];
        known.extend(["plugins", "modules", "links", "actuators", "robots"]);
        known.extend(extra.iter().map(String::as_str));
        self.problems.unknown_keys(root, "at the top", &known);
    }

    /// None only after a problem was added: the built-in defaults hold all that has no other default.
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
        let main_loop = self.main_loop(root);
        Some(Agent { name: name?, seed: seed?, main_loop: main_loop? })
    }

    fn seed(&mut self, value: &Spanned<Value>) -> Option<Spanned<u64>> {
        let found = match value.as_integer().map(|number| (number, u64::try_from(number))) {
            Some((_, Ok(seed))) => return Some(Spanned::new(seed, value.span)),
            Some((number, Err(_))) => number.to_string(),
            None => value.describe().into(),
        };
        let message = Mistake::Value.of(format!("`seed` takes a whole number from 0, found {found}"));
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
        let outcome = self.problems.text(table, "outcome", "referee/verdict")?;
        let url = self.problems.url(&outcome, outcome.span)?;
        Some(Mission { outcome: Spanned::new(absolute(&url, ""), outcome.span) })
    }

    pub(super) fn modules(&mut self, root: &Table) -> Vec<Module> {
        let table = self.problems.table(root, "modules");
        table.into_iter().flat_map(Table::iter).filter_map(|(name, entry)| self.module(name, entry)).collect()
    }

    fn module(&mut self, name: &str, entry: &Entry) -> Option<Module> {
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
            memory: self.problems.text(table, "memory", "r2.memory").map(|file| self.beside(&file)),
            trigger: self.trigger(table),
            deadline: self.problems.duration(table, "deadline"),
        })
    }

    /// The kind of a module, which is its own name unless said; also reports unknown keys.
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
            let message =
                Mistake::Key.of(format!("module `{name}` has `plugin`, which is called `kind` in a module"));
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
        match self.one_of(table, "every", "on")? {
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

    /// Of two keys that exclude each other, the one that the later layer sets; one layer can't set both.
    fn one_of<'k, 't>(&mut self, table: &'t Table, a: &'k str, b: &'k str) -> Option<(&'k str, &'t Entry)> {
        match (table.entries.get(a), table.entries.get(b)) {
            (Some(first), Some(second)) => match self.later(first.key, second.key) {
                Ordering::Less => Some((b, second)),
                Ordering::Greater => Some((a, first)),
                Ordering::Equal => {
                    self.problems.add(
                        second.key,
                        Mistake::Key.of(format!("`{a}` and `{b}` exclude each other")),
                        "keep one of the two",
                    );
                    None
                }
            },
            (Some(entry), None) => Some((a, entry)),
            (None, Some(entry)) => Some((b, entry)),
            (None, None) => None,
        }
    }

    fn later(&self, first: Span, second: Span) -> Ordering {
        self.sources.rank(first).cmp(&self.sources.rank(second))
    }

    /// An input either has a link or holds a value: what the later layer says.
    pub(super) fn links_or_values(&mut self, modules: &mut [Module], links: &mut Vec<Link>) {
        for module in modules {
            let name = &module.name.value;
            module.inputs.entries.retain(|port, entry| {
                let path = format!("{name}/{port}");
                let Some(at) = links.iter().position(|link| link.to.value == path) else { return true };
                match self.later(links[at].to.span, entry.key) {
                    Ordering::Less => {
                        links.remove(at);
                        true
                    }
                    Ordering::Greater => false,
                    Ordering::Equal => {
                        let help = format!(
                            "remove the value or the link; the link is at {}",
                            self.sources.origin(links[at].to.span)
                        );
                        self.problems.add(
                            entry.key,
                            Mistake::TwoSources.of(format!("input `{path}` has both a link and a value")),
                            help,
                        );
                        true
                    }
                }
            });
        }
    }

    pub(super) fn actuators(&mut self, root: &Table, agent: &str) -> Vec<Actuator> {
        let table = self.problems.table(root, "actuators");
        table
            .into_iter()
            .flat_map(Table::iter)
            .filter_map(|(name, entry)| self.actuator(name, entry, agent))
            .collect()
    }

    fn actuator(&mut self, name: &str, entry: &Entry, agent: &str) -> Option<Actuator> {
        let known = ["command", "commands", "modules", "limits", "rate_limits", "time_to_live", "safe"];
        let table = self.problems.as_table(&format!("actuators.{name}"), entry)?;
        self.problems.unknown_keys(table, &format!("in actuator `{name}`"), &known);
        let commands = self.commands(name, entry.key, table, agent);
        let modules = table.get("modules").map(|list| self.problems.texts("modules", list, "behaviour"));
        let limits = self.fields(table, "limits", Self::limit);
        let rate_limits = self.fields(table, "rate_limits", Self::rate_limit);
        let safe = self.problems.table(table, "safe").cloned().unwrap_or_default();
        for limit in &limits {
            let Some(value) = safe.get(&limit.field) else { continue };
            if value.as_f64().is_some_and(|safe| !(limit.low..=limit.high).contains(&safe)) {
                let help = format!("choose a value from {} to {}", limit.low, limit.high);
                self.problems.add(
                    value.span,
                    format!("the safe `{}` is out of its limits", limit.field.value),
                    help,
                );
            }
        }
        let time_to_live = match table.get("time_to_live") {
            Some(_) => self.problems.duration(table, "time_to_live")?,
            None => Spanned::new(TIME_TO_LIVE, entry.key),
        };
        let name = Spanned::new(name.into(), entry.key);
        Some(Actuator {
            name,
            commands,
            modules: modules.unwrap_or_default(),
            limits,
            rate_limits,
            time_to_live,
            safe,
        })
    }

    fn commands(&mut self, name: &str, key: Span, table: &Table, agent: &str) -> Vec<Spanned<Url>> {
        if ["command", "commands", "modules"].iter().all(|key| table.get(key).is_none()) {
            let help = "write command = \"module/property\", or commands = [...] for several";
            self.problems.add(key, format!("nothing commands actuator `{name}`"), help);
        }
        let Some((key, entry)) = self.one_of(table, "command", "commands") else { return Vec::new() };
        let texts = match key {
            "command" => self.problems.as_text(key, &entry.value, "module/property").into_iter().collect(),
            _ => self.named_commands(entry),
        };
        let url = |text: Spanned<String>| {
            let url = self.problems.url(&text, text.span)?;
            Some(Spanned::new(absolute(&url, agent), text.span))
        };
        texts.into_iter().filter_map(url).collect()
    }

    /// The commands of a list that are not taken off it, in the order in which they are written.
    fn named_commands(&mut self, list: &Entry) -> Vec<Spanned<String>> {
        let Some(table) = self.problems.as_table("commands", list) else { return Vec::new() };
        let named = table.iter().filter_map(|(name, entry)| {
            let stays = self.problems.flag(table, name).is_some_and(|flag| flag.value);
            stays.then(|| Spanned::new(name.to_owned(), entry.key))
        });
        let mut named: Vec<_> = named.collect();
        named.sort_by_key(|name| (self.sources.rank(name.span), name.span.start));
        named
    }

    fn fields<T>(
        &mut self,
        table: &Table,
        name: &str,
        read: impl Fn(&mut Self, Spanned<String>, &Entry) -> Option<T>,
    ) -> Vec<T> {
        let fields = self.problems.table(table, name).into_iter().flat_map(Table::iter);
        fields.filter_map(|(field, entry)| read(self, Spanned::new(field.into(), entry.key), entry)).collect()
    }

    fn limit(&mut self, field: Spanned<String>, entry: &Entry) -> Option<Limit> {
        let example = format!("write the lowest and the highest value: {} = [-1.0, 1.0]", field.value);
        let Some([low, high]) = entry.value.as_list() else {
            let message = Mistake::Value.of(format!(
                "the limits of `{}` are a list of two numbers, found {}",
                field.value,
                entry.value.describe()
            ));
            self.problems.add(entry.value.span, message, example);
            return None;
        };
        let (low, high) = (self.problems.number(&field, low)?, self.problems.number(&field, high)?);
        if low > high {
            self.problems.add(
                entry.value.span,
                format!("the lowest `{}` is above the highest", field.value),
                example,
            );
            return None;
        }
        Some(Limit { field, low, high })
    }

    fn rate_limit(&mut self, field: Spanned<String>, entry: &Entry) -> Option<RateLimit> {
        let per_second = self.problems.number(&field, &entry.value)?;
        if per_second <= 0.0 {
            let help = format!("write how much it may change in a second: {} = 30.0", field.value);
            self.problems.add(
                entry.value.span,
                Mistake::Value.of(format!("the rate limit of `{}` must be above zero", field.value)),
                help,
            );
            return None;
        }
        Some(RateLimit { field, per_second })
    }
}

/// The URL without a scope, and without the agent when that is this one.
pub(super) fn absolute(url: &Url, agent: &str) -> Url {
    if url.agent().is_some_and(|other| other != agent) {
        return url.clone();
    }
    Url::parse(&format!("/{}", url.path_in(""))).unwrap_or_else(|_| url.clone())
}

/// The stem of a file's name, as far as an agent can have it.
fn name_of_file(file: &str) -> String {
    let stem =
        Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let all = stem.chars().map(|c| if letter(c) { c } else { '_' });
    let name: String = all.take(super::problems::LONGEST_AGENT_NAME).collect();
    if name.is_empty() { "agent".into() } else { name }
}

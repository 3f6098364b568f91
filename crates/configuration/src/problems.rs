use slate_blackboard::{Url, nearest_names};

use super::source::{Span, Spanned};
use super::value::{Table, TableEntry, Value};
use crate::error_code::{ErrorCode, Message};
use crate::team::TEAM;

/// Problem at a place, before its text is looked up.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) span: Option<Span>,
    pub(super) message: Message,
    pub(super) help: Option<String>,
}

/// Problems found so far.
/// Its methods read single settings and add their problems.
#[derive(Debug, Default)]
pub(super) struct Problems(pub(super) Vec<Problem>);

impl Problems {
    pub(super) fn add(&mut self, span: Span, message: impl Into<Message>, help: impl Into<String>) {
        self.0.push(Problem { span: Some(span), message: message.into(), help: Some(help.into()) });
    }

    pub(super) fn wrong_type(&mut self, name: &str, value: &Spanned<Value>, expected: &str, help: &str) {
        self.add(
            value.span,
            ErrorCode::Value.of(format!("`{name}` takes {expected}, found {}", value.describe())),
            help,
        );
    }

    /// Reports the unknown keys of a table.
    /// `place` names the table, such as `in [loop]`.
    pub(super) fn unknown_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        for (name, entry) in table.iter().filter(|(name, _)| !known.contains(name)) {
            self.add(
                entry.key,
                ErrorCode::Key.of(format!("unknown key `{name}` {place}")),
                suggestion(name, known),
            );
        }
    }

    pub(super) fn table<'a>(&mut self, parent: &'a Table, name: &str) -> Option<&'a Table> {
        self.as_table(name, parent.entries.get(name)?)
    }

    pub(super) fn as_table<'a>(&mut self, name: &str, entry: &'a TableEntry) -> Option<&'a Table> {
        let table = entry.value.as_table();
        if table.is_none() {
            self.wrong_type(
                name,
                &entry.value,
                "a table",
                &format!("write a section [{name}] or {name} = {{ ... }}"),
            );
        }
        table
    }

    pub(super) fn text(&mut self, table: &Table, name: &str, example: &str) -> Option<Spanned<String>> {
        self.as_text(name, table.get(name)?, example)
    }

    pub(super) fn as_text(
        &mut self,
        name: &str,
        value: &Spanned<Value>,
        example: &str,
    ) -> Option<Spanned<String>> {
        let text = value.as_str();
        if text.is_none() {
            self.wrong_type(
                name,
                value,
                "text",
                &format!("put text in quotes, such as {name} = \"{example}\""),
            );
        }
        text.map(|text| Spanned::new(text.into(), value.span))
    }

    /// Reads one text or a list of texts.
    pub(super) fn texts(
        &mut self,
        name: &str,
        value: &Spanned<Value>,
        example: &str,
    ) -> Vec<Spanned<String>> {
        let items = value.as_list().unwrap_or(std::slice::from_ref(value));
        items.iter().filter_map(|item| self.as_text(name, item, example)).collect()
    }

    pub(super) fn flag(&mut self, table: &Table, name: &str) -> Option<Spanned<bool>> {
        let value = table.get(name)?;
        let flag = value.as_bool();
        if flag.is_none() {
            self.wrong_type(name, value, "true or false", &format!("write {name} = true or {name} = false"));
        }
        flag.map(|flag| Spanned::new(flag, value.span))
    }

    /// Reads a duration greater than 0, ns.
    pub(super) fn duration(&mut self, table: &Table, name: &str) -> Option<Spanned<u64>> {
        let value = table.get(name)?;
        let example = |number: &str| {
            format!("a duration is text with a unit of ns, us, ms, s or min, such as {name} = \"{number}ms\"")
        };
        let Some(text) = value.as_str() else {
            let number = match value.value {
                Value::Integer(number) if number > 0 => number.to_string(),
                Value::Float(number) if number > 0.0 && number < 1e6 => number.to_string(),
                _ => "20".into(),
            };
            self.wrong_type(name, value, "a duration", &example(&number));
            return None;
        };
        match slate_module::parse_duration(text) {
            Some(0) => self.add(
                value.span,
                ErrorCode::Value.of(format!("`{name}` must be greater than zero")),
                example("20"),
            ),
            None => {
                let message = format!("expected a duration such as \"200ms\", found {text:?}");
                self.add(value.span, ErrorCode::Value.of(message), example("20"));
            }
            Some(nanoseconds) => return Some(Spanned::new(nanoseconds, value.span)),
        }
        None
    }

    /// Reads a whole number from 1 to a limit.
    pub(super) fn count_from_one(&mut self, table: &Table, name: &str, limit: u64) -> Option<Spanned<u64>> {
        let value = table.get(name)?;
        let number = value.as_integer().and_then(|number| u64::try_from(number).ok());
        match number.filter(|number| (1..=limit).contains(number)) {
            Some(number) => Some(Spanned::new(number, value.span)),
            None => {
                let message = ErrorCode::Value
                    .of(format!("`{name}` takes a whole number from 1, found {}", value.value));
                let help = match limit {
                    u64::MAX => format!("write a number such as {name} = 5"),
                    limit => format!("write a number up to {limit}, such as {name} = 16"),
                };
                self.add(value.span, message, help);
                None
            }
        }
    }

    /// Reads a finite number.
    pub(super) fn number(&mut self, name: &str, value: &Spanned<Value>) -> Option<f64> {
        match value.as_f64() {
            Some(number) if number.is_finite() => return Some(number),
            Some(_) => self.add(
                value.span,
                ErrorCode::Value.of(format!("`{name}` must be finite")),
                "write a number such as 1.5",
            ),
            None => self.wrong_type(name, value, "a number", "write a number such as 1.5, without quotes"),
        }
        None
    }

    /// Reads one of a few names.
    pub(super) fn choice<T: Copy>(
        &mut self,
        name: &str,
        value: &Spanned<Value>,
        choices: &[(&str, T)],
    ) -> Option<Spanned<T>> {
        let text = self.as_text(name, value, choices.first().map_or("", |(name, _)| name))?;
        let found = choices.iter().find(|(name, _)| *name == text.value);
        if found.is_none() {
            let known: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
            let mut help = suggestion(&text, &known);
            if help.starts_with("did") {
                help.push_str(&format!(" known: {}", quoted(known.into_iter())));
            }
            self.add(text.span, ErrorCode::Value.of(format!("`{name}` can't be `{}`", text.value)), help);
        }
        found.map(|(_, choice)| Spanned::new(*choice, text.span))
    }

    /// Reads the URL of a property, which has at least two parts.
    pub(super) fn url(&mut self, text: &str, span: Span) -> Option<Url> {
        let help = "a property is module/property, /module/property or slate://agent/module/property";
        match Url::parse(text) {
            Ok(url) if url.path_in("").contains('/') || url.agent() == Some(TEAM) => return Some(url),
            Ok(_) => {
                self.add(span, ErrorCode::Name.of(format!("`{text}` names no property, only a module")), help)
            }
            Err(error) => self.add(span, ErrorCode::Value.of(error.to_string()), help),
        }
        None
    }

    /// Checks that a text can name an agent, else reports a problem.
    pub(super) fn agent_name(&mut self, name: &str, span: Span) -> bool {
        let url = Url::parse(&format!("slate://{name}/module"));
        // A slash would begin the path.
        let good = url.is_ok_and(|url| url.agent() == Some(name));
        if name == TEAM {
            let help = "slate://team/... is what all robots of a team know together";
            self.add(span, ErrorCode::Value.of(format!("no agent can be called `{name}`")), help);
            return false;
        }
        if !good {
            let help = "an agent's name is letters, digits, _ and -, as in slate://name/module/property";
            self.add(span, ErrorCode::Value.of(format!("`{name}` can't name an agent")), help);
        } else if name.len() > LONGEST_AGENT_NAME {
            let message = format!(
                "an agent's name has at most {LONGEST_AGENT_NAME} letters, and this one {}",
                name.len()
            );
            self.add(span, ErrorCode::Value.of(message), "choose a shorter one, such as `robot1`");
            return false;
        }
        good
    }

    /// Checks that a text can name a module, an actuator or a robot.
    /// Robots have names without a slash. Reports a problem if it can't.
    pub(super) fn name(&mut self, what: &str, name: &str, slashes: bool, span: Span) -> bool {
        let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        let part = |part: &str| !part.is_empty() && part.chars().all(letter);
        let good = if slashes { name.split('/').all(part) } else { part(name) };
        if !good {
            let scope = if slashes { ", with single slashes between scopes" } else { "" };
            let fix = |c: char| Some(c.to_ascii_lowercase()).filter(|c| letter(*c)).unwrap_or('_');
            let parts: Vec<String> = if slashes { name.split('/').collect() } else { vec![name] }
                .into_iter()
                .filter(|part| !part.is_empty())
                .map(|part| part.chars().map(fix).collect())
                .collect();
            let example =
                if parts.is_empty() { String::new() } else { format!(", such as `{}`", parts.join("/")) };
            self.add(
                span,
                format!("`{name}` can't name {what}"),
                format!("a name is lowercase letters, digits and underscores{scope}{example}"),
            );
        }
        good
    }
}

/// Longest name of an agent, in bytes.
/// The name is a part of the path of its socket, which can't be long.
pub(super) const LONGEST_AGENT_NAME: usize = 64;

/// Returns the help for an unknown name: similar names, or else all names.
pub(super) fn suggestion(name: &str, known: &[&str]) -> String {
    let near = nearest_names(name, known.iter().copied());
    match &near[..] {
        [] if known.is_empty() => "none exists".into(),
        [] => format!("known: {}", quoted(known.iter().copied())),
        near => format!("did you mean {}?", quoted(near.iter().map(String::as_str))),
    }
}

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

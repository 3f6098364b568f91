//! `[actuators]`: the gates of the actuators.

use slate_blackboard::Url;

use super::exclusive::one_of;
use super::model::{Actuator, Limit, RateLimit};
use super::path::absolute;
use super::problems::Problems;
use super::source::{Sources, Span, Spanned};
use super::value::{Table, TableEntry};
use crate::error_code::ErrorCode;

/// Default time to live of a command, ns.
const TIME_TO_LIVE: u64 = 100_000_000;

/// Reader of `[actuators]`.
pub(super) struct ActuatorReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
    pub(super) agent: &'a str,
}

impl ActuatorReader<'_> {
    /// Reads the actuators, by name.
    pub(super) fn actuators(&mut self, root: &Table) -> Vec<Actuator> {
        let table = self.problems.table(root, "actuators");
        table
            .into_iter()
            .flat_map(Table::iter)
            .filter_map(|(name, entry)| self.actuator(name, entry))
            .collect()
    }

    fn actuator(&mut self, name: &str, entry: &TableEntry) -> Option<Actuator> {
        let known = ["command", "commands", "modules", "limits", "rate_limits", "time_to_live", "safe"];
        let table = self.problems.as_table(&format!("actuators.{name}"), entry)?;
        self.problems.unknown_keys(table, &format!("in actuator `{name}`"), &known);
        let commands = self.commands(name, entry.key, table);
        let modules = table.get("modules").map(|list| self.problems.texts("modules", list, "behavior"));
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

    fn commands(&mut self, name: &str, key: Span, table: &Table) -> Vec<Spanned<Url>> {
        if ["command", "commands", "modules"].iter().all(|key| table.get(key).is_none()) {
            let help = "write command = \"module/property\", or commands = [...] for several";
            self.problems.add(key, format!("nothing commands actuator `{name}`"), help);
        }
        let Some((key, entry)) = one_of(self.sources, self.problems, table, "command", "commands") else {
            return Vec::new();
        };
        let texts = match key {
            "command" => self.problems.as_text(key, &entry.value, "module/property").into_iter().collect(),
            _ => self.named_commands(entry),
        };
        let url = |text: Spanned<String>| {
            let url = self.problems.url(&text, text.span)?;
            Some(Spanned::new(absolute(&url, self.agent), text.span))
        };
        texts.into_iter().filter_map(url).collect()
    }

    /// Returns the commands of a list that are not removed, in the written order.
    fn named_commands(&mut self, list: &TableEntry) -> Vec<Spanned<String>> {
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
        read: impl Fn(&mut Self, Spanned<String>, &TableEntry) -> Option<T>,
    ) -> Vec<T> {
        let fields = self.problems.table(table, name).into_iter().flat_map(Table::iter);
        fields.filter_map(|(field, entry)| read(self, Spanned::new(field.into(), entry.key), entry)).collect()
    }

    fn limit(&mut self, field: Spanned<String>, entry: &TableEntry) -> Option<Limit> {
        let example = format!("write the lowest and the highest value: {} = [-1.0, 1.0]", field.value);
        let Some([low, high]) = entry.value.as_list() else {
            let message = ErrorCode::Value.of(format!(
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

    fn rate_limit(&mut self, field: Spanned<String>, entry: &TableEntry) -> Option<RateLimit> {
        let per_second = self.problems.number(&field, &entry.value)?;
        if per_second <= 0.0 {
            let help = format!("write how much it may change in a second: {} = 30.0", field.value);
            self.problems.add(
                entry.value.span,
                ErrorCode::Value.of(format!("the rate limit of `{}` must be above zero", field.value)),
                help,
            );
            return None;
        }
        Some(RateLimit { field, per_second })
    }
}

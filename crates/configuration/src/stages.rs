//! `[loop]`: the pace of the main loop, and its stages.

use std::time::Duration;

use slate_module::Stage;

use super::model::Loop;
use super::problems::{Problems, suggestion};
use super::source::{Span, Spanned};
use super::value::Table;
use crate::schedule::{Schedule, ScheduleError, ScheduledStage, is_stage_name};

/// Reader of `[loop]`.
pub(super) struct LoopReader<'a> {
    pub(super) problems: &'a mut Problems,
}

impl LoopReader<'_> {
    /// Reads the main loop; `None` only after a problem was added.
    pub(super) fn main_loop(&mut self, root: &Table) -> Option<Loop> {
        let empty = Table::default();
        let table = self.problems.table(root, "loop").unwrap_or(&empty);
        let known = ["period", "minimum", "hang", "stages", "members", "timeouts"];
        self.problems.unknown_keys(table, "in [loop]", &known);
        let period = self.problems.duration(table, "period");
        let minimum = self.problems.duration(table, "minimum");
        if let (Some(period), Some(minimum)) = (&period, &minimum)
            && minimum.value > period.value
        {
            let help =
                "a cycle is meant to take a `period`, and `minimum` is for one that follows a late one";
            self.problems.add(minimum.span, "`minimum` is longer than `period`", help);
        }
        let hang = self.problems.duration(table, "hang");
        let schedule = self.schedule(table);
        Some(Loop { period: period?, minimum, hang: hang?, schedule: schedule? })
    }

    fn schedule(&mut self, table: &Table) -> Option<Schedule> {
        let mut stages = match table.get("stages") {
            Some(names) => self.stages(table, names.span)?,
            None => Schedule::default().stages().to_vec(),
        };
        let names: Vec<String> = stages.iter().map(|stage| stage.name.clone()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut known = true;
        for part in ["members", "timeouts"] {
            for (name, entry) in self.problems.table(table, part).into_iter().flat_map(Table::iter) {
                if !names.contains(&name) {
                    known = false;
                    let message = format!("the loop has no stage `{name}`");
                    self.problems.add(entry.key, message, suggestion(name, &names));
                }
            }
        }
        let timeouts = self.problems.table(table, "timeouts");
        for stage in &mut stages {
            let timeout = timeouts.and_then(|timeouts| self.problems.duration(timeouts, &stage.name));
            stage.timeout = timeout.map(|timeout| Duration::from_nanos(timeout.value));
        }
        match Schedule::new(stages) {
            _ if !known => None,
            Ok(schedule) => Some(schedule),
            Err(error) => {
                let place = table.entries.get("members").or(table.entries.get("stages"));
                let help = match error {
                    ScheduleError::Missing { .. } => {
                        "name them in `members`, such as members.Sense = [\"PreLoop\", \"SensorAcquire\"]"
                    }
                    _ => "each stage of modules is in one stage of the loop",
                };
                if let Some(entry) = place {
                    self.problems.add(entry.key, error.to_string(), help);
                }
                None
            }
        }
    }

    /// Reads the named stages with their members.
    /// One of the ten standard stages without members contains itself.
    fn stages(&mut self, table: &Table, span: Span) -> Option<Vec<ScheduledStage>> {
        let list = self.problems.texts("stages", table.get("stages")?, "Sense");
        if list.is_empty() {
            self.problems.add(span, "a loop has at least one stage", "write stages = [\"Sense\", \"Act\"]");
            return None;
        }
        let members = self.problems.table(table, "members");
        list.into_iter().map(|name| self.stage(name, members)).collect()
    }

    fn stage(&mut self, name: Spanned<String>, members: Option<&Table>) -> Option<ScheduledStage> {
        if !is_stage_name(&name.value) {
            let error = ScheduleError::Name { name: name.value };
            self.problems.add(name.span, error.to_string(), "such as `Sense`");
            return None;
        }
        let members = match members.and_then(|members| members.get(&name.value)) {
            Some(list) => {
                let items = list.as_list().unwrap_or(std::slice::from_ref(list));
                let known = Stage::ALL.map(|stage| (stage.name(), stage));
                let stages = items.iter().map(|item| self.problems.choice(&name.value, item, &known));
                stages.map(|stage| stage.map(|stage| stage.value)).collect::<Option<_>>()?
            }
            None => Stage::parse(&name.value).into_iter().collect(),
        };
        Some(ScheduledStage { name: name.value, members, timeout: None })
    }
}

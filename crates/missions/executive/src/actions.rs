//! Actions of a mission at Execute.

use serde::{Deserialize, Serialize};
use slate_petri_net::ActionProgress;
use slate_plugin::mapek::ActionRequest;
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::activity_hash::ActivityHash;

/// Name of the action that the Plan itself performs: it waits a number of seconds.
pub const WAIT: &str = "wait";

/// Performer of an action.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Performed {
    /// Execute.
    Request(ActionRequest),
    /// Wait of the Plan, ns.
    Wait(u64),
}

/// Progress of an action at Execute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ActionRecord {
    /// True if the mission performs the action.
    is_active: bool,
    progress: ActionProgress,
    /// Number at Execute; 0 while Execute does not have it.
    ticket: u64,
    /// Start time, ns.
    since: u64,
}

/// Actions of a mission, their requests and progress.
///
/// An action cleared by a reflex or a failure is requested again as long as the mission performs it.
#[derive(Clone, Debug, Default)]
pub struct MissionActions {
    performed: Vec<Performed>,
    records: Vec<ActionRecord>,
    /// Name and arguments of each action that was given them while the mission runs.
    given: Vec<Option<(String, Vec<f64>)>>,
    newest_start: u64,
    /// True if Execute has an action that the mission has stopped.
    must_clear: bool,
}

impl MissionActions {
    /// Actions by their names and arguments.
    ///
    /// # Errors
    /// If a name is too long, or an argument is not a number.
    pub fn new<'a>(actions: impl Iterator<Item = (&'a str, Vec<&'a str>)>) -> Result<Self, String> {
        let performed: Vec<Performed> = actions
            .map(|(name, arguments)| performed(name, &numbers(name, &arguments)?))
            .collect::<Result<_, _>>()?;
        let records = vec![ActionRecord::default(); performed.len()];
        Ok(Self { given: vec![None; performed.len()], performed, records, ..Self::default() })
    }

    /// Returns a number of actions whose arguments come with their start.
    pub fn with_arguments_at_start(count: usize) -> Self {
        Self {
            performed: vec![Performed::Wait(0); count],
            records: vec![ActionRecord::default(); count],
            given: vec![None; count],
            ..Self::default()
        }
    }

    /// Changes the name and the arguments of an action that is not active.
    ///
    /// # Errors
    /// If they are too many, or not those of the action.
    pub fn set_arguments(&mut self, index: usize, name: &str, arguments: &[f64]) -> Result<(), String> {
        self.performed[index] = performed(name, arguments)?;
        let (own_name, own) = self.given[index].get_or_insert_default();
        name.clone_into(own_name);
        arguments.clone_into(own);
        Ok(())
    }

    /// Starts or continues an action.
    pub fn start(&mut self, index: usize, now: u64) {
        self.stop(index);
        self.records[index] =
            ActionRecord { is_active: true, progress: ActionProgress::Running, ticket: 0, since: now };
        self.newest_start = now;
    }

    /// Stops an action, if Execute has it.
    pub fn stop(&mut self, index: usize) {
        let record = &mut self.records[index];
        self.must_clear |= record.progress == ActionProgress::Running && record.ticket > 0;
        (record.is_active, record.ticket) = (false, 0);
    }

    /// Stops all actions.
    pub fn stop_all(&mut self) {
        (0..self.records.len()).for_each(|index| self.stop(index));
    }

    /// Returns how far an action has come.
    pub fn progress(&self, index: usize, now: u64) -> ActionProgress {
        let ActionRecord { progress, since, .. } = self.records[index];
        match self.performed[index] {
            Performed::Wait(duration)
                if progress == ActionProgress::Running && now.saturating_sub(since) >= duration =>
            {
                ActionProgress::Succeeded
            }
            _ => progress,
        }
    }

    /// Returns whether the mission performs an action that has not ended at Execute.
    pub fn runs(&self, index: usize) -> bool {
        let ActionRecord { is_active, progress, .. } = self.records[index];
        is_active && matches!(progress, ActionProgress::Running | ActionProgress::Preempted)
    }

    /// Ends a running action, as if Execute had reported it.
    /// Returns false if it does not run.
    pub fn end(&mut self, index: usize, has_succeeded: bool) -> bool {
        let runs = self.runs(index);
        if runs {
            let record = &mut self.records[index];
            self.must_clear |= record.ticket > 0;
            record.ticket = 0;
            record.progress = if has_succeeded { ActionProgress::Succeeded } else { ActionProgress::Failed };
        }
        runs
    }

    /// Returns an action with its arguments, such as `GoTo(1, 2)`.
    pub fn text(&self, index: usize) -> String {
        match self.performed[index] {
            Performed::Wait(duration) => format!("{WAIT}({})", duration as f64 / 1e9),
            Performed::Request(request) => {
                let arguments: Vec<String> = request.arguments.iter().map(f64::to_string).collect();
                format!("{}({})", request.kind.as_str(), arguments.join(", "))
            }
        }
    }

    /// Hashes how far all actions have come.
    pub fn hash_into(&self, now: u64, hash: &mut ActivityHash) {
        for (index, record) in self.records.iter().enumerate() {
            hash.number(2 * (self.progress(index, now) as u64) + u64::from(record.is_active));
        }
    }

    /// Returns the time since the newest start, s.
    pub fn elapsed(&self, now: u64) -> f64 {
        now.saturating_sub(self.newest_start) as f64 / 1e9
    }

    /// Handles the actions that ended since the previous run.
    pub fn take_endings(&mut self, situation: &Situation<'_>) {
        for ended in situation.ended().filter(|ended| ended.ticket > 0) {
            let own = self.records.iter_mut().find(|record| record.ticket == ended.ticket);
            if let Some(record) = own {
                record.ticket = 0;
                record.progress = match ended.ending {
                    Ending::COMPLETED => ActionProgress::Succeeded,
                    Ending::FAILED | Ending::REFUSED => ActionProgress::Failed,
                    _ => ActionProgress::Preempted,
                };
            }
        }
    }

    /// Requests the actions that the mission performs and Execute does not have.
    pub fn request(&mut self, situation: &Situation<'_>, plan: &mut Agenda<'_>) {
        let is_lost = situation.needs_plan();
        if self.must_clear && plan.clear().is_none() {
            // No message fits in this run; the next one has room.
            return;
        }
        for (record, performed) in self.records.iter_mut().zip(&self.performed) {
            let Performed::Request(request) = *performed else { continue };
            let is_unfinished =
                matches!(record.progress, ActionProgress::Running | ActionProgress::Preempted);
            if !record.is_active || !is_unfinished {
                continue;
            }
            if record.ticket == 0 || is_lost || self.must_clear {
                record.progress = ActionProgress::Running;
                record.ticket = plan.append(request).unwrap_or(0);
            }
        }
        self.must_clear = false;
    }

    /// Returns the running actions, without waits.
    /// Index, kind, arguments, and time of the start, ns.
    pub fn running(&self) -> impl Iterator<Item = (usize, ActionRequest, u64)> + '_ {
        let all = self.records.iter().zip(&self.performed).enumerate();
        all.filter_map(|(index, (record, performed))| match performed {
            Performed::Request(request) if record.is_active && record.progress == ActionProgress::Running => {
                Some((index, *request, record.since))
            }
            _ => None,
        })
    }

    /// Ends an action that something else than Execute performs.
    pub fn finish(&mut self, index: usize, progress: ActionProgress) {
        self.records[index].progress = progress;
    }

    /// Returns the kinds that are known before the mission runs.
    pub fn kinds(&self) -> impl Iterator<Item = &str> {
        self.performed.iter().filter_map(|performed| match performed {
            Performed::Request(request) => Some(request.kind.as_str()),
            Performed::Wait(_) => None,
        })
    }

    /// Returns the state: name and record of each action.
    pub fn save<'a>(&self, names: impl Iterator<Item = (&'a str, &'a str)>) -> SavedActions {
        let all = names.zip(self.records.iter().zip(&self.given));
        let known = all.filter(|(_, (record, _))| **record != ActionRecord::default());
        let saved = known.map(|((path, text), (record, given))| SavedMissionAction {
            path: path.into(),
            text: text.into(),
            record: *record,
            given: given.clone().filter(|_| record.is_active),
        });
        SavedActions {
            newest_start: self.newest_start,
            must_clear: self.must_clear,
            actions: saved.collect(),
        }
    }

    /// Restores a state, of the actions that have the same names.
    ///
    /// # Errors
    /// If arguments are not those of the action.
    pub fn restore<'a>(
        &mut self,
        saved: &SavedActions,
        names: impl Iterator<Item = (&'a str, &'a str)>,
    ) -> Result<(), String> {
        self.newest_start = saved.newest_start;
        self.must_clear = saved.must_clear;
        let names: Vec<(&str, &str)> = names.collect();
        for SavedMissionAction { path, text, record, given } in &saved.actions {
            if let Some(index) = names.iter().position(|name| *name == (path, text)) {
                self.records[index] = *record;
                if let Some((name, arguments)) = given {
                    self.set_arguments(index, name, arguments)?;
                }
            } else {
                self.must_clear |= record.ticket > 0;
            }
        }
        Ok(())
    }
}

/// State of [`MissionActions`] by names, for snapshots and changed missions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SavedActions {
    newest_start: u64,
    must_clear: bool,
    actions: Vec<SavedMissionAction>,
}

/// Saved action of a mission, by its names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedMissionAction {
    /// Path of the plan.
    path: String,
    /// Action, with its arguments where they are fixed.
    text: String,
    record: ActionRecord,
    /// Name and arguments that came with the start.
    given: Option<(String, Vec<f64>)>,
}

fn numbers(name: &str, arguments: &[&str]) -> Result<Vec<f64>, String> {
    let number = |argument: &&str| {
        let value = argument.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| {
            format!("expected numbers as arguments of the action `{name}`, found `{argument}`")
        })
    };
    arguments.iter().map(number).collect()
}

fn performed(name: &str, numbers: &[f64]) -> Result<Performed, String> {
    if name == WAIT {
        return match *numbers {
            // The cast clamps numbers out of range.
            [seconds] if seconds >= 0.0 => Ok(Performed::Wait((seconds * 1e9) as u64)),
            _ => Err(format!("expected a number of seconds, such as `{WAIT}_5`")),
        };
    }
    let request = ActionRequest { arguments: Sequence::new(numbers), kind: Text::new(name) };
    // A request takes what fits.
    if request.kind.as_str() != name || request.arguments.len() != numbers.len() {
        return Err(format!("expected a shorter name and fewer arguments of the action `{name}`"));
    }
    Ok(Performed::Request(request))
}

//! What the Plans of missions have in common: reading, reloading, saving, conditions, actions and verdicts.

use serde::de::DeserializeOwned;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{MissionActions, SavedActions};
use crate::conditions::{ConditionValues, KnownConditions};

/// Execution of a mission that a Plan follows.
pub trait MissionExecutor: Sized {
    /// State that a snapshot has.
    type Saved: Clone + Default + Serialize + DeserializeOwned;
    /// What a mission's file has, in messages.
    const NOUN: &'static str;
    /// Parameter of the Plan that names the file.
    const PARAMETER: &'static str;

    /// Whether the mission has succeeded or failed.
    fn is_completed(&self) -> bool;

    /// Returns the state.
    ///
    /// # Errors
    /// What can't be saved.
    fn save(&self) -> Result<Self::Saved, String>;

    /// Returns names of the actions, in their order: a path and a text.
    fn names(&self) -> Box<dyn Iterator<Item = (&str, &str)> + '_>;
}

/// Mission of a Plan.
pub struct PlanMission<E: MissionExecutor> {
    /// File and revision that were read.
    read: Option<(String, u32)>,
    /// Execution, once a file was read.
    pub executor: Option<E>,
    /// Its actions at Execute.
    pub actions: MissionActions,
    /// Conditions that are known.
    pub conditions: KnownConditions,
    /// Reason for which the mission can't go on.
    pub failure: Option<String>,
    /// State that waits for its file.
    restored: Option<SavedPlanMission<E::Saved>>,
    /// Text of the newest report; empty where the Plan has none.
    pub last_report: Option<String>,
    /// Text of the next report, kept so that a run allocates nothing.
    pub report_text: String,
}

impl<E: MissionExecutor> Default for PlanMission<E> {
    fn default() -> Self {
        Self {
            read: None,
            executor: None,
            actions: MissionActions::default(),
            conditions: KnownConditions::default(),
            failure: None,
            restored: None,
            last_report: None,
            report_text: String::new(),
        }
    }
}

/// State of a mission in snapshots.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
struct SavedPlanMission<S: Default> {
    executor: S,
    actions: SavedActions,
    conditions: KnownConditions,
    failure: Option<String>,
    last_report: Option<String>,
}

impl<E: MissionExecutor> Serialize for PlanMission<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.save().map_err(S::Error::custom)?.serialize(serializer)
    }
}

impl<'de, E: MissionExecutor> Deserialize<'de> for PlanMission<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self { restored: Some(SavedPlanMission::deserialize(deserializer)?), ..Self::default() })
    }
}

impl<E: MissionExecutor> PlanMission<E> {
    /// Reads the file, when the agent starts and when the file or its revision changes.
    ///
    /// `load` restores a state into the file's mission. A mission that goes on keeps the old file where the new one is
    /// invalid or lacks what runs. Returns whether it goes on with a changed file.
    pub fn read(
        &mut self,
        file: &str,
        revision: u32,
        now: &Tick,
        load: impl FnOnce(&E::Saved) -> Result<(E, MissionActions), String>,
    ) -> bool {
        if self.read.as_ref().is_some_and(|(known, old)| known == file && *old == revision) {
            return false;
        }
        self.read = Some((file.into(), revision));
        let is_running = self.executor.is_some();
        let loaded = match file {
            "" => Err(format!("a mission needs a file with its {}", E::NOUN)),
            _ => self.exchange(load),
        };
        match loaded {
            Ok(()) => return is_running,
            Err(reason) if is_running => {
                now.error(format_args!("{reason}; the mission goes on with the old {}", E::NOUN));
            }
            Err(reason) => {
                now.error(format_args!("{reason}; name another `{}`", E::PARAMETER));
                self.failure = Some(reason);
            }
        }
        false
    }

    /// Goes on with a changed file, or begins with it where the old mission has ended.
    fn exchange(
        &mut self,
        load: impl FnOnce(&E::Saved) -> Result<(E, MissionActions), String>,
    ) -> Result<(), String> {
        let is_running = self.executor.is_some();
        let saved = match &self.executor {
            Some(executor) if executor.is_completed() => {
                SavedPlanMission { conditions: self.conditions.clone(), ..SavedPlanMission::default() }
            }
            Some(_) => self.save()?,
            None => self.restored.clone().unwrap_or_default(),
        };
        let (executor, mut actions) = load(&saved.executor)?;
        actions.restore(&saved.actions, executor.names())?;
        self.executor = Some(executor);
        (self.actions, self.conditions) = (actions, saved.conditions);
        // A changed mission is reported; a restored one was.
        self.last_report = saved.last_report.filter(|_| !is_running);
        self.failure = saved.failure.filter(|_| !is_running);
        self.restored = None;
        Ok(())
    }

    fn save(&self) -> Result<SavedPlanMission<E::Saved>, String> {
        let Some(executor) = &self.executor else { return Ok(self.restored.clone().unwrap_or_default()) };
        let state = match (executor.save(), &self.failure) {
            (Ok(state), _) => state,
            // It does not go on.
            (Err(_), Some(_)) => E::Saved::default(),
            (Err(reason), None) => return Err(reason),
        };
        Ok(SavedPlanMission {
            executor: state,
            actions: self.actions.save(executor.names()),
            conditions: self.conditions.clone(),
            failure: self.failure.clone(),
            last_report: self.last_report.clone(),
        })
    }

    /// Takes new conditions, and the actions that have ended.
    pub fn update(
        &mut self,
        conditions: &Noticed<ConditionValues>,
        facts: &Input<ConditionValues>,
        situation: &Situation<'_>,
    ) {
        let mut updated = conditions.iter().try_for_each(|values| self.conditions.update(&values));
        if let Some(facts) = facts.get() {
            updated = updated.and(self.conditions.update(facts));
        }
        if let Err(reason) = updated
            && self.failure.is_none()
        {
            self.end(reason);
        }
        self.actions.take_endings(situation);
    }

    /// Ends the mission with an error.
    pub fn fail(&mut self, error: &str, now: &Tick) {
        now.error(format_args!("{error}"));
        self.end(error.into());
    }

    fn end(&mut self, reason: String) {
        self.failure = Some(reason);
        self.actions.stop_all();
        self.last_report = None;
    }

    /// Returns the verdict; `ended` is the reason of a success, or that of a failure.
    pub fn verdict(&self, ended: Option<Result<&str, &str>>) -> Verdict {
        let (state, outcome, reason) = match (&self.failure, ended) {
            // A verdict is short; the log has the file's folder.
            (Some(failure), _) => {
                let reason = failure.strip_prefix(self.folder()).unwrap_or(failure);
                (MissionState::FAILED, MissionOutcome::OTHER, reason)
            }
            (None, Some(Ok(reason))) => (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED, reason),
            (None, Some(Err(reason))) => (MissionState::FAILED, MissionOutcome::OTHER, reason),
            (None, None) => (MissionState::RUNNING, MissionOutcome::OTHER, ""),
        };
        Verdict { state, outcome, reason: Text::new(reason) }
    }

    /// Returns the folder of the mission's file, with its last slash.
    fn folder(&self) -> &str {
        let file = self.read.as_ref().map_or("", |(file, _)| file);
        &file[..file.rfind('/').map_or(0, |slash| slash + 1)]
    }

    /// Whether the report's text differs from the newest one; takes it in that case.
    pub fn takes_report(&mut self) -> bool {
        if self.last_report.as_ref() == Some(&self.report_text) {
            return false;
        }
        self.last_report = Some(self.report_text.clone());
        true
    }
}

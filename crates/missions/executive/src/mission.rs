//! Common part of the Plans of missions.
//! Reading, reloading, saving, conditions, actions and verdicts.

use serde::de::DeserializeOwned;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{MissionActions, SavedActions};
use crate::activity_hash::ActivityHash;
use crate::conditions::{ConditionValues, KnownConditions};
use crate::view::{
    ActivityWriter, ForcedOutcome, Forcing, MissionActivity, MissionCommand, MissionDrawing, MissionGraph,
    MissionNotation, MissionOrder, MissionRobot, MissionSight, MissionView, SavedView,
};

/// Execution of a mission that a Plan follows.
pub trait MissionExecutor: Sized {
    /// State that a snapshot has.
    type Saved: Clone + Default + Serialize + DeserializeOwned;
    /// Noun for the content of a mission's file, in messages.
    const NOUN: &'static str;
    /// Parameter of the Plan that names the file.
    const PARAMETER: &'static str;

    /// Notation of the mission.
    const NOTATION: MissionNotation;

    /// Returns whether the mission runs, has succeeded, or has failed.
    fn mission_state(&self) -> MissionState;

    /// Draws the mission; elements have the numbers that items and orders name.
    fn draw(&self) -> MissionDrawing;

    /// Hashes the activity's content beside actions and conditions.
    fn hash_into(&self, seen: &MissionSight<'_>, hash: &mut ActivityHash);

    /// Describes the current activity of the mission.
    fn describe(&self, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>);

    /// Performs the smallest step.
    ///
    /// # Errors
    /// Why the mission can't continue.
    fn step(&mut self, robot: MissionRobot<'_>) -> Result<(), String>;

    /// Forces the event of an element.
    fn force(&mut self, element: usize, outcome: ForcedOutcome, robot: MissionRobot<'_>) -> Forcing;

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
    /// Actions at Execute.
    pub actions: MissionActions,
    /// Conditions that are known.
    pub conditions: KnownConditions,
    /// Reason of the mission's failure.
    pub failure: Option<String>,
    /// State that waits for its file.
    restored: Option<SavedPlanMission<E::Saved>>,
    /// Text of the newest report; empty where the Plan has none.
    pub last_report: Option<String>,
    /// Text of the next report, a buffer without allocations in a run.
    pub report_text: String,
    view: MissionView,
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
            view: MissionView::default(),
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
    view: SavedView,
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
    /// `load` restores a state into the file's mission. A mission that continues keeps the old file where the new one is
    /// invalid or lacks what runs. Returns whether it continues with a changed file.
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
                now.error(format_args!("{reason}; the mission continues with the old {}", E::NOUN));
            }
            Err(reason) => {
                now.error(format_args!("{reason}; name another `{}`", E::PARAMETER));
                self.failure = Some(reason);
            }
        }
        false
    }

    /// Replaces the mission's file.
    /// It continues with the changed file, or begins with it where the old mission has ended.
    fn exchange(
        &mut self,
        load: impl FnOnce(&E::Saved) -> Result<(E, MissionActions), String>,
    ) -> Result<(), String> {
        let is_running = self.executor.is_some();
        let saved = match &self.executor {
            Some(executor) if executor.mission_state() != MissionState::RUNNING => SavedPlanMission {
                conditions: self.conditions.clone(),
                view: self.view.saved,
                ..SavedPlanMission::default()
            },
            Some(_) => self.save()?,
            None => self.restored.clone().unwrap_or_default(),
        };
        let (executor, mut actions) = load(&saved.executor)?;
        actions.restore(&saved.actions, executor.names())?;
        self.view.saved = saved.view;
        self.view.draw(executor.draw());
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
            // It does not continue.
            (Err(_), Some(_)) => E::Saved::default(),
            (Err(reason), None) => return Err(reason),
        };
        Ok(SavedPlanMission {
            executor: state,
            actions: self.actions.save(executor.names()),
            conditions: self.conditions.clone(),
            failure: self.failure.clone(),
            last_report: self.last_report.clone(),
            view: self.view.saved,
        })
    }

    /// Updates conditions and ended actions.
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

    /// Returns true while the mission is paused.
    /// It makes no steps until it is resumed.
    pub fn is_paused(&self) -> bool {
        self.view.saved.is_paused
    }

    /// Carries out the orders of a developer.
    pub fn obey(&mut self, orders: &Inbox<MissionOrder>, now: &Tick) {
        for order in orders.iter() {
            if let Err((code, reason)) = self.carry_out(&order, now) {
                now.warn(format_args!("{reason}"));
                order.refuse(code);
            }
        }
    }

    fn carry_out(&mut self, order: &MissionOrder, now: &Tick) -> Result<(), (u16, String)> {
        let Self { executor: Some(executor), actions, conditions, failure: None, view, .. } = self else {
            return Err((MissionOrder::NO_MISSION, "no mission runs".into()));
        };
        if executor.mission_state() != MissionState::RUNNING {
            return Err((MissionOrder::NO_MISSION, "the mission has ended".into()));
        }
        let robot = MissionRobot { actions, conditions, now };
        let forcing = match order.command {
            MissionCommand::PAUSE | MissionCommand::RESUME => {
                view.saved.is_paused = order.command == MissionCommand::PAUSE;
                Forcing::Done
            }
            MissionCommand::STEP if !view.saved.is_paused => {
                return Err((MissionOrder::NOT_PAUSED, "the mission is not paused: pause it first".into()));
            }
            MissionCommand::STEP => executor.step(robot).map_or_else(Forcing::Failed, |()| Forcing::Done),
            MissionCommand::FORCE if order.graph != view.saved.graph => {
                return Err((MissionOrder::OTHER_GRAPH, "the mission has another graph: look again".into()));
            }
            MissionCommand::FORCE => executor.force(order.element as usize, order.outcome, robot),
            _ => Forcing::Refused("expected an order: pause, resume, step or force".into()),
        };
        match forcing {
            Forcing::Done => Ok(()),
            Forcing::Refused(reason) => Err((MissionOrder::NOT_POSSIBLE, reason)),
            Forcing::Failed(error) => {
                self.fail(&error, now);
                Ok(())
            }
        }
    }

    /// Publishes the graph of a new file, and the activity on a change.
    pub fn publish(&mut self, graph: &Output<MissionGraph>, activity: &Output<MissionActivity>, now: &Tick) {
        self.view.publish_graph(E::NOTATION, graph);
        let seen = MissionSight { actions: &self.actions, conditions: &self.conditions, now: now.now() };
        let state = match (&self.failure, &self.executor) {
            (Some(_), _) => MissionState::FAILED,
            (None, Some(executor)) => executor.mission_state(),
            (None, None) => MissionState::RUNNING,
        };
        let mut hash = ActivityHash::default();
        hash.number(u64::from(state.0));
        hash.text(self.failure.as_deref().unwrap_or_default());
        self.executor.iter().for_each(|executor| executor.hash_into(&seen, &mut hash));
        seen.actions.hash_into(seen.now, &mut hash);
        seen.conditions.hash_into(&mut hash);
        if !self.view.takes(hash) {
            return;
        }
        let reason = self.reason().map(Text::new);
        self.view.publish(state, &seen, activity, |writer| {
            self.executor.iter().for_each(|executor| executor.describe(&seen, writer));
            writer.reason = reason.unwrap_or(writer.reason);
        });
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
        let (state, outcome, reason) = match (self.reason(), ended) {
            (Some(reason), _) => (MissionState::FAILED, MissionOutcome::OTHER, reason),
            (None, Some(Ok(reason))) => (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED, reason),
            (None, Some(Err(reason))) => (MissionState::FAILED, MissionOutcome::OTHER, reason),
            (None, None) => (MissionState::RUNNING, MissionOutcome::OTHER, ""),
        };
        Verdict { state, outcome, reason: Text::new(reason) }
    }

    /// Returns the reason why the mission can't continue.
    /// Its texts are short, and the log has the file's folder.
    fn reason(&self) -> Option<&str> {
        let failure = self.failure.as_deref()?;
        Some(failure.strip_prefix(self.folder()).unwrap_or(failure))
    }

    /// Returns the folder of the mission's file, with its last slash.
    fn folder(&self) -> &str {
        let file = self.read.as_ref().map_or("", |(file, _)| file);
        &file[..file.rfind('/').map_or(0, |slash| slash + 1)]
    }

    /// Returns true if the report's text differs from the newest one.
    /// It then takes the report.
    pub fn takes_report(&mut self) -> bool {
        if self.last_report.as_ref() == Some(&self.report_text) {
            return false;
        }
        self.last_report = Some(self.report_text.clone());
        true
    }
}

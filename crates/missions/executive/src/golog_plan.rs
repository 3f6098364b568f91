//! Plan whose mission is a Golog program.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_golog::{
    ActionTheory, GologExecutor, GologHost, GologOutcome, GologProgress, GologRunError, GologState,
    MOST_ACTIONS, RobotAction, SearchLimits,
};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::actions::{MissionActions, SavedActions, WAIT};
use crate::conditions::{ConditionName, ConditionValues, KnownConditions};

/// Names of the slots of actions in saved states.
const SLOTS: [&str; MOST_ACTIONS] =
    ["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12", "13", "14", "15"];

/// State of a mission that is a Golog program.
#[interface]
pub struct GologMissionStatus {
    /// Number of transitions of the program.
    pub steps: u64,
    /// Name of the mission.
    pub mission: Text<60>,
    /// Actions that run, a search that goes on, and unknown conditions: "go(desk), waits for `localized`".
    pub running: Text<252>,
}

/// Conditions and outputs of the Plan.
#[ports]
pub struct GologPlanPorts {
    /// Conditions of an Analyze.
    conditions: Noticed<ConditionValues>,
    /// Conditions of Knowledge or of a person.
    facts: Input<ConditionValues>,
    /// State of the mission, written when other actions run.
    mission: Output<GologMissionStatus>,
    /// Verdict on the mission, for the end of a run.
    verdict: Output<Verdict>,
}

/// Parameters of [`GologPlan`].
#[params]
pub struct GologPlanParams {
    #[param(default = "", doc = "file of the theory with its procedure `main`")]
    program_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission goes on")]
    revision: u32,
    #[param(default = 500, range = 1..=1_000_000, doc = "transitions of a search in a run of the Plan; it goes on with the next run")]
    search_transitions: u32,
    #[param(default = 200_000, range = 1..=10_000_000, doc = "transitions of a search after which the mission fails")]
    most_search_transitions: u32,
}

/// Arguments of an action that runs, and its name.
type SlotAction = (String, Vec<f64>);

/// Saved state of the Plan.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
struct SavedGologPlan {
    executor: GologState,
    actions: SavedActions,
    /// Robot's action of each slot.
    slots: Vec<SlotAction>,
    conditions: KnownConditions,
    failure: Option<String>,
    last_status_text: Option<String>,
}

/// State of [`GologPlan`].
#[derive(Default)]
pub struct GologPlanState {
    /// File and revision that were read.
    read: Option<(String, u32)>,
    executor: Option<GologExecutor>,
    actions: MissionActions,
    slots: Vec<SlotAction>,
    conditions: KnownConditions,
    /// Why the mission can't go on.
    failure: Option<String>,
    /// State that waits for its theory.
    restored: Option<SavedGologPlan>,
    /// Text of the status that was written, or how the mission has ended.
    last_status_text: Option<String>,
    /// Changes of the executor up to the newest report.
    reported_changes: Option<u64>,
}

impl Serialize for GologPlanState {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.save().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for GologPlanState {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self { restored: Some(SavedGologPlan::deserialize(deserializer)?), ..Self::default() })
    }
}

/// Plan that follows a Golog program.
///
/// Its actions are those of Execute, its conditions and exogenous actions come from Analyzes and Knowledge.
pub struct GologPlan;

impl Plan for GologPlan {
    const NAME: &'static str = "golog_plan";
    const DOC: &'static str = "Follows a mission that is a Golog program.";
    type Noticed = GologPlanPorts;
    type Params = GologPlanParams;
    type State = GologPlanState;

    fn run(
        state: &mut GologPlanState,
        io: &GologPlanPorts,
        situation: &Situation<'_>,
        params: &GologPlanParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.read(params, now);
        io.conditions.iter().for_each(|values| state.conditions.update(&values));
        if let Some(facts) = io.facts.get() {
            state.conditions.update(facts);
        }
        state.actions.take_endings(situation);
        if let Err(error) = state.tick(now) {
            now.error(format_args!("{error}"));
            state.failure = Some(error.to_string());
            state.actions.stop_all();
            (state.last_status_text, state.reported_changes) = (None, None);
        }
        state.actions.request(situation, plan);
        state.report(io);
    }
}

/// The robot as a program sees it.
struct GologMission<'a> {
    actions: &'a mut MissionActions,
    slots: &'a mut Vec<SlotAction>,
    now: u64,
}

impl GologHost for GologMission<'_> {
    fn start(&mut self, slot: usize, action: &RobotAction<'_>) -> Result<(), String> {
        self.actions.set_arguments(slot, action.name, &action.arguments)?;
        self.slots.resize(self.slots.len().max(slot + 1), SlotAction::default());
        self.slots[slot] = (action.name.into(), action.arguments.clone());
        self.actions.start(slot, self.now);
        Ok(())
    }

    fn progress(&mut self, slot: usize) -> GologProgress {
        match self.actions.progress(slot, self.now) {
            ActionProgress::Succeeded => GologProgress::Succeeded,
            ActionProgress::Failed => GologProgress::Failed,
            // What a reflex has cancelled is requested again.
            ActionProgress::Idle | ActionProgress::Running | ActionProgress::Preempted => {
                GologProgress::Running
            }
        }
    }

    fn stop(&mut self, slot: usize) {
        self.actions.stop(slot);
    }
}

impl GologPlanState {
    /// Reads the theory, when the agent starts and when its file or revision changes.
    ///
    /// A mission that goes on keeps its old theory where the new one is invalid or lacks the place of the program.
    fn read(&mut self, params: &GologPlanParams, now: &Tick) {
        let (file, revision) = (params.program_filename.as_str(), params.revision);
        if self.read.as_ref().is_some_and(|(known, old)| known == file && *old == revision) {
            return;
        }
        self.read = Some((file.into(), revision));
        let limits = SearchLimits {
            transitions_per_tick: params.search_transitions.into(),
            most_transitions: params.most_search_transitions.into(),
        };
        match load(file).and_then(|theory| self.exchange(theory, limits)) {
            Ok(()) => {}
            Err(reason) if self.executor.is_some() => {
                now.error(format_args!("{reason}; the mission goes on with the old program"));
            }
            Err(reason) => {
                now.error(format_args!("{reason}; name another `program_filename`"));
                self.failure = Some(reason);
            }
        }
    }

    /// Goes on with a changed theory, or begins with it where the old mission has ended.
    fn exchange(&mut self, theory: ActionTheory, limits: SearchLimits) -> Result<(), String> {
        let is_running = self.executor.is_some();
        let saved = match &self.executor {
            Some(executor) if executor.outcome() != GologOutcome::Running => {
                SavedGologPlan { conditions: self.conditions.clone(), ..SavedGologPlan::default() }
            }
            Some(_) => self.save(),
            None => self.restored.clone().unwrap_or_default(),
        };
        let restored = GologExecutor::restore(Arc::new(theory), limits, &saved.executor);
        let mut executor = restored.map_err(|error| error.to_string())?;
        // The arguments come with the start; a `wait` of no time stands for them.
        let mut actions = MissionActions::new(SLOTS.iter().map(|_| (WAIT, vec!["0"])))?;
        for (slot, (name, arguments)) in saved.slots.iter().enumerate().take(MOST_ACTIONS) {
            if !name.is_empty() {
                actions.set_arguments(slot, name, arguments)?;
            }
        }
        actions.restore(&saved.actions, names());
        if is_running {
            executor.wake();
        }
        self.executor = Some(executor);
        (self.actions, self.slots, self.conditions) = (actions, saved.slots, saved.conditions);
        // A changed program is reported; a restored one was.
        self.last_status_text = saved.last_status_text.filter(|_| !is_running);
        self.failure = saved.failure.filter(|_| !is_running);
        (self.restored, self.reported_changes) = (None, None);
        Ok(())
    }

    fn save(&self) -> SavedGologPlan {
        let Some(executor) = &self.executor else { return self.restored.clone().unwrap_or_default() };
        SavedGologPlan {
            executor: executor.state(),
            actions: self.actions.save(names()),
            slots: self.slots.clone(),
            conditions: self.conditions.clone(),
            failure: self.failure.clone(),
            last_status_text: self.last_status_text.clone(),
        }
    }

    /// Executes the program until it waits.
    fn tick(&mut self, now: &Tick) -> Result<(), GologRunError> {
        let Self { executor: Some(executor), actions, slots, conditions, failure: None, .. } = self else {
            return Ok(());
        };
        executor.observe(|name| conditions.get(name))?;
        executor.tick(&mut GologMission { actions, slots, now: now.now() }).map(|_| ())
    }

    /// Writes the outputs where something has changed.
    fn report(&mut self, io: &GologPlanPorts) {
        let changes = self.executor.as_ref().map_or(0, GologExecutor::changes);
        if self.reported_changes.replace(changes) == Some(changes) {
            return;
        }
        let (mut state, mut outcome) = (MissionState::RUNNING, MissionOutcome::OTHER);
        let (mut reason, mut running) = ("", String::new());
        if let Some(executor) = &self.executor {
            match executor.outcome() {
                GologOutcome::Succeeded => {
                    (state, outcome) = (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED);
                    reason = "the program has ended";
                }
                GologOutcome::Failed => {
                    (state, reason) = (MissionState::FAILED, "no step of the program is possible");
                }
                GologOutcome::Running => running = running_text(executor),
            }
        }
        if let Some(failure) = &self.failure {
            (state, reason) = (MissionState::FAILED, failure);
            running.clear();
        }
        let text = if reason.is_empty() { &running } else { reason };
        if self.last_status_text.as_deref() == Some(text) {
            return;
        }
        if let Some(executor) = &self.executor {
            io.mission.set(GologMissionStatus {
                steps: executor.steps(),
                mission: Text::new(executor.theory().name()),
                running: Text::new(&running),
            });
        }
        io.verdict.set(Verdict { state, outcome, reason: Text::new(reason) });
        self.last_status_text = Some(text.into());
    }
}

/// The actions that run, those that wait, a search that goes on, and unknown conditions.
fn running_text(executor: &GologExecutor) -> String {
    let mut parts: Vec<String> = executor
        .running()
        .map(|(_, text, is_suspended)| if is_suspended { format!("{text} waits") } else { text })
        .collect();
    if executor.is_searching() {
        parts.push("searches for a plan".into());
    }
    let unknown: Vec<String> = executor.unknown_conditions().map(|name| format!("`{name}`")).collect();
    if parts.is_empty() && !unknown.is_empty() {
        parts.push(format!("waits for {}", unknown.join(", ")));
    }
    parts.join(", ")
}

fn load(file: &str) -> Result<ActionTheory, String> {
    if file.is_empty() {
        return Err("a mission needs a file with its program".into());
    }
    let theory = ActionTheory::read(Path::new(file)).map_err(|error| error.to_string())?;
    // The values of a longer one are cut, and never found.
    let is_cut = |name: &&String| ConditionName::new(name).as_str() != name.as_str();
    let observed = theory.conditions().into_iter().chain(theory.exogenous_actions());
    if let Some(name) = observed.collect::<Vec<String>>().iter().find(is_cut) {
        return Err(format!("{file}: expected a shorter name of the condition `{name}`"));
    }
    for action in theory.robot_actions() {
        let zeros = vec!["0"; action.arguments];
        let checked = MissionActions::new([(action.name, zeros)].into_iter());
        checked.map_err(|reason| format!("{file}:{}: {reason}", action.line))?;
        if !action.is_plain {
            return Err(format!(
                "{file}:{}: expected what the robot performs for `{}`, as its arguments are no numbers: \
                 `performs GoTo(x(p), y(p))`",
                action.line, action.name
            ));
        }
    }
    Ok(theory)
}

/// Names of the slots.
fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    SLOTS.iter().map(|slot| ("slot", *slot))
}

//! Plan whose mission is a Petri Net Plan.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_petri_net::{
    ActionEvent, ActionProgress, ConflictOrder, ExecutorState, PetriNetExecutor, PetriPlan, PlanAction,
    PlanHost, StepError, action_arguments, action_name,
};
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::actions::{MissionActions, SavedActions};
use crate::conditions::{ConditionName, ConditionValues, KnownConditions};

/// The most steps of a net in a run of the Plan.
const MOST_STEPS: usize = 32;

/// Prefix of conditions about the time since the newest action was started: `elapsed_30`, in seconds.
const ELAPSED: &str = "elapsed_";

/// State of a mission.
#[interface]
pub struct MissionStatus {
    /// Number of transitions that have fired.
    pub fired: u64,
    /// Number of transitions that lost their tokens to another one in the same step.
    pub conflicts: u64,
    /// Name of the plan.
    pub plan: Text<60>,
    /// Places with tokens.
    pub marking: Text<252>,
}

/// Conditions and outputs of the Plan.
#[ports]
pub struct PetriNetPlanPorts {
    /// Conditions of an Analyze.
    conditions: Noticed<ConditionValues>,
    /// Conditions of Knowledge or of a person.
    facts: Input<ConditionValues>,
    /// State of the mission, written when it changes.
    mission: Output<MissionStatus>,
    /// Verdict on the mission, for the end of a run.
    verdict: Output<Verdict>,
}

/// Parameters of [`PetriNetPlan`].
#[params]
pub struct PetriNetPlanParams {
    #[param(default = "", doc = "file of the plan in PNML; its sub-plans are in the same folder")]
    plan_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission goes on")]
    revision: u32,
    #[param(default = 0, range = 0..=1_000_000, doc = "seed of the order of conflicting transitions; 0 for the order of the file")]
    conflict_seed: u32,
}

/// Saved state of the Plan.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
struct SavedNetPlan {
    executor: ExecutorState,
    actions: SavedActions,
    conditions: KnownConditions,
    fired: u64,
    conflicts: u64,
    failure: Option<String>,
    is_reported: bool,
}

/// State of [`PetriNetPlan`].
#[derive(Default)]
pub struct PetriNetPlanState {
    /// File and revision that were read.
    read: Option<(String, u32)>,
    executor: Option<PetriNetExecutor>,
    actions: MissionActions,
    conditions: KnownConditions,
    fired: u64,
    conflicts: u64,
    /// Why the mission can't go on.
    failure: Option<String>,
    /// State that waits for its plan.
    restored: Option<SavedNetPlan>,
    /// Whether the outputs were written.
    is_reported: bool,
}

impl Serialize for PetriNetPlanState {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.save().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PetriNetPlanState {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self { restored: Some(SavedNetPlan::deserialize(deserializer)?), ..Self::default() })
    }
}

/// Follows a Petri Net Plan: its actions are those of Execute, its conditions come from Analyzes and Knowledge.
pub struct PetriNetPlan;

impl Plan for PetriNetPlan {
    const NAME: &'static str = "petri_net_plan";
    const DOC: &'static str = "Follows a mission that is a Petri Net Plan.";
    type Noticed = PetriNetPlanPorts;
    type Params = PetriNetPlanParams;
    type State = PetriNetPlanState;

    fn run(
        state: &mut PetriNetPlanState,
        io: &PetriNetPlanPorts,
        situation: &Situation<'_>,
        params: &PetriNetPlanParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.read(params, now);
        io.conditions.iter().for_each(|values| state.conditions.update(&values));
        if let Some(facts) = io.facts.get() {
            state.conditions.update(facts);
        }
        state.actions.take_endings(situation);
        let before = state.fired;
        if let Err(error) = state.step(now) {
            now.error(format_args!("{error}"));
            state.failure = Some(error.to_string());
            state.actions.stop_all();
            state.is_reported = false;
        }
        state.actions.request(situation, plan);
        if state.fired != before || !state.is_reported {
            state.is_reported = true;
            state.report(io);
        }
    }
}

/// What the net sees of the robot.
struct MissionHost<'a> {
    actions: &'a mut MissionActions,
    conditions: &'a KnownConditions,
    now: u64,
}

impl PlanHost for MissionHost<'_> {
    fn condition(&mut self, _: usize, name: &str) -> Option<bool> {
        match name.strip_prefix(ELAPSED).and_then(|seconds| seconds.parse::<f64>().ok()) {
            Some(seconds) => Some(self.actions.elapsed(self.now) >= seconds),
            None => self.conditions.get(name),
        }
    }

    fn progress(&mut self, index: usize, _: &PlanAction) -> ActionProgress {
        self.actions.progress(index, self.now)
    }

    fn control(&mut self, index: usize, _: &PlanAction, event: ActionEvent) {
        if event.activates() {
            self.actions.start(index, self.now);
        } else {
            self.actions.stop(index);
        }
    }
}

impl PetriNetPlanState {
    /// Reads the plan, when the agent starts and when its file or revision changes.
    ///
    /// A mission that goes on keeps its old plan where the new one is invalid or lacks a place that has a token.
    fn read(&mut self, params: &PetriNetPlanParams, now: &Tick) {
        let (file, revision) = (params.plan_filename.as_str(), params.revision);
        if self.read.as_ref().is_some_and(|(known, old)| known == file && *old == revision) {
            return;
        }
        self.read = Some((file.into(), revision));
        let loaded =
            load(file).and_then(|(plan, actions)| self.exchange(plan, actions, params.conflict_seed));
        match loaded {
            Ok(()) => {}
            Err(reason) if self.executor.is_some() => {
                now.error(format_args!("{reason}; the mission goes on with the old plan"));
            }
            Err(reason) => {
                now.error(format_args!("{reason}; name another `plan_filename`"));
                self.failure = Some(reason);
            }
        }
    }

    /// Goes on with a changed plan, or begins with it where the old one has ended.
    fn exchange(
        &mut self,
        plan: Arc<PetriPlan>,
        mut actions: MissionActions,
        seed: u32,
    ) -> Result<(), String> {
        let order = match seed {
            0 => ConflictOrder::File,
            seed => ConflictOrder::Seed(seed.into()),
        };
        let is_running = self.executor.is_some();
        let saved = match &self.executor {
            Some(executor) if executor.progress() != ActionProgress::Running => {
                SavedNetPlan { conditions: self.conditions.clone(), ..SavedNetPlan::default() }
            }
            Some(_) => self.save(),
            None => self.restored.clone().unwrap_or_default(),
        };
        let restored = PetriNetExecutor::restore(Arc::clone(&plan), order, &saved.executor);
        let executor = restored.map_err(|error| error.to_string())?;
        actions.restore(&saved.actions, names(&plan));
        self.executor = Some(executor);
        self.actions = actions;
        self.conditions = saved.conditions;
        (self.fired, self.conflicts) = (saved.fired, saved.conflicts);
        // A changed plan is reported; a restored one was.
        self.is_reported = saved.is_reported && !is_running;
        self.failure = saved.failure.filter(|_| !is_running);
        self.restored = None;
        Ok(())
    }

    fn save(&self) -> SavedNetPlan {
        let Some(executor) = &self.executor else { return self.restored.clone().unwrap_or_default() };
        SavedNetPlan {
            executor: executor.state(),
            actions: self.actions.save(names(executor.plan())),
            conditions: self.conditions.clone(),
            fired: self.fired,
            conflicts: self.conflicts,
            failure: self.failure.clone(),
            is_reported: self.is_reported,
        }
    }

    /// Steps the net until nothing more happens in this run.
    fn step(&mut self, now: &Tick) -> Result<(), StepError> {
        let Self { executor: Some(executor), actions, conditions, .. } = self else { return Ok(()) };
        if self.failure.is_some() {
            return Ok(());
        }
        let mut host = MissionHost { actions, conditions, now: now.now() };
        for _ in 0..MOST_STEPS {
            executor.step(&mut host)?;
            self.fired += executor.fired().len() as u64;
            self.conflicts += executor.conflicts().len() as u64;
            if let Some(lost) = executor.conflicts().first() {
                now.warn(format_args!("conflict: another transition fired before {}", executor.title(*lost)));
            }
            if executor.fired().is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn report(&self, io: &PetriNetPlanPorts) {
        let (mut state, mut outcome) = (MissionState::RUNNING, MissionOutcome::OTHER);
        let mut reason = "";
        if let Some(executor) = &self.executor {
            match executor.progress() {
                ActionProgress::Succeeded => {
                    (state, outcome) = (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED);
                    reason = "the plan has reached its goal";
                }
                ActionProgress::Failed => (state, reason) = (MissionState::FAILED, "the plan has failed"),
                _ => {}
            }
            let net = executor.plan().net();
            io.mission.set(MissionStatus {
                fired: self.fired,
                conflicts: self.conflicts,
                plan: Text::new(net.name()),
                marking: Text::new(&net.marking_text(executor.marking(0))),
            });
        }
        if let Some(failure) = &self.failure {
            (state, reason) = (MissionState::FAILED, failure);
        }
        io.verdict.set(Verdict { state, outcome, reason: Text::new(reason) });
    }
}

fn load(file: &str) -> Result<(Arc<PetriPlan>, MissionActions), String> {
    if file.is_empty() {
        return Err("a mission needs a file with its plan".into());
    }
    let plan = PetriPlan::read(Path::new(file)).map_err(|error| error.to_string())?;
    // The values of a longer one are cut, and never found.
    let is_cut =
        |name: &&String| !name.starts_with(ELAPSED) && ConditionName::new(name).as_str() != name.as_str();
    if let Some(name) = plan.conditions().iter().find(is_cut) {
        return Err(format!("{file}: expected a shorter name of the condition `{name}`"));
    }
    let texts = plan.actions().iter().map(PlanAction::text);
    let actions = texts.map(|text| (action_name(text), action_arguments(text).collect()));
    let actions = MissionActions::new(actions).map_err(|reason| format!("{file}: {reason}"))?;
    Ok((Arc::new(plan), actions))
}

/// Names of actions: the plan that they belong to, and their text.
fn names(plan: &PetriPlan) -> impl Iterator<Item = (&str, &str)> {
    plan.actions().iter().map(|action| (action.path(), action.text()))
}

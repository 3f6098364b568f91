//! Plan whose mission is a Golog program.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_golog::{
    ActionTheory, GologExecutor, GologHost, GologOutcome, GologProgress, GologRunError, GologState,
    MOST_ACTIONS, RobotAction, SearchLimits,
};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::activity_hash::ActivityHash;
use crate::conditions::{ConditionName, ConditionValues};
use crate::mission::{MissionExecutor, PlanMission};
use crate::view::{
    ActivityWriter, ForcedOutcome, Forcing, MissionActivity, MissionDrawing, MissionGraph, MissionNotation,
    MissionOrder, MissionRobot, MissionSight, golog,
};

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
    /// Running actions, a continued search, and unknown conditions.
    /// For example "go(desk), waits for `localized`".
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
    /// Orders of a developer.
    #[role("developer")]
    orders: Inbox<MissionOrder>,
    /// Drawing of the mission, written when its file is read.
    #[capacity(640)]
    graph: Output<MissionGraph>,
    /// Current activity of the mission, written when it changes.
    #[capacity(512)]
    activity: Output<MissionActivity>,
}

/// Parameters of [`GologPlan`].
#[params]
pub struct GologPlanParams {
    #[param(default = "", doc = "file of the theory with its procedure `main`")]
    program_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission runs")]
    revision: u32,
    #[param(default = 500, range = 1..=1_000_000, doc = "transitions of a search in a run of the Plan; it continues in the next run")]
    search_transitions: u32,
    #[param(default = 200_000, range = 1..=10_000_000, doc = "transitions of a search after which the mission fails")]
    most_search_transitions: u32,
}

/// State of [`GologPlan`].
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
pub struct GologPlanState {
    mission: PlanMission<GologExecutor>,
    /// Changes of the executor up to the newest report.
    #[serde(skip)]
    reported_changes: Option<u64>,
}

impl MissionExecutor for GologExecutor {
    type Saved = GologState;
    const NOUN: &'static str = "program";
    const PARAMETER: &'static str = "program_filename";
    const NOTATION: MissionNotation = MissionNotation::GOLOG_PROGRAM;

    fn mission_state(&self) -> MissionState {
        match self.outcome() {
            GologOutcome::Running => MissionState::RUNNING,
            GologOutcome::Succeeded => MissionState::SUCCEEDED,
            GologOutcome::Failed => MissionState::FAILED,
        }
    }

    fn draw(&self) -> MissionDrawing {
        golog::draw(self.theory())
    }

    fn hash_into(&self, _: &MissionSight<'_>, hash: &mut ActivityHash) {
        golog::hash(self, hash);
    }

    fn describe(&self, _: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
        golog::describe(self, activity);
        activity.reason = Text::new(&running_text(self));
    }

    fn step(&mut self, robot: MissionRobot<'_>) -> Result<(), String> {
        let MissionRobot { actions, now, .. } = robot;
        let stepped = self.step_once(&mut GologMission { actions, now: now.now() });
        stepped.map(|_| ()).map_err(|error| error.to_string())
    }

    fn force(&mut self, element: usize, outcome: ForcedOutcome, mut robot: MissionRobot<'_>) -> Forcing {
        if element < MOST_ACTIONS {
            return robot.end(element, outcome, SLOTS[element]);
        }
        let events = self.theory().exogenous_actions();
        let Some(event) = events.get(element - MOST_ACTIONS) else {
            let reason = "only an action that runs and an exogenous action can be forced: the program chooses the \
                          others, which are in the situation that follows";
            return Forcing::Refused(reason.into());
        };
        match self.occur(event) {
            Ok(true) => Forcing::Done,
            Ok(false) => Forcing::Refused(format!("the exogenous action `{event}` is not possible now")),
            Err(error) => Forcing::Failed(error.to_string()),
        }
    }

    fn save(&self) -> Result<GologState, String> {
        Ok(self.state())
    }

    fn names(&self) -> Box<dyn Iterator<Item = (&str, &str)> + '_> {
        Box::new(SLOTS.iter().map(|slot| ("slot", *slot)))
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
        let mission = &mut state.mission;
        let file = params.program_filename.as_str();
        if mission.read(file, params.revision, now, |saved| load_program(params, saved)) {
            state.reported_changes = None;
            mission.executor.iter_mut().for_each(GologExecutor::wake);
        }
        let has_failed = mission.failure.is_some();
        mission.update(&io.conditions, &io.facts, situation);
        mission.obey(&io.orders, now);
        if let Err(error) = run_program(mission, now) {
            mission.fail(&error.to_string(), now);
        }
        if mission.failure.is_some() && !has_failed {
            state.reported_changes = None;
        }
        mission.actions.request(situation, plan);
        state.report(io);
        state.mission.publish(&io.graph, &io.activity, now);
    }
}

/// View of the robot for a program.
struct GologMission<'a> {
    actions: &'a mut MissionActions,
    now: u64,
}

impl GologHost for GologMission<'_> {
    fn start(&mut self, slot: usize, action: &RobotAction<'_>) -> Result<(), String> {
        self.actions.set_arguments(slot, action.name, &action.arguments)?;
        self.actions.start(slot, self.now);
        Ok(())
    }

    fn progress(&mut self, slot: usize) -> GologProgress {
        match self.actions.progress(slot, self.now) {
            ActionProgress::Succeeded => GologProgress::Succeeded,
            ActionProgress::Failed => GologProgress::Failed,
            // Actions cancelled by a reflex are requested again.
            ActionProgress::Idle | ActionProgress::Running | ActionProgress::Preempted => {
                GologProgress::Running
            }
        }
    }

    fn stop(&mut self, slot: usize) {
        self.actions.stop(slot);
    }
}

/// Executes the program until it waits.
pub(crate) fn run_program(mission: &mut PlanMission<GologExecutor>, now: &Tick) -> Result<(), GologRunError> {
    let is_paused = mission.is_paused();
    let PlanMission { executor: Some(executor), actions, conditions, failure: None, .. } = mission else {
        return Ok(());
    };
    // Events in a pause are not lost.
    executor.observe(|name| conditions.get(name))?;
    if is_paused {
        return Ok(());
    }
    executor.tick(&mut GologMission { actions, now: now.now() }).map(|_| ())
}

impl GologPlanState {
    /// Writes the outputs where something has changed.
    fn report(&mut self, io: &GologPlanPorts) {
        let executor = self.mission.executor.as_ref();
        let changes = executor.map_or(0, GologExecutor::changes);
        if self.reported_changes.replace(changes) == Some(changes) {
            return;
        }
        let verdict = self.mission.verdict(match executor.map(GologExecutor::outcome) {
            Some(GologOutcome::Succeeded) => Some(Ok("the program has ended")),
            Some(GologOutcome::Failed) => Some(Err("no step of the program is possible")),
            _ => None,
        });
        let is_running = verdict.state == MissionState::RUNNING;
        let running = executor.filter(|_| is_running).map(running_text).unwrap_or_default();
        self.mission.report_text = if is_running { running.clone() } else { verdict.reason.as_str().into() };
        if !self.mission.takes_report() {
            return;
        }
        if let Some(executor) = &self.mission.executor {
            io.mission.set(GologMissionStatus {
                steps: executor.steps(),
                mission: Text::new(executor.theory().name()),
                running: Text::new(&running),
            });
        }
        io.verdict.set(verdict);
    }
}

/// Returns the text of running and waiting actions.
/// With a continued search, and unknown conditions.
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

/// Loads the theory, and restores a state into it.
pub(crate) fn load_program(
    params: &GologPlanParams,
    saved: &GologState,
) -> Result<(GologExecutor, MissionActions), String> {
    let limits = SearchLimits {
        transitions_per_tick: params.search_transitions.into(),
        most_transitions: params.most_search_transitions.into(),
    };
    let theory = Arc::new(read(params.program_filename.as_str())?);
    let executor = GologExecutor::restore(theory, limits, saved).map_err(|error| error.to_string())?;
    Ok((executor, MissionActions::with_arguments_at_start(MOST_ACTIONS)))
}

fn read(file: &str) -> Result<ActionTheory, String> {
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
                "{file}:{}: expected what the robot performs for `{}`, as its arguments are not numbers: \
                 `performs GoTo(x(p), y(p))`",
                action.line, action.name
            ));
        }
    }
    Ok(theory)
}

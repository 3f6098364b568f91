//! Plan whose mission is a skill or an agent in Lua.

use std::path::Path;

use slate_behavior::{
    BehaviorAction, BehaviorEngine, BehaviorHost, BehaviorLimits, BehaviorProgress, BehaviorState,
    BehaviorStatus, ScriptLevel, SkillFiles,
};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::module::{Level, Random};
use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::activity_hash::ActivityHash;
use crate::conditions::{ConditionValues, KnownConditions};
use crate::mission::{MissionExecutor, PlanMission};
use crate::view::skills::{self, SkillElement};
use crate::view::{
    ActivityWriter, ForcedOutcome, Forcing, MissionActivity, MissionDrawing, MissionGraph, MissionNotation,
    MissionOrder, MissionRobot, MissionSight,
};

/// State of a mission in Lua.
#[interface]
pub struct SkillMissionStatus {
    /// Machines and their states that run: "patrol/VISIT, visit/GO".
    pub active: Text<252>,
}

/// Conditions and outputs of the Plan.
#[ports]
pub struct BehaviorPlanPorts {
    /// Conditions of an Analyze.
    conditions: Noticed<ConditionValues>,
    /// Conditions of Knowledge or of a person.
    facts: Input<ConditionValues>,
    /// State of the mission, written when other states run.
    mission: Output<SkillMissionStatus>,
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

/// Parameters of [`BehaviorPlan`].
#[params]
pub struct BehaviorPlanParams {
    #[param(default = "", doc = "file of a skill, an agent, or one that loads skills, in Lua")]
    skill_filename: Text<252>,
    #[param(
        default = "",
        doc = "call of a skill, such as `moveto{x = 1, y = 2}`; empty for the skill of the file"
    )]
    skill: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the files again while the mission runs")]
    revision: u32,
    #[param(default = 1_000_000, range = 1_000..=400_000_000, doc = "tokens of Lua that a run executes at most")]
    operation_limit: u32,
    #[param(default = 64, range = 1..=4096, unit = "MiB", doc = "memory of the scripts")]
    memory_limit: u32,
}

/// State of [`BehaviorPlan`].
pub type BehaviorPlanState = PlanMission<BehaviorEngine>;

impl MissionExecutor for BehaviorEngine {
    type Saved = BehaviorState;
    const NOUN: &'static str = "skills";
    const PARAMETER: &'static str = "skill_filename";
    const NOTATION: MissionNotation = MissionNotation::STATE_MACHINES;

    fn mission_state(&self) -> MissionState {
        match self.status() {
            BehaviorStatus::Running => MissionState::RUNNING,
            BehaviorStatus::Succeeded => MissionState::SUCCEEDED,
            BehaviorStatus::Failed => MissionState::FAILED,
        }
    }

    fn draw(&self) -> MissionDrawing {
        skills::draw(self)
    }

    fn hash_into(&self, _: &MissionSight<'_>, hash: &mut ActivityHash) {
        skills::hash(self, hash);
    }

    fn describe(&self, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
        skills::describe(self, seen, activity);
        let reason = match self.status() {
            BehaviorStatus::Failed => self.reason(),
            _ => String::new(),
        };
        activity.reason = Text::new(&reason);
    }

    fn step(&mut self, robot: MissionRobot<'_>) -> Result<(), String> {
        let MissionRobot { actions, conditions, now } = robot;
        let ticked = self.tick(now.now(), &mut SkillMission { actions, conditions, now });
        ticked.map(|_| ()).map_err(|error| error.to_string())
    }

    fn force(&mut self, element: usize, outcome: ForcedOutcome, mut robot: MissionRobot<'_>) -> Forcing {
        match skills::element(self, element) {
            SkillElement::Action(action) => robot.end(action, outcome, &self.actions()[action].kind),
            SkillElement::State(machine, state) => {
                let MissionRobot { actions, conditions, now } = robot;
                let mut host = SkillMission { actions, conditions, now };
                match self.jump(machine, state, now.now(), &mut host) {
                    Ok(true) => Forcing::Done,
                    Ok(false) => Forcing::Refused(format!(
                        "the machine `{}` does not run; force a state of a machine that does",
                        self.machines()[machine].name
                    )),
                    Err(error) => Forcing::Failed(error.to_string()),
                }
            }
            SkillElement::Other => Forcing::Refused(
                "a transition can't be forced, as its condition is a function: force the state to which it leads"
                    .into(),
            ),
        }
    }

    fn save(&self) -> Result<BehaviorState, String> {
        self.state().map_err(|error| error.to_string())
    }

    fn names(&self) -> Box<dyn Iterator<Item = (&str, &str)> + '_> {
        Box::new(self.actions().iter().map(|action| (action.owner.as_str(), action.name.as_str())))
    }
}

/// Plan that runs skills in Lua.
///
/// Its actions are those of Execute, its conditions come from Analyzes and Knowledge.
pub struct BehaviorPlan;

impl Plan for BehaviorPlan {
    const NAME: &'static str = "behavior_plan";
    const DOC: &'static str = "Runs skills and agents in Lua.";
    type Noticed = BehaviorPlanPorts;
    type Params = BehaviorPlanParams;
    type State = BehaviorPlanState;

    fn run(
        state: &mut BehaviorPlanState,
        io: &BehaviorPlanPorts,
        situation: &Situation<'_>,
        params: &BehaviorPlanParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let file = params.skill_filename.as_str();
        state.read(file, params.revision, now, |saved| load_skills(params, saved));
        state.update(&io.conditions, &io.facts, situation);
        let changes = |state: &BehaviorPlanState| state.executor.as_ref().map(BehaviorEngine::changes);
        let before = changes(state);
        state.obey(&io.orders, now);
        if let Err(error) = run_skills(state, now) {
            state.fail(&error, now);
        }
        state.actions.request(situation, plan);
        let is_changed = state.failure.is_none() && changes(state) != before;
        report(state, io, is_changed);
        state.publish(&io.graph, &io.activity, now);
    }
}

/// View of the robot for skills.
struct SkillMission<'a> {
    actions: &'a mut MissionActions,
    conditions: &'a KnownConditions,
    now: &'a Tick,
}

impl BehaviorHost for SkillMission<'_> {
    fn condition(&mut self, name: &str) -> Option<bool> {
        self.conditions.get(name)
    }

    fn start(&mut self, index: usize, action: &BehaviorAction, arguments: &[f64]) -> Result<(), String> {
        self.actions.set_arguments(index, &action.kind, arguments)?;
        self.actions.start(index, self.now.now());
        Ok(())
    }

    fn progress(&mut self, index: usize) -> BehaviorProgress {
        match self.actions.progress(index, self.now.now()) {
            ActionProgress::Succeeded => BehaviorProgress::Succeeded,
            ActionProgress::Failed => BehaviorProgress::Failed,
            // Actions cancelled by a reflex are requested again.
            ActionProgress::Preempted => BehaviorProgress::Preempted,
            ActionProgress::Idle | ActionProgress::Running => BehaviorProgress::Running,
        }
    }

    fn stop(&mut self, index: usize) {
        self.actions.stop(index);
    }

    fn random(&mut self) -> u64 {
        self.now.random(Random::bits)
    }

    fn log(&mut self, level: ScriptLevel, text: &str) {
        let level = match level {
            ScriptLevel::Debug => Level::Debug,
            ScriptLevel::Information => Level::Info,
            ScriptLevel::Warning => Level::Warn,
            ScriptLevel::Error => Level::Error,
        };
        self.now.log(level, format_args!("{text}"));
    }
}

pub(crate) fn run_skills(mission: &mut BehaviorPlanState, now: &Tick) -> Result<(), String> {
    if mission.is_paused() {
        return Ok(());
    }
    let PlanMission { executor: Some(engine), actions, conditions, failure: None, .. } = mission else {
        return Ok(());
    };
    let mut host = SkillMission { actions, conditions, now };
    engine.tick(now.now(), &mut host).map_err(|error| error.to_string())?;
    Ok(())
}

/// Writes the outputs where something has changed.
fn report(mission: &mut BehaviorPlanState, io: &BehaviorPlanPorts, is_changed: bool) {
    let engine = mission.executor.as_ref();
    if mission.last_report.is_some() && !is_changed {
        return;
    }
    let status = engine.map(BehaviorEngine::status);
    let reason = engine.map(BehaviorEngine::reason).unwrap_or_default();
    mission.report_text = engine.map(BehaviorEngine::active).unwrap_or_default();
    let verdict = mission.verdict(match status {
        Some(BehaviorStatus::Succeeded) => Some(Ok("the skill has succeeded")),
        Some(BehaviorStatus::Failed) => Some(Err(&reason)),
        _ => None,
    });
    if verdict.state != MissionState::RUNNING {
        mission.report_text.clear();
    }
    if mission.executor.is_some() {
        io.mission.set(SkillMissionStatus { active: Text::new(&mission.report_text) });
    }
    io.verdict.set(verdict);
    mission.last_report = Some(String::new());
}

/// Loads the skills, and restores a state into them.
pub(crate) fn load_skills(
    params: &BehaviorPlanParams,
    saved: &BehaviorState,
) -> Result<(BehaviorEngine, MissionActions), String> {
    let limits =
        BehaviorLimits { operations: params.operation_limit, memory: (params.memory_limit as usize) << 20 };
    let load = || {
        let files = SkillFiles::open(Path::new(params.skill_filename.as_str()))?;
        BehaviorEngine::restore(&files, params.skill.as_str(), limits, saved)
    };
    let engine = load().map_err(|error| error.to_string())?;
    let actions = MissionActions::with_arguments_at_start(engine.actions().len());
    Ok((engine, actions))
}

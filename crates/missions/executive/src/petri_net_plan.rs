//! Plan whose mission is a Petri Net Plan.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_petri_net::{
    ActionEvent, ActionProgress, ConflictOrder, ExecutorState, ForceError, PetriNetExecutor, PetriPlan,
    PlanAction, PlanHost, PlanTransition, StepError, action_arguments, action_name, read_pnml,
};
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::FactTable;
use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::activity_hash::ActivityHash;
use crate::conditions::{ConditionName, ConditionValues, KnownConditions};
use crate::mission::{MissionExecutor, PlanMission};
use crate::team::{MissionStatement, SavedTeamPart, TeamPart, part_of};
use crate::view::net::{self, ELAPSED, NetElement};
use crate::view::{
    ActivityWriter, ForcedOutcome, Forcing, MissionActivity, MissionDrawing, MissionGraph, MissionNotation,
    MissionOrder, MissionRobot, MissionSight,
};

/// Maximum number of steps of a net in a run of the Plan.
const MOST_STEPS: usize = 32;

/// Prefix of conditions about other robots of the plan: `absent_r2`.
const ABSENT: &str = "absent_";

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
    /// Statements of the other robots of the plan, from Knowledge.
    partners: Input<FactTable<MissionStatement>>,
    /// Statement of this robot about its part of a joint plan.
    #[capacity(1)]
    claims: Output<FactTable<MissionStatement>>,
    /// State of the mission, written when it changes.
    mission: Output<MissionStatus>,
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

/// Parameters of [`PetriNetPlan`].
#[params]
pub struct PetriNetPlanParams {
    #[param(default = "", doc = "file of the plan in PNML; its sub-plans are in the same folder")]
    plan_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission runs")]
    revision: u32,
    #[param(default = 0, range = 0..=1_000_000, doc = "seed of the order of conflicting transitions; 0 for the order of the file")]
    conflict_seed: u32,
    #[param(
        default = "",
        doc = "name of the robot in a plan of several robots, such as `r1` of `goto_6_2@r1.exec`"
    )]
    robot: Text<28>,
    #[param(default = 3.0, range = 0.5..=3600.0, unit = "s", doc = "time without a message of another robot of the plan after which it is absent")]
    partner_timeout: f64,
}

/// State of [`PetriNetPlan`].
pub type PetriNetPlanState = PlanMission<PetriNetRun>;

/// Execution of a net, and its events.
pub struct PetriNetRun {
    executor: PetriNetExecutor,
    /// Part in a plan of several robots.
    team: Option<TeamPart>,
    fired: u64,
    conflicts: u64,
}

/// State of a [`PetriNetRun`].
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedPetriNetRun {
    executor: ExecutorState,
    team: SavedTeamPart,
    fired: u64,
    conflicts: u64,
}

impl PetriNetRun {
    /// Returns how far the plan has come.
    pub fn progress(&self) -> ActionProgress {
        self.executor.progress()
    }
}

impl MissionExecutor for PetriNetRun {
    type Saved = SavedPetriNetRun;
    const NOUN: &'static str = "plan";
    const PARAMETER: &'static str = "plan_filename";
    const NOTATION: MissionNotation = MissionNotation::PETRI_NET;

    fn mission_state(&self) -> MissionState {
        match self.executor.progress() {
            ActionProgress::Succeeded => MissionState::SUCCEEDED,
            ActionProgress::Failed => MissionState::FAILED,
            _ => MissionState::RUNNING,
        }
    }

    fn draw(&self) -> MissionDrawing {
        net::draw(&self.executor)
    }

    fn hash_into(&self, seen: &MissionSight<'_>, hash: &mut ActivityHash) {
        net::hash(&self.executor, seen, hash);
    }

    fn describe(&self, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
        net::describe(&self.executor, seen, activity);
    }

    fn step(&mut self, robot: MissionRobot<'_>) -> Result<(), String> {
        self.advance(robot.actions, robot.conditions, robot.now).map_err(|error| error.to_string())
    }

    fn force(&mut self, element: usize, outcome: ForcedOutcome, mut robot: MissionRobot<'_>) -> Forcing {
        match net::element(&self.executor, element) {
            NetElement::Transition(transition) => {
                if !self.team.as_ref().is_none_or(|team| team.may_force(transition)) {
                    let reason = "the robots of the plan agree on it, or on another one at present";
                    return Forcing::Refused(reason.into());
                }
                let MissionRobot { actions, conditions, now } = robot;
                let mut host = MissionHost { actions, conditions, team: self.team.as_mut(), now: now.now() };
                match self.executor.force(transition, &mut host) {
                    Ok(()) => {
                        self.fired += 1;
                        Forcing::Done
                    }
                    Err(ForceError::Step(error)) => Forcing::Failed(error.to_string()),
                    Err(error) => Forcing::Refused(error.to_string()),
                }
            }
            NetElement::Place(instance, place) => {
                let place = &self.executor.net(instance).places()[place];
                let action = place.action.and_then(|action| self.executor.host_action(instance, action));
                match action {
                    Some(action) => robot.end(action, outcome, place.title()),
                    None => Forcing::Refused(format!(
                        "place `{}` performs no action of the robot; force a transition",
                        place.title()
                    )),
                }
            }
            NetElement::Other => Forcing::Refused("expected a transition or a place with an action".into()),
        }
    }

    fn save(&self) -> Result<SavedPetriNetRun, String> {
        let team = self.team.as_ref().map(TeamPart::save).unwrap_or_default();
        let executor = self.executor.state();
        Ok(SavedPetriNetRun { executor, team, fired: self.fired, conflicts: self.conflicts })
    }

    fn names(&self) -> Box<dyn Iterator<Item = (&str, &str)> + '_> {
        Box::new(self.executor.plan().actions().iter().map(|action| (action.path(), action.text())))
    }
}

/// Plan that executes a Petri Net Plan.
/// Its actions are those of Execute, its conditions come from Analyzes and Knowledge.
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
        let file = params.plan_filename.as_str();
        state.read(file, params.revision, now, |saved| load_net(params, saved, now.now()));
        state.update(&io.conditions, &io.facts, situation);
        let fired = |state: &PetriNetPlanState| state.executor.as_ref().map(|run| run.fired);
        let before = fired(state);
        state.obey(&io.orders, now);
        if let Err(error) = run_net(state, io.partners.get(), params.partner_timeout, now) {
            state.fail(&error, now);
        }
        state.actions.request(situation, plan);
        state_part(state, io, now);
        if fired(state) != before || state.last_report.is_none() {
            state.last_report = Some(String::new());
            report(state, io);
        }
        state.publish(&io.graph, &io.activity, now);
    }
}

/// View of the robot for the net.
struct MissionHost<'a> {
    actions: &'a mut MissionActions,
    conditions: &'a KnownConditions,
    team: Option<&'a mut TeamPart>,
    now: u64,
}

impl PlanHost for MissionHost<'_> {
    fn condition(&mut self, _: usize, name: &str) -> Option<bool> {
        let absent = name.strip_prefix(ABSENT).zip(self.team.as_ref());
        if let Some(is_absent) = absent.and_then(|(robot, team)| team.synchronizer.is_absent(robot)) {
            return Some(is_absent);
        }
        let seen = MissionSight { actions: self.actions, conditions: self.conditions, now: self.now };
        net::condition(&seen, name)
    }

    fn permits(&mut self, transition: PlanTransition, holds: bool) -> bool {
        match &mut self.team {
            // Sub-plans are those of one robot.
            Some(team) if transition.instance == 0 => team.synchronizer.permits(transition.transition, holds),
            _ => holds,
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

impl PetriNetRun {
    /// Performs a step of the net.
    fn advance(
        &mut self,
        actions: &mut MissionActions,
        conditions: &KnownConditions,
        now: &Tick,
    ) -> Result<(), StepError> {
        let Self { executor, team, .. } = self;
        team.iter_mut().for_each(|team| team.synchronizer.begin_step());
        executor.step(&mut MissionHost { actions, conditions, team: team.as_mut(), now: now.now() })?;
        self.fired += executor.fired().len() as u64;
        self.conflicts += executor.conflicts().len() as u64;
        if let Some(lost) = executor.conflicts().first() {
            now.warn(format_args!("conflict: another transition fired before {}", executor.title(*lost)));
        }
        for fired in executor.fired().iter().filter(|fired| fired.instance == 0) {
            team.iter_mut().for_each(|team| team.synchronizer.fired(fired.transition));
        }
        Ok(())
    }
}

/// Steps the net until no further transition fires in this run.
pub(crate) fn run_net(
    mission: &mut PetriNetPlanState,
    partners: Option<&FactTable<MissionStatement>>,
    timeout: f64,
    now: &Tick,
) -> Result<(), String> {
    let is_paused = mission.is_paused();
    let PlanMission { executor: Some(run), actions, conditions, failure: None, .. } = mission else {
        return Ok(());
    };
    if let Some(team) = &mut run.team {
        team.begin(partners, timeout, now)?;
    }
    for _ in 0..if is_paused { 0 } else { MOST_STEPS } {
        run.advance(actions, conditions, now).map_err(|error| error.to_string())?;
        if run.executor.fired().is_empty() {
            break;
        }
    }
    Ok(())
}

/// Ends a run of a robot in a team: states its part for the others.
fn state_part(mission: &mut PetriNetPlanState, io: &PetriNetPlanPorts, now: &Tick) {
    let has_failed = mission.failure.is_some();
    if let Some(PetriNetRun { executor, team: Some(team), .. }) = &mut mission.executor {
        let has_ended = has_failed || executor.progress() != ActionProgress::Running;
        team.synchronizer.end(executor.plan().net(), executor.marking(0), has_ended);
        team.write(&io.claims, now.now());
    }
}

fn report(mission: &PetriNetPlanState, io: &PetriNetPlanPorts) {
    let mut ended = None;
    if let Some(PetriNetRun { executor, fired, conflicts, .. }) = &mission.executor {
        ended = match executor.progress() {
            ActionProgress::Succeeded => Some(Ok("the plan has reached its goal")),
            ActionProgress::Failed => Some(Err("the plan has failed")),
            _ => None,
        };
        let net = executor.plan().net();
        io.mission.set(MissionStatus {
            fired: *fired,
            conflicts: *conflicts,
            plan: Text::new(net.name()),
            marking: Text::new(&net.marking_text(executor.marking(0))),
        });
    }
    io.verdict.set(mission.verdict(ended));
}

/// Reads a plan, and restores a state into it.
pub(crate) fn load_net(
    params: &PetriNetPlanParams,
    saved: &SavedPetriNetRun,
    now: u64,
) -> Result<(PetriNetRun, MissionActions), String> {
    let (file, robot) = (params.plan_filename.as_str(), params.robot.as_str());
    let of_file = |reason: String| format!("{file}: {reason}");
    let order = match params.conflict_seed {
        0 => ConflictOrder::File,
        seed => ConflictOrder::Seed(seed.into()),
    };
    let net = read_pnml(Path::new(file)).map_err(|error| error.to_string())?;
    let (net, part) = part_of(net, robot).map_err(of_file)?;
    let plan = PetriPlan::with_folder(net, Path::new(file)).map_err(|error| error.to_string())?;
    // The values of a longer one are cut, and never found.
    let is_cut =
        |name: &&String| !name.starts_with(ELAPSED) && ConditionName::new(name).as_str() != name.as_str();
    if let Some(name) = plan.conditions().iter().find(is_cut) {
        return Err(of_file(format!("expected a shorter name of the condition `{name}`")));
    }
    let team = part.map(|part| TeamPart::new(&part, robot, now, &saved.team));
    let team = team.transpose().map_err(of_file)?;
    let texts = plan.actions().iter().map(PlanAction::text);
    let actions = texts.map(|text| (action_name(text), action_arguments(text).collect()));
    let actions = MissionActions::new(actions).map_err(of_file)?;
    let executor = PetriNetExecutor::restore(Arc::new(plan), order, &saved.executor);
    let executor = executor.map_err(|error| error.to_string())?;
    Ok((PetriNetRun { executor, team, fired: saved.fired, conflicts: saved.conflicts }, actions))
}

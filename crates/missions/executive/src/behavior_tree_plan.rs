//! Plan whose mission is a behavior tree.

use std::path::Path;
use std::sync::Arc;

use slate_behavior_tree::{
    BehaviorTree, BoardValue, LeafKind, LeafModels, LeafPorts, NodeStatus, TickError, TreeExecutor, TreeHost,
    TreeLeaf, TreeState,
};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::activity_hash::ActivityHash;
use crate::conditions::{ConditionName, ConditionValues, KnownConditions};
use crate::mission::{MissionExecutor, PlanMission};
use crate::tree_view::TreeView;
use crate::view::{
    ActivityWriter, ForcedOutcome, Forcing, MissionActivity, MissionDrawing, MissionGraph, MissionNotation,
    MissionOrder, MissionRobot, MissionSight, tree,
};

/// Maximum number of ticks of a tree in a run of the Plan.
const MOST_TICKS: usize = 32;

/// State of a mission that is a behavior tree.
#[interface]
pub struct TreeMissionStatus {
    /// Number of ticks of the tree.
    pub ticks: u64,
    /// ID of the tree.
    pub tree: Text<60>,
    /// Actions that run and unknown conditions: "Go, waits for `localized`".
    pub running: Text<252>,
}

/// Conditions and outputs of the Plan.
#[ports]
pub struct BehaviorTreePlanPorts {
    /// Conditions of an Analyze.
    conditions: Noticed<ConditionValues>,
    /// Conditions of Knowledge or of a person.
    facts: Input<ConditionValues>,
    /// State of the mission, written when other actions run.
    mission: Output<TreeMissionStatus>,
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
    /// XML of the tree, for monitors.
    #[capacity(262_144)]
    tree_xml: Debug<TreeView>,
    /// Statuses of the nodes, for monitors.
    #[capacity(10_000)]
    tree_nodes: Debug<TreeView>,
    /// Values of the blackboards, for monitors.
    #[capacity(65_536)]
    tree_blackboards: Debug<TreeView>,
}

/// Parameters of [`BehaviorTreePlan`].
#[params]
pub struct BehaviorTreePlanParams {
    #[param(default = "", doc = "file of the tree, in the XML of BehaviorTree.CPP 4")]
    tree_filename: Text<252>,
    #[param(default = "", doc = "names of numbers in scripts, such as `RED = 0, GREEN = 1`")]
    enumerations: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission runs")]
    revision: u32,
}

/// State of [`BehaviorTreePlan`].
pub type BehaviorTreePlanState = PlanMission<TreeExecutor>;

impl MissionExecutor for TreeExecutor {
    type Saved = TreeState;
    const NOUN: &'static str = "tree";
    const PARAMETER: &'static str = "tree_filename";
    const NOTATION: MissionNotation = MissionNotation::BEHAVIOR_TREE;

    fn mission_state(&self) -> MissionState {
        match self.outcome() {
            NodeStatus::Succeeded => MissionState::SUCCEEDED,
            NodeStatus::Failed => MissionState::FAILED,
            _ => MissionState::RUNNING,
        }
    }

    fn draw(&self) -> MissionDrawing {
        tree::draw(self.tree())
    }

    fn hash_into(&self, _: &MissionSight<'_>, hash: &mut ActivityHash) {
        tree::hash(self, hash);
    }

    fn describe(&self, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
        tree::describe(self, seen, activity);
        let mut running = String::new();
        write_running(self, &mut running);
        activity.reason = Text::new(&running);
    }

    fn step(&mut self, robot: MissionRobot<'_>) -> Result<(), String> {
        let MissionRobot { actions, conditions, now } = robot;
        let ticked = self.tick(now.now(), &mut TreeMission { actions, conditions, now });
        ticked.map(|_| ()).map_err(|error| error.to_string())
    }

    fn force(&mut self, element: usize, outcome: ForcedOutcome, mut robot: MissionRobot<'_>) -> Forcing {
        let tree = self.tree();
        let Some((index, leaf)) = tree::leaf(tree, element) else {
            let reason = "only an action or a condition can be forced: the nodes above follow from them";
            return Forcing::Refused(reason.into());
        };
        match leaf.kind() {
            LeafKind::Action => robot.end(index, outcome, tree.nodes()[element].name()),
            LeafKind::Condition => match robot.conditions.set(leaf.id(), outcome == ForcedOutcome::SUCCESS) {
                Ok(()) => Forcing::Done,
                Err(reason) => Forcing::Refused(reason),
            },
        }
    }

    fn save(&self) -> Result<TreeState, String> {
        Ok(self.state())
    }

    /// Returns the path of each leaf's node, and its ID.
    fn names(&self) -> Box<dyn Iterator<Item = (&str, &str)> + '_> {
        let tree = self.tree();
        Box::new(tree.leaves().iter().map(|leaf| (tree.nodes()[leaf.node()].path(), leaf.id())))
    }
}

/// Plan that follows a behavior tree.
///
/// Its actions are those of Execute, its conditions come from Analyzes and Knowledge.
pub struct BehaviorTreePlan;

impl Plan for BehaviorTreePlan {
    const NAME: &'static str = "behavior_tree_plan";
    const DOC: &'static str = "Follows a mission that is a behavior tree.";
    type Noticed = BehaviorTreePlanPorts;
    type Params = BehaviorTreePlanParams;
    type State = BehaviorTreePlanState;

    fn run(
        state: &mut BehaviorTreePlanState,
        io: &BehaviorTreePlanPorts,
        situation: &Situation<'_>,
        params: &BehaviorTreePlanParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let file = params.tree_filename.as_str();
        state.read(file, params.revision, now, |saved| load_tree(file, params.enumerations.as_str(), saved));
        state.update(&io.conditions, &io.facts, situation);
        state.obey(&io.orders, now);
        if let Err(error) = run_tree(state, now) {
            state.fail(&error.to_string(), now);
        }
        state.actions.request(situation, plan);
        report(state, io);
        state.publish(&io.graph, &io.activity, now);
        if let Some(executor) = &state.executor {
            TreeView::write_tree(&io.tree_xml, executor);
            TreeView::write_nodes(&io.tree_nodes, executor);
            TreeView::write_blackboards(&io.tree_blackboards, executor);
        }
    }
}

/// View of the robot for a tree.
struct TreeMission<'a> {
    actions: &'a mut MissionActions,
    conditions: &'a KnownConditions,
    now: &'a Tick,
}

impl TreeHost for TreeMission<'_> {
    fn condition(&mut self, _: usize, leaf: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        match self.conditions.get(leaf.id()) {
            Some(true) => NodeStatus::Succeeded,
            Some(false) => NodeStatus::Failed,
            None => NodeStatus::Running,
        }
    }

    fn start(&mut self, index: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus {
        let read = read_arguments(leaf, ports);
        let set = read.and_then(|arguments| self.actions.set_arguments(index, leaf.id(), &arguments));
        if let Err(reason) = set {
            self.now.error(format_args!("{reason}; the action has failed"));
            return NodeStatus::Failed;
        }
        self.actions.start(index, self.now.now());
        NodeStatus::Running
    }

    fn progress(&mut self, index: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        match self.actions.progress(index, self.now.now()) {
            ActionProgress::Succeeded => NodeStatus::Succeeded,
            ActionProgress::Failed => NodeStatus::Failed,
            // Actions cancelled by a reflex are requested again.
            ActionProgress::Idle | ActionProgress::Running | ActionProgress::Preempted => NodeStatus::Running,
        }
    }

    fn halt(&mut self, index: usize, _: &TreeLeaf) {
        self.actions.stop(index);
    }
}

/// Ticks the tree until no node wants another tick in this run.
pub(crate) fn run_tree(mission: &mut BehaviorTreePlanState, now: &Tick) -> Result<(), TickError> {
    let is_paused = mission.is_paused();
    let PlanMission { executor: Some(executor), actions, conditions, failure: None, .. } = mission else {
        return Ok(());
    };
    let mut host = TreeMission { actions, conditions, now };
    for _ in 0..if is_paused { 0 } else { MOST_TICKS } {
        if executor.outcome().is_completed() {
            break;
        }
        executor.tick(now.now(), &mut host)?;
        if !executor.wants_tick() {
            break;
        }
    }
    Ok(())
}

/// Writes the outputs where something has changed.
fn report(mission: &mut BehaviorTreePlanState, io: &BehaviorTreePlanPorts) {
    let text = &mut mission.report_text;
    text.clear();
    let mut ended = None;
    if let Some(executor) = &mission.executor {
        write_running(executor, text);
        ended = match executor.outcome() {
            NodeStatus::Succeeded => Some(Ok("the tree has succeeded")),
            NodeStatus::Failed => Some(Err("the tree has failed")),
            _ => None,
        };
    }
    let verdict = mission.verdict(ended);
    let running = if verdict.state == MissionState::RUNNING { mission.report_text.len() } else { 0 };
    if running == 0 {
        mission.report_text.push_str(verdict.reason.as_str());
    }
    if !mission.takes_report() {
        return;
    }
    if let Some(executor) = &mission.executor {
        io.mission.set(TreeMissionStatus {
            ticks: executor.ticks(),
            tree: Text::new(executor.tree().name()),
            running: Text::new(&mission.report_text[..running]),
        });
    }
    io.verdict.set(verdict);
}

/// Writes the actions that run, and the conditions that are unknown.
fn write_running(executor: &TreeExecutor, text: &mut String) {
    let tree = executor.tree();
    let running = || tree.leaves().iter().filter(|leaf| executor.status(leaf.node()) == NodeStatus::Running);
    for leaf in running().filter(|leaf| leaf.kind() == LeafKind::Action) {
        text.push_str(if text.is_empty() { "" } else { ", " });
        text.push_str(tree.nodes()[leaf.node()].name());
    }
    for (number, leaf) in running().filter(|leaf| leaf.kind() == LeafKind::Condition).enumerate() {
        text.push_str(match (number, text.is_empty()) {
            (0, true) => "waits for `",
            (0, false) => ", waits for `",
            _ => ", `",
        });
        text.push_str(leaf.id());
        text.push('`');
    }
}

/// Reads the numbers in the ports of an action, in the order of its model.
fn read_arguments(leaf: &TreeLeaf, ports: &LeafPorts<'_>) -> Result<Vec<f64>, String> {
    let number = |port| {
        ports.number(port).ok_or_else(|| {
            let found = ports.get(port).map_or("none".into(), |value| format!("`{value}`"));
            format!("expected a number in the port `{port}` of the action `{}`, found {found}", leaf.id())
        })
    };
    ports.inputs().map(number).collect()
}

/// Names of numbers, such as `RED = 0, GREEN = 1`.
fn enumerations(text: &str) -> Result<LeafModels, String> {
    let mut models = LeafModels::default();
    for part in text.split(',').filter(|part| !part.trim().is_empty()) {
        let entry =
            part.split_once('=').and_then(|(name, number)| Some((name.trim(), number.trim().parse().ok()?)));
        let (name, number) = entry.filter(|(name, _)| !name.is_empty()).ok_or_else(|| {
            format!(
                "expected a name and an integer such as `RED = 0` in `enumerations`, found `{}`",
                part.trim()
            )
        })?;
        models = models.enumeration(name, number);
    }
    Ok(models)
}

/// Reads a tree, and restores a state into it.
pub(crate) fn load_tree(
    file: &str,
    names: &str,
    saved: &TreeState,
) -> Result<(TreeExecutor, MissionActions), String> {
    let tree =
        BehaviorTree::read(Path::new(file), &enumerations(names)?).map_err(|error| error.to_string())?;
    let conditions = tree.leaves().iter().filter(|leaf| leaf.kind() == LeafKind::Condition);
    // The values of a longer one are cut, and never found.
    if let Some(leaf) =
        conditions.into_iter().find(|leaf| ConditionName::new(leaf.id()).as_str() != leaf.id())
    {
        return Err(format!("{file}: expected a shorter name of the condition `{}`", leaf.id()));
    }
    for leaf in tree.leaves().iter().filter(|leaf| leaf.kind() == LeafKind::Action) {
        let is_no_number = |value: &BoardValue| value.number().is_none();
        if let Some((port, value)) = leaf.literals().find(|(_, value)| is_no_number(value)) {
            let node = &tree.nodes()[leaf.node()];
            let (place, line) = (node.file().unwrap_or(Path::new(file)).display(), node.line());
            return Err(format!(
                "{place}:{line}: expected a number in the port `{port}` of the action `{}`, found `{value}`",
                leaf.id()
            ));
        }
    }
    // The arguments come with the start, as some are entries of the blackboard.
    let actions = MissionActions::with_arguments_at_start(tree.leaves().len());
    let executor = TreeExecutor::restore(Arc::new(tree), saved).map_err(|error| error.to_string())?;
    Ok((executor, actions))
}

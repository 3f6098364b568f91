//! Plan whose mission is a behaviour tree.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_behavior_tree::{
    BehaviorTree, BoardValue, LeafKind, LeafModels, LeafPorts, NodeStatus, TickError, TreeExecutor, TreeHost,
    TreeLeaf, TreeState,
};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::actions::{MissionActions, SavedActions};
use crate::conditions::{ConditionName, ConditionValues, KnownConditions};

/// The most ticks of a tree in a run of the Plan.
const MOST_TICKS: usize = 32;

/// State of a mission that is a behaviour tree.
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
}

/// Parameters of [`BehaviorTreePlan`].
#[params]
pub struct BehaviorTreePlanParams {
    #[param(default = "", doc = "file of the tree, in the XML of BehaviorTree.CPP 4")]
    tree_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission goes on")]
    revision: u32,
}

/// Saved state of the Plan.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
struct SavedTreePlan {
    executor: TreeState,
    actions: SavedActions,
    /// Arguments of each action that runs, by the path of its node and its ID.
    arguments: Vec<(String, String, Vec<f64>)>,
    conditions: KnownConditions,
    failure: Option<String>,
    last_status_text: Option<String>,
}

/// State of [`BehaviorTreePlan`].
#[derive(Default)]
pub struct BehaviorTreePlanState {
    /// File and revision that were read.
    read: Option<(String, u32)>,
    executor: Option<TreeExecutor>,
    actions: MissionActions,
    /// Arguments of each leaf since its start.
    arguments: Vec<Vec<f64>>,
    conditions: KnownConditions,
    /// Why the mission can't go on.
    failure: Option<String>,
    /// State that waits for its tree.
    restored: Option<SavedTreePlan>,
    /// Text of the status that was written, or how the mission has ended.
    last_status_text: Option<String>,
    /// Text of the newest status, kept so that a run allocates nothing.
    status_text: String,
}

impl Serialize for BehaviorTreePlanState {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.save().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for BehaviorTreePlanState {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self { restored: Some(SavedTreePlan::deserialize(deserializer)?), ..Self::default() })
    }
}

/// Plan that follows a behaviour tree.
///
/// Its actions are those of Execute, its conditions come from Analyzes and Knowledge.
pub struct BehaviorTreePlan;

impl Plan for BehaviorTreePlan {
    const NAME: &'static str = "behavior_tree_plan";
    const DOC: &'static str = "Follows a mission that is a behaviour tree.";
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
            state.last_status_text = None;
        }
        state.actions.request(situation, plan);
        state.report(io);
    }
}

/// The robot as a tree sees it.
struct TreeMission<'a> {
    actions: &'a mut MissionActions,
    arguments: &'a mut [Vec<f64>],
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
        let arguments = &mut self.arguments[index];
        let read = read_arguments(leaf, ports, arguments);
        if let Err(reason) = read.and_then(|()| self.actions.set_arguments(index, leaf.id(), arguments)) {
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
            // What a reflex has cancelled is requested again.
            ActionProgress::Idle | ActionProgress::Running | ActionProgress::Preempted => NodeStatus::Running,
        }
    }

    fn halt(&mut self, index: usize, _: &TreeLeaf) {
        self.actions.stop(index);
    }
}

impl BehaviorTreePlanState {
    /// Reads the tree, when the agent starts and when its file or revision changes.
    ///
    /// A mission that goes on keeps its old tree where the new one is invalid or lacks a node that runs.
    fn read(&mut self, params: &BehaviorTreePlanParams, now: &Tick) {
        let (file, revision) = (params.tree_filename.as_str(), params.revision);
        if self.read.as_ref().is_some_and(|(known, old)| known == file && *old == revision) {
            return;
        }
        self.read = Some((file.into(), revision));
        match load(file).and_then(|(tree, actions)| self.exchange(tree, actions)) {
            Ok(()) => {}
            Err(reason) if self.executor.is_some() => {
                now.error(format_args!("{reason}; the mission goes on with the old tree"));
            }
            Err(reason) => {
                now.error(format_args!("{reason}; name another `tree_filename`"));
                self.failure = Some(reason);
            }
        }
    }

    /// Goes on with a changed tree, or begins with it where the old one has ended.
    fn exchange(&mut self, tree: Arc<BehaviorTree>, mut actions: MissionActions) -> Result<(), String> {
        let is_running = self.executor.is_some();
        let saved = match &self.executor {
            Some(executor) if executor.outcome().is_completed() => {
                SavedTreePlan { conditions: self.conditions.clone(), ..SavedTreePlan::default() }
            }
            Some(_) => self.save(),
            None => self.restored.clone().unwrap_or_default(),
        };
        let executor =
            TreeExecutor::restore(Arc::clone(&tree), &saved.executor).map_err(|error| error.to_string())?;
        let mut all_arguments = vec![Vec::new(); tree.leaves().len()];
        for (index, (path, id)) in names(&tree).enumerate() {
            let is_own = |(own, own_id, _): &&(String, String, Vec<f64>)| own == path && own_id == id;
            if let Some((_, _, arguments)) = saved.arguments.iter().find(is_own) {
                actions.set_arguments(index, id, arguments)?;
                all_arguments[index].clone_from(arguments);
            }
        }
        actions.restore(&saved.actions, names(&tree));
        self.executor = Some(executor);
        (self.actions, self.arguments, self.conditions) = (actions, all_arguments, saved.conditions);
        // A changed tree is reported; a restored one was.
        self.last_status_text = saved.last_status_text.filter(|_| !is_running);
        self.failure = saved.failure.filter(|_| !is_running);
        self.restored = None;
        Ok(())
    }

    fn save(&self) -> SavedTreePlan {
        let Some(executor) = &self.executor else { return self.restored.clone().unwrap_or_default() };
        let leaves = executor.tree().leaves().iter().zip(&self.arguments);
        // Those without ports have none, and are saved as well.
        let running = leaves.filter(|(leaf, _)| {
            leaf.kind() == LeafKind::Action && executor.status(leaf.node()) == NodeStatus::Running
        });
        let arguments = running.map(|(leaf, own)| {
            let path = executor.tree().nodes()[leaf.node()].path();
            (path.to_owned(), leaf.id().to_owned(), own.clone())
        });
        SavedTreePlan {
            executor: executor.state(),
            actions: self.actions.save(names(executor.tree())),
            arguments: arguments.collect(),
            conditions: self.conditions.clone(),
            failure: self.failure.clone(),
            last_status_text: self.last_status_text.clone(),
        }
    }

    /// Ticks the tree until no node wants another tick in this run.
    fn tick(&mut self, now: &Tick) -> Result<(), TickError> {
        let Self { executor: Some(executor), actions, arguments, conditions, .. } = self else {
            return Ok(());
        };
        let mut host = TreeMission { actions, arguments, conditions, now };
        for _ in 0..MOST_TICKS {
            if self.failure.is_some() || executor.outcome().is_completed() {
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
    fn report(&mut self, io: &BehaviorTreePlanPorts) {
        let running = &mut self.status_text;
        running.clear();
        let (mut state, mut outcome) = (MissionState::RUNNING, MissionOutcome::OTHER);
        let mut reason = "";
        if let Some(executor) = &self.executor {
            write_running(executor, running);
            match executor.outcome() {
                NodeStatus::Succeeded => {
                    (state, outcome) = (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED);
                    reason = "the tree has succeeded";
                }
                NodeStatus::Failed => (state, reason) = (MissionState::FAILED, "the tree has failed"),
                _ => {}
            }
        }
        if let Some(failure) = &self.failure {
            (state, reason) = (MissionState::FAILED, failure);
        }
        let is_ended = state != MissionState::RUNNING;
        let length = if is_ended { 0 } else { running.len() };
        if is_ended {
            running.push_str(reason);
        }
        if self.last_status_text.as_ref() == Some(running) {
            return;
        }
        if let Some(executor) = &self.executor {
            io.mission.set(TreeMissionStatus {
                ticks: executor.ticks(),
                tree: Text::new(executor.tree().name()),
                running: Text::new(&running[..length]),
            });
        }
        io.verdict.set(Verdict { state, outcome, reason: Text::new(reason) });
        self.last_status_text = Some(running.clone());
    }
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
fn read_arguments(leaf: &TreeLeaf, ports: &LeafPorts<'_>, arguments: &mut Vec<f64>) -> Result<(), String> {
    arguments.clear();
    for port in ports.inputs() {
        let number = ports.number(port).ok_or_else(|| {
            let found = ports.get(port).map_or("none".into(), |value| format!("`{value}`"));
            format!("expected a number in the port `{port}` of the action `{}`, found {found}", leaf.id())
        })?;
        arguments.push(number);
    }
    Ok(())
}

fn load(file: &str) -> Result<(Arc<BehaviorTree>, MissionActions), String> {
    if file.is_empty() {
        return Err("a mission needs a file with its tree".into());
    }
    let tree =
        BehaviorTree::read(Path::new(file), &LeafModels::default()).map_err(|error| error.to_string())?;
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
            let line = tree.nodes()[leaf.node()].line();
            return Err(format!(
                "{file}:{line}: expected a number in the port `{port}` of the action `{}`, found `{value}`",
                leaf.id()
            ));
        }
    }
    // The arguments come with the start, as some are entries of the blackboard; a `wait` of no time stands for them.
    let placeholders = tree.leaves().iter().map(|_| (crate::actions::WAIT, vec!["0"]));
    let actions = MissionActions::new(placeholders)?;
    Ok((Arc::new(tree), actions))
}

/// Names of leaves: the path of their node, and their ID.
fn names(tree: &BehaviorTree) -> impl Iterator<Item = (&str, &str)> {
    tree.leaves().iter().map(|leaf| (tree.nodes()[leaf.node()].path(), leaf.id()))
}

//! Executives: Plans that follow a mission.
//!
//! A mission reads conditions, which Analyzes, Knowledge or a person set ([`conditions`]), and performs actions of
//! Execute by their kind and arguments ([`actions`]). A developer sees and changes its activity in [`view`].
//! [`petri_net_plan`] is a Plan whose mission is a Petri Net Plan, [`behavior_tree_plan`] one whose mission is a
//! behavior tree, [`golog_plan`] one whose mission is a Golog program, and `behavior_plan`, by the feature `lua`, one
//! that runs skills in Lua.

pub mod actions;
pub mod activity_hash;
#[cfg(feature = "lua")]
pub mod behavior_plan;
pub mod behavior_tree_plan;
pub mod conditions;
pub mod golog_plan;
pub mod manager;
pub mod mission;
pub mod mission_knowledge;
pub mod petri_net_plan;
pub mod team;
pub mod tree_view;
pub mod view;
pub mod wheeled_conditions;

use slate_plugin::mapek::{AnalyzeBlock, KnowledgeBlock, PlanBlock};
use slate_plugin::prelude::*;

#[cfg(feature = "lua")]
plugin!(
    PlanBlock<petri_net_plan::PetriNetPlan>,
    PlanBlock<behavior_tree_plan::BehaviorTreePlan>,
    PlanBlock<golog_plan::GologPlan>,
    PlanBlock<behavior_plan::BehaviorPlan>,
    AnalyzeBlock<wheeled_conditions::WheeledConditions>,
    KnowledgeBlock<mission_knowledge::MissionKnowledge>,
    manager::MissionManager<petri_net_plan::PetriNetRun>,
    manager::MissionManager<slate_behavior_tree::TreeExecutor>,
    manager::MissionManager<slate_golog::GologExecutor>,
    manager::MissionManager<slate_behavior::BehaviorEngine>,
);

#[cfg(not(feature = "lua"))]
plugin!(
    PlanBlock<petri_net_plan::PetriNetPlan>,
    PlanBlock<behavior_tree_plan::BehaviorTreePlan>,
    PlanBlock<golog_plan::GologPlan>,
    AnalyzeBlock<wheeled_conditions::WheeledConditions>,
    KnowledgeBlock<mission_knowledge::MissionKnowledge>,
    manager::MissionManager<petri_net_plan::PetriNetRun>,
    manager::MissionManager<slate_behavior_tree::TreeExecutor>,
    manager::MissionManager<slate_golog::GologExecutor>,
);

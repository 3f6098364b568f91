//! Executives: Plans that follow a mission.
//!
//! A mission reads conditions, which Analyzes, Knowledge or a person set ([`conditions`]), and performs actions of
//! Execute by their kind and arguments ([`actions`]). [`petri_net_plan`] is a Plan whose mission is a Petri Net Plan,
//! [`behavior_tree_plan`] one whose mission is a behaviour tree, and [`golog_plan`] one whose mission is a Golog
//! program.

pub mod actions;
pub mod behavior_tree_plan;
pub mod conditions;
pub mod golog_plan;
pub mod petri_net_plan;
pub mod wheeled_conditions;

use slate_plugin::mapek::{AnalyzeBlock, PlanBlock};
use slate_plugin::prelude::*;

plugin!(
    PlanBlock<petri_net_plan::PetriNetPlan>,
    PlanBlock<behavior_tree_plan::BehaviorTreePlan>,
    PlanBlock<golog_plan::GologPlan>,
    AnalyzeBlock<wheeled_conditions::WheeledConditions>,
);

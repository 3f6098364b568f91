//! Two robots that exchange the roles of attacker and defender.
//! Each states its activity, knows the other's statement, and takes its role by that (RoCS, 4.2: StrategyModel).
//!
//! Monitors, actions and the Plan come from `slate-wheeled`. New are [`assign_role`], an Analyze, and [`team_knowledge`], which
//! adds statements to the knowledge of a robot with strategies.

pub mod assign_role;
pub mod team_knowledge;

use slate_plugin::mapek::{AnalyzeBlock, KnowledgeBlock};
use slate_plugin::prelude::*;

/// Example's configuration.
pub const CONFIGURATION: &str = include_str!("../roles.toml");

plugin!(AnalyzeBlock<assign_role::AssignRole>, KnowledgeBlock<team_knowledge::TeamKnowledge>);

//! Self-adaptation with the blocks of MAPE-K: the health of a robot is sensors, and its settings are actuators.
//!
//! | block | here | what it does |
//! |---|---|---|
//! | Monitor | [`range_health`] | how a sensor that measures ranges does: how old, no numbers, always the same |
//! | Analyze | [`condition`] | says when a sensor fails, and when it has recovered |
//! | Plan | [`planner`] | chooses between the [`alternatives`] that the configuration names |
//! | Execute | [`actions`] | changes links and parameters, and looks whether that has the effect |
//!
//! Only [`range_health`] and the effect in [`actions`] know what kind of robot they look after.

pub mod actions;
pub mod alternatives;
pub mod condition;
pub mod planner;
pub mod range_health;

use slate_plugin::mapek::{AnalyzeBlock, ExecuteBlock, MonitorBlock, PlanBlock};
use slate_plugin::prelude::*;

plugin!(
    MonitorBlock<range_health::RangeHealthMonitor>,
    AnalyzeBlock<condition::TellCondition>,
    PlanBlock<planner::AdaptationPlanner>,
    ExecuteBlock<actions::AdaptationActions>,
);

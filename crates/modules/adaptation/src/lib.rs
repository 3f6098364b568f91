//! Self-adaptation with the blocks of MAPE-K.
//! A robot's health is read as sensors, its settings are written as actuators.
//!
//! | block | here | what it does |
//! |---|---|---|
//! | Sensor | [`range_health`] | range measurements and odometry of the robot that is managed |
//! | Monitor | [`range_health`] | health of a range sensor: age, NaN, unchanged measurements |
//! | Analyze | [`condition`] | reports failure and recovery of a sensor |
//! | Plan | [`planner`] | chooses among the [`alternatives`] of the configuration |
//! | Execute | [`actions`] | changes links and parameters, and confirms the effect |
//!
//! [`context_subsystem`] is a module of robots without blocks, whose output is linked to parameters of other modules.
//!
//! Only [`range_health`] and the effect in [`actions`] depend on the kind of robot.

pub mod actions;
pub mod alternatives;
pub mod condition;
pub mod context_subsystem;
pub mod planner;
pub mod range_health;

use slate_plugin::mapek::{AnalyzeBlock, ExecuteBlock, MonitorBlock, PlanBlock, SensorBlock};
use slate_plugin::prelude::*;

plugin!(
    context_subsystem::ContextSubsystem,
    SensorBlock<range_health::ManagedSonar>,
    SensorBlock<range_health::ManagedOdometry>,
    MonitorBlock<range_health::RangeHealthMonitor>,
    AnalyzeBlock<condition::ReportCondition>,
    PlanBlock<planner::AdaptationPlanner>,
    ExecuteBlock<actions::AdaptationActions>,
);

//! Blocks and actions of wheeled robots, for the experiments of RoCS (section 6).
//!
//! | block | class of the paper | here |
//! |---|---|---|
//! | Monitor | `RangeVREPMonitor`, `PositionVREPMonitor`, `OrientationVREPMonitor` | [`monitors`] |
//! | Analyze | `PassRange`, `PassPosition`, `PassOrientation`; `P3dxPositonAnalyze` | [`analyzes`]; [`locate_robot`]; on a real robot [`localize`] |
//! | Plan | `GoToOriginPlanner` | [`go_to_origin`], as any [`journey`]; [`strategy_planner`] |
//! | Execute | actions of Table 2 | [`actions`], on a [`body`] of two wheels ([`differential`]) or four ([`skid_steer`]) |
//! | Knowledge | `PioneerKnowledge`, `PionerP3DXModel`, `RobotnikModel` | [`knowledge`]; [`strategic_knowledge`] |
//! | ReactiveModel | `AvoidObstacleModel` | [`avoid_obstacle`]; by rank [`bumper_release`], [`give_way`], this, [`keep_wall`] |
//!
//! [`avoid_wall`] has the reactive law that the authors ran, as the baseline.

pub mod actions;
pub mod analyzes;
pub mod arrival;
pub mod avoid_obstacle;
pub mod avoid_wall;
pub mod body;
pub mod bumper_release;
pub mod differential;
pub mod give_way;
pub mod go_to_origin;
pub mod journey;
pub mod keep_wall;
pub mod knowledge;
pub mod laser_ring;
pub mod localize;
pub mod locate_robot;
pub mod monitors;
pub mod own_motion;
pub mod skid_steer;
pub mod strategic_knowledge;
pub mod strategy_planner;
pub mod tracks;

use slate_plugin::mapek::{
    AnalyzeBlock, ExecuteBlock, KnowledgeBlock, MonitorBlock, PlanBlock, ReactiveBlock, SensorBlock,
};
use slate_plugin::prelude::*;

plugin!(
    arrival::Arrival,
    SensorBlock<laser_ring::LaserRing>,
    MonitorBlock<monitors::RangeMonitor>,
    MonitorBlock<monitors::PositionMonitor>,
    MonitorBlock<monitors::OrientationMonitor>,
    MonitorBlock<locate_robot::RobotMonitor>,
    MonitorBlock<localize::OdometryMonitor>,
    AnalyzeBlock<analyzes::PassRange>,
    AnalyzeBlock<analyzes::PassPosition>,
    AnalyzeBlock<analyzes::PassOrientation>,
    AnalyzeBlock<locate_robot::LocateRobot>,
    AnalyzeBlock<localize::Localize>,
    PlanBlock<go_to_origin::GoToOriginPlanner>,
    PlanBlock<strategy_planner::StrategyPlanner>,
    ExecuteBlock<differential::DifferentialActions>,
    ExecuteBlock<skid_steer::SkidSteerActions>,
    KnowledgeBlock<knowledge::WheeledKnowledge>,
    KnowledgeBlock<strategic_knowledge::StrategicKnowledge>,
    ReactiveBlock<avoid_obstacle::AvoidObstacleModel>,
    ReactiveBlock<avoid_wall::AvoidWallModel>,
    ReactiveBlock<give_way::GiveWayModel>,
    ReactiveBlock<bumper_release::BumperReleaseModel>,
    ReactiveBlock<keep_wall::KeepWallModel>,
);

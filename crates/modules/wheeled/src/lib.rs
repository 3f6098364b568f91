//! Blocks and actions of wheeled robots, for the experiments of RoCS (section 6).
//!
//! | block | class of the paper | here |
//! |---|---|---|
//! | Monitor | `RangeVREPMonitor`, `PositionVREPMonitor`, `OrientationVREPMonitor` | [`monitors`] |
//! | Analyze | `PassRange`, `PassPosition`, `PassOrientation`; `P3dxPositonAnalyze` | [`analyzes`]; [`locate_robot`]; [`local_map`]; the pose by [`estimate_pose`] |
//! | Plan | `GoToOriginPlanner` | [`go_to_origin`], as any [`navigator`]; [`local_planner`]; [`strategy_planner`] |
//! | Execute | actions of Table 2 | [`actions`], on a [`body`] of two wheels ([`differential`]) or four ([`skid_steer`]) |
//! | Knowledge | `PioneerKnowledge`, `PionerP3DXModel`, `RobotnikModel` | [`knowledge`] with [`rules`]; [`strategic_knowledge`] |
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
pub mod estimate_pose;
pub mod frozen_sensors;
pub mod frozen_sonars;
pub mod give_way;
pub mod go_to_origin;
pub mod goals;
pub mod hardware;
pub mod held_robot_sensor;
pub mod keep_wall;
pub mod knowledge;
mod knowledge_params;
pub mod laser_ring;
pub mod late_sensors;
pub mod local_map;
pub mod local_planner;
pub mod locate_robot;
mod median;
pub mod median_sonar;
pub mod monitors;
pub mod navigator;
pub mod nodes;
pub mod odometry_pose;
pub mod rules;
pub mod skid_steer;
pub mod skid_steer_interface;
pub mod strategic_knowledge;
pub mod strategy_planner;
pub mod track_filter;
pub mod tracks;
pub mod traveled_pose;
pub mod twist_estimator;
pub mod velocity_control;

use slate_plugin::mapek::{
    ActuatorBlock, AnalyzeBlock, ExecuteBlock, KnowledgeBlock, MonitorBlock, PlanBlock, ReactiveBlock,
    SensorBlock,
};
use slate_plugin::prelude::*;

plugin!(
    arrival::Arrival,
    skid_steer_interface::SkidSteerInterface,
    velocity_control::VelocityControl,
    SensorBlock<held_robot_sensor::HeldRobotSensor>,
    SensorBlock<laser_ring::LaserRing>,
    SensorBlock<median_sonar::MedianSonar>,
    SensorBlock<odometry_pose::OdometryPosition>,
    SensorBlock<odometry_pose::OdometryOrientation>,
    SensorBlock<nodes::SonarNode>,
    SensorBlock<nodes::PositionNode>,
    SensorBlock<nodes::OrientationNode>,
    SensorBlock<nodes::OdometryNode>,
    SensorBlock<nodes::BumperNode>,
    SensorBlock<nodes::LaserNode>,
    ActuatorBlock<nodes::WheelsNode>,
    ActuatorBlock<nodes::TwistNode>,
    MonitorBlock<monitors::RangeMonitor>,
    MonitorBlock<monitors::PositionMonitor>,
    MonitorBlock<monitors::OrientationMonitor>,
    MonitorBlock<locate_robot::RobotMonitor>,
    MonitorBlock<monitors::OdometryMonitor>,
    AnalyzeBlock<analyzes::PassRange>,
    AnalyzeBlock<analyzes::PassPosition>,
    AnalyzeBlock<analyzes::PassOrientation>,
    AnalyzeBlock<local_map::MapObstacles>,
    AnalyzeBlock<locate_robot::LocateRobot>,
    AnalyzeBlock<estimate_pose::EstimatePose>,
    PlanBlock<go_to_origin::GoToOriginPlanner>,
    PlanBlock<local_planner::LocalPlanner>,
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

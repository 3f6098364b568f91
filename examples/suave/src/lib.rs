//! SUAVE exemplar (kas-lab/suave): adaptation of an underwater vehicle.
//! The vehicle searches for a pipeline and inspects it, while the visibility of the water changes and a thruster fails.
//! Its functions are plain modules in front of an Actuator ([`managed`]); four managers ([`manager`]) adapt them in the
//! same simulator.

pub mod interfaces;
pub mod managed;
pub mod manager;
pub mod referee;
pub mod simulator;
pub mod statistics;
pub mod vehicle;

use slate_plugin::mapek::{
    ActuatorBlock, AnalyzeBlock, ExecuteBlock, KnowledgeBlock, MonitorBlock, PlanBlock, SensorBlock,
};
use slate_plugin::prelude::*;

/// Name of the example.
pub const NAME: &str = "suave";
/// Summary of the example.
pub const ABOUT: &str = "SUAVE: an underwater vehicle adapts itself while it searches for a pipeline";
/// Configuration of the example.
pub const CONFIGURATION: &str = include_str!("../suave.toml");

plugin!(
    simulator::SuaveSimulator,
    referee::SuaveReferee,
    managed::autopilot::Autopilot,
    managed::mission::PipelineMission,
    managed::spiral_search::SpiralSearch,
    managed::follow_pipeline::FollowPipeline,
    managed::recover_thrusters::RecoverThrusters,
    ActuatorBlock<managed::thrusters::Thrusters>,
    manager::unmanaged::UnmanagedMission,
    manager::random::RandomManager,
    manager::metacontrol::Metacontrol,
    SensorBlock<manager::health::VisibilitySensor>,
    SensorBlock<manager::health::ThrusterSensor>,
    SensorBlock<manager::health::MissionSensor>,
    SensorBlock<manager::health::FunctionSensor>,
    MonitorBlock<manager::health::VisibilityMonitor>,
    MonitorBlock<manager::health::ThrusterMonitor>,
    MonitorBlock<manager::health::MissionMonitor>,
    AnalyzeBlock<manager::outlook::SearchOutlook>,
    AnalyzeBlock<manager::outlook::PassThrusters>,
    AnalyzeBlock<manager::outlook::PassTask>,
    PlanBlock<manager::plan::ManagerPlan>,
    ExecuteBlock<manager::actions::ManagerActions>,
    KnowledgeBlock<manager::knowledge::ManagerKnowledge>,
);

//! Localization, occupancy grid mapping and global planning.
//! [`PoseEstimator`], [`OccupancyMapper`] and [`PathPlanner`].
//!
//! Messages correct each by hand: reset the pose, and paint obstacles that the laser does not see.
//!
//! A robot without blocks has the kinds `grid_mapper`, which is [`OccupancyMapper`], and [`GlobalPlanner`].
//!
//! All three are Analyzes. Each reads the result of another one as a fact of the robot's Knowledge: in the same cycle, and
//! without a copy.
//!
//! ```toml
//! [robots.r2.modules]
//! laser = { kind = "simulated_laser" }
//! odometry = { kind = "simulated_odometry" }
//! laser_monitor = {}
//! odometry_monitor = {}
//! pose_estimator = {}
//! occupancy_mapper = { params = { origin_x = -2.5, origin_y = -2.5, width = 5.0, height = 5.0 } }
//! path_planner = { params = { robot_radius = 0.3 } }
//! knowledge = { kind = "wheeled_knowledge", params = { robot = "pioneer_p3dx" } }
//! [robots.r2.links]
//! "knowledge/pose" = "pose_estimator/change"
//! "knowledge/map" = "occupancy_mapper/change"
//! "occupancy_mapper/pose" = "knowledge/pose/pose"
//! "laser_monitor/robot" = "knowledge/robot/robot"
//! "occupancy_mapper/robot" = { from = "knowledge/robot/robot", previous = true }
//! "path_planner/map" = "knowledge/map"
//! "path_planner/pose" = "knowledge/pose/pose"
//! ```

mod external_frame;
mod global_planner;
mod laser;
mod occupancy_mapper;
mod painting;
mod path_planner;
mod pose_belief;
mod pose_estimator;
mod pose_filter;
mod search;

pub use external_frame::{ExternalFrame, ExternalFrameIo};
pub use global_planner::{
    GlobalPlanner, GlobalPlannerIo, GlobalPlannerParams, GlobalPlannerState, PathStatus,
};
pub use laser::{LaserMonitor, LaserSensors};
pub use occupancy_mapper::{OccupancyMapper, OccupancyMapperIo, OccupancyMapperParams, OccupancyMapperState};
pub use path_planner::{PathPlanner, PathPlannerIo, PathPlannerParams, PathPlannerState};
pub use pose_belief::PoseBelief;
pub use pose_estimator::{PoseEstimator, PoseEstimatorIo, PoseEstimatorParams};
pub use pose_filter::OdometryNoise;

use slate_mapek::{AnalyzeBlock, MonitorBlock, PlainAnalyze, PlainModule};

impl PlainAnalyze for OccupancyMapper {
    const KIND: &'static str = "grid_mapper";
}

/// Largest number of cells of a map.
const MOST_CELLS: usize = 65_536;

slate_module::plugin!(
    MonitorBlock<LaserMonitor>,
    AnalyzeBlock<PoseEstimator>,
    AnalyzeBlock<OccupancyMapper>,
    AnalyzeBlock<PathPlanner>,
    ExternalFrame,
    GlobalPlanner,
    PlainModule<OccupancyMapper>,
);

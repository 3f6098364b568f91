//! Localization ([`PoseEstimator`]), occupancy grid mapping ([`OccupancyMapper`]) and global planning ([`PathPlanner`]).
//!
//! Messages correct each by hand: reset the pose, and paint obstacles that the laser does not see.
//!
//! ```toml
//! [modules]
//! pose_estimator = {}
//! occupancy_mapper = { params = { origin_x = -2.5, origin_y = -2.5, width = 5.0, height = 5.0 } }
//! path_planner = { params = { robot_radius = 0.3 } }
//! [links]
//! "pose_estimator/odometry" = "pioneer/odometry"
//! "occupancy_mapper/scan" = "laser/scan"
//! "occupancy_mapper/pose" = "pose_estimator/estimate/pose"
//! "path_planner/map" = "occupancy_mapper/map"
//! "path_planner/pose" = "pose_estimator/estimate/pose"
//! ```

mod distance;
mod geometry;
mod occupancy_mapper;
mod painting;
mod path_planner;
mod pose_estimator;
mod search;

pub use occupancy_mapper::{OccupancyMapper, OccupancyMapperIo, OccupancyMapperParams, OccupancyMapperState};
pub use path_planner::{PathPlanner, PathPlannerIo, PathPlannerParams, PathPlannerState};
pub use pose_estimator::{PoseEstimator, PoseEstimatorIo, PoseEstimatorParams, PoseEstimatorState};

slate_module::plugin!(PoseEstimator, OccupancyMapper, PathPlanner);

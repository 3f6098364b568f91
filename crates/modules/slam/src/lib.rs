//! 2D laser SLAM, from odometry and laser scans.
//!
//! [`GraphSlam`] matches scans with submaps, closes loops by branch and bound, and optimizes a pose graph;
//! [`ParticleSlam`] is a Rao-Blackwellized particle filter. Both are plain data without an agent, which a snapshot can
//! hold: the caller gives poses of the odometry and ends of beams. [`occupancy_map`] makes the map of either.
//!
//! ```
//! use slate_interfaces::Pose2;
//! use slate_slam::{GraphSlam, GraphSlamParameters, occupancy_map};
//!
//! let mut slam = GraphSlam::new(GraphSlamParameters::default())?;
//! // A wall 2 m ahead, which the robot approaches by 0.5 m.
//! let wall = |ahead: f64| -> Vec<[f64; 2]> { (-20..=20).map(|k| [ahead, 0.1 * f64::from(k)]).collect() };
//! slam.insert(Pose2::default(), &wall(2.0));
//! let pose = slam.insert(Pose2 { x: 0.45, y: 0.0, theta: 0.0 }, &wall(1.5));
//! assert!((pose.x - 0.5).abs() < 0.01);
//! slam.finish();
//! let scans = (0..slam.scans()).map(|scan| (slam.poses()[scan], slam.points(scan)));
//! let map = occupancy_map(scans, 0.05, 1_000_000).unwrap();
//! assert!(map.cells.contains(&100));
//! # Ok::<(), slate_slam::InvalidSlamParameter>(())
//! ```

mod block;
mod block_cholesky;
pub mod carmen;
mod correlative;
mod graph_slam;
mod live_map;
mod log_player;
mod loop_closure;
mod max_grids;
mod parameters;
mod particle_slam;
mod pending_work;
mod pose_graph;
mod pose_proposal;
mod refine;
mod render;
mod saved;
mod scan_increment;
mod scan_matcher;
pub mod se2;
mod search_grids;
mod submap;
mod surface_map;

pub use block::{Slam, SlamEdge, SlamEdgeKind, SlamGraph, SlamIo, SlamParams, SlamState, SlamStatus};
pub use graph_slam::GraphSlam;
pub use log_player::{
    LogPlayer, LogPlayerIo, LogPlayerParams, LogPlayerState, LogProgress, LogReferee, LogRefereeIo,
    LogRefereeState,
};
pub use parameters::{
    GraphSlamParameters, InvalidSlamParameter, LoopClosureParameters, MatchingParameters, OdometryDrift,
    ParticleSlamParameters,
};
pub use particle_slam::ParticleSlam;
pub use pose_graph::{Constraint, Optimization, PoseGraph};
pub use render::occupancy_map;

use slate_mapek::{AnalyzeBlock, PlainAnalyze, PlainModule};

impl PlainAnalyze for Slam {
    const KIND: &'static str = "scan_localizer";
}

slate_module::plugin!(AnalyzeBlock<Slam>, PlainModule<Slam>, LogPlayer, LogReferee);

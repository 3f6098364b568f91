//! Recordings of runs ([`Recorder`]), their replay ([`replay`]) and reports.
//! Further parts: tools for recordings ([`bag`]), logs of other systems ([`logs`]), values as ROS 2 messages ([`ros`]),
//! reports of runs and batches.
//!
//! A [`Report`] of one run is a folder with `scene.svg`, `scene.json`, `trajectory.csv`, `trajectory.svg`,
//! `timeline.svg`, `animation.svg` and `summary.json`; a [`TrajectoryStream`] writes the trajectory while the run goes.
//! A [`Batch`] has the statistics of the summaries of many runs.
//!
//! The same data give the same bytes. Only [`Summary::wall_time_s`] differs between two runs of the same configuration and
//! seed.

pub mod bag;
mod batch;
mod error;
mod followed;
pub mod logs;
mod merge;
pub mod page;
mod plot;
mod recorder;
pub mod replay;
mod report;
mod rocs_log;
pub mod ros;
mod scene;
mod statistics;
mod storage;
mod summary;
mod trajectory;

pub use batch::{Batch, Collisions, RobotStatistics, Spread};
pub use error::Error;
pub use recorder::{
    CONFIGURATION, RecordError, RecordState, Recorded, Recorder, UnmatchedPattern, unmatched_patterns,
};
pub use report::Report;
pub use rocs_log::RocsLog;
pub use scene::{Bounds, Circle, Cone, Goal, Polygon, Robot, Scene};
pub use summary::{Outcome, Summary};
pub use trajectory::{
    Route, RouteTally, RouteUse, Sample, ThinnedTrajectory, Trajectory, TrajectoryPosition, TrajectoryStream,
};

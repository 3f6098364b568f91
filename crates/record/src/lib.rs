//! What stays of a run: recordings ([`Recorder`]), what makes the same run again from one ([`replay`]), and recordings as
//! files ([`bag`]); logs of other systems ([`logs`]); reports with trajectories, timelines, summaries and statistics of batches; and values as ROS 2
//! messages, as logs hold them ([`ros`]).
//!
//! Plain data in, files out. A [`Report`] of one run is a folder of five files: `scene.svg`, `trajectory.csv`,
//! `trajectory.svg`, `timeline.svg` and `summary.json`. A [`Batch`] is the statistics over the summaries of many runs.
//!
//! The same data gives the same bytes. Of everything that is written, only [`Summary::wall_time_s`] differs between
//! two runs of the same configuration and seed.

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
pub mod ros;
mod scene;
mod statistics;
mod storage;
mod summary;
mod trajectory;

pub use batch::{Batch, Collisions, Companion, Spread};
pub use error::Error;
pub use recorder::{CONFIGURATION, Misspelt, RecordError, RecordState, Recorded, Recorder, misspelt};
pub use report::Report;
pub use scene::{Bounds, Circle, Cone, Goal, Polygon, Robot, Scene};
pub use summary::{Outcome, Summary};
pub use trajectory::{Route, Sample, ThinnedTrajectory, Trajectory, TrajectoryPosition, TrajectoryStream};

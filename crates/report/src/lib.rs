//! Reports of runs and of batches of runs.
//!
//! A [`Report`] of one run is a folder with `scene.svg`, `scene.json`, `trajectory.csv`, `trajectory.svg`,
//! `timeline.svg`, `animation.svg` and `summary.json`; a [`TrajectoryStream`] writes the trajectory while the run goes.
//! A [`Batch`] has the statistics of the summaries of many runs, and a [`page`] shows a run, also one of another system.
//! [`plot_values`] draws numbers of a recording over time.
//!
//! The same data give the same bytes. Only [`Summary::wall_time_s`] differs between two runs of the same configuration and
//! seed.

mod batch;
mod error;
pub mod page;
mod plot;
mod plotted_values;
mod report;
mod rocs_log;
mod scene;
mod statistics;
mod summary;
mod trajectory;

pub use batch::{Batch, Collisions, RobotStatistics, Spread};
pub use error::Error;
pub use plotted_values::plot_values;
pub use report::Report;
pub use rocs_log::RocsLog;
pub use scene::{Bounds, Circle, Cone, Goal, Polygon, Robot, Scene};
pub use summary::{Outcome, Summary};
pub use trajectory::{
    Route, RouteTally, RouteUse, Sample, ThinnedTrajectory, Trajectory, TrajectoryPosition, TrajectoryStream,
};

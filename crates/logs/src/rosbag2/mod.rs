//! Recordings of ROS 2.

mod read;
mod write;

pub(super) use read::{DESCRIPTION, files};
pub use write::{RosExport, RosLog, export_ros};

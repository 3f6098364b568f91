//! Inputs of pose estimators by laser and odometry: checks, faults, beam ends.

mod beams;
mod fault;
mod odometry_check;
mod scan_check;

pub use beams::{BeamSelection, ends_of_beams, laser_mount};
pub use fault::{FaultyInput, InputFault};
pub use odometry_check::{OdometryCheck, VelocityLimits};
pub use scan_check::ScanCheck;

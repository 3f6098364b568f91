//! Inputs of blocks that estimate a pose by laser and odometry: checks, faults, ends of beams.

mod beams;
mod fault;
mod odometry_check;
mod scan_check;

pub use beams::{BeamSelection, ends_of_beams, laser_mount};
pub use fault::{FaultyInput, InputFault};
pub use odometry_check::{OdometryCheck, VelocityLimits};
pub use scan_check::ScanCheck;

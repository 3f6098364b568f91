//! Local planners drive a robot among columns.

mod common;
mod dwa;
mod field;
mod mppi;
mod recovery;
mod vfh_plus;

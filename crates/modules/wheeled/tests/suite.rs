//! All tests of the crate that share a process, in one program: each program costs link time.

mod avoid_obstacle;
mod erring_sensors;
mod estimates;
mod frozen_sensors;
mod frozen_sonars;
mod knowledge;
mod laser_ring;
mod others;
mod plans;
mod reflexes;
mod strategies;
mod velocity_control;

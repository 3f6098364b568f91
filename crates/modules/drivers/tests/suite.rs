//! All tests of the crate that share a process, in one program: each program costs link time.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a device on a line lives by the wall clock"
)]

mod common;
mod faults;
mod gps;
mod hokuyo;
mod imu;
mod joystick;
mod line;
mod rplidar;

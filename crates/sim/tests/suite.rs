//! All tests of the crate that share a process, in one program: each program costs link time.

mod bumpers;
mod camera;
mod contact_cause;
mod descriptions;
mod doors;
mod faults;
mod imu;
mod kernel;
mod maps;
mod neighbors;
mod omni;
mod people;
mod scenarios;
mod sensors;
mod sightings;
mod skid_steer;
mod threads;
mod turns;
mod ways;

//! Simulated Pioneer on a pseudo-terminal, to test its driver without a robot.
//!
//! The [`Controller`] answers at a pseudo-terminal as a robot's does at its serial line, and drives a robot of
//! slate-sim in real time. The [`firmware`] is a state machine of its own, without a device and without a clock.

mod body;
mod controller;
mod error;
pub mod firmware;

pub use body::SimulatedPioneer;
pub use controller::{Controller, ControllerOptions};
pub use error::ControllerError;
pub use firmware::Firmware;
pub use slate_device_line::simulated::Faults;

//! Vehicle and its functions, which a manager turns on, off and tunes.

pub mod autopilot;
pub mod follow_pipeline;
pub mod mission;
pub mod recover_thrusters;
pub mod spiral_search;
pub mod thrusters;

use slate_plugin::prelude::*;

use crate::interfaces::{Navigation, Setpoint};

/// Longest time between two ticks of a function that stays active, seconds.
const PAUSE: f64 = 0.15;

/// Returns true if a manager has activated the function since its last tick.
fn is_activated(now: &Tick) -> bool {
    now.number() == 1 || now.elapsed() > PAUSE
}

/// Returns true if the vehicle is near a setpoint.
/// The tolerance is along each horizontal axis, meters.
fn is_near(navigation: &Navigation, setpoint: &Setpoint, tolerance: f64) -> bool {
    (navigation.x - setpoint.x).abs() <= tolerance && (navigation.y - setpoint.y).abs() <= tolerance
}

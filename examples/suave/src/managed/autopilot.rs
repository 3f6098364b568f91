//! Position control of the vehicle.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use crate::interfaces::{Navigation, Setpoint, ThrusterForces};
use crate::vehicle::{INERTIA, MASS, forces};

/// Ports of the autopilot.
#[ports]
pub struct AutopilotIo {
    #[stale(after = "200ms")]
    navigation: Input<Navigation>,
    /// Setpoints of the functions; the newest holds.
    setpoints: Inbox<Setpoint>,
    /// Forces of the thrusters.
    thrust: Command<ThrusterForces>,
}

/// Gains and limits.
#[params]
pub struct AutopilotParams {
    #[param(default = 0.45, range = 0.01..=10.0, unit = "1/s", doc = "velocity for a position error")]
    position_gain: f64,
    #[param(default = 0.5, range = 0.01..=5.0, unit = "m/s", doc = "greatest horizontal velocity")]
    max_horizontal_velocity: f64,
    #[param(default = 0.3, range = 0.01..=5.0, unit = "m/s", doc = "greatest vertical velocity")]
    max_vertical_velocity: f64,
    #[param(default = 2.0, range = 0.01..=50.0, unit = "1/s", doc = "acceleration for a velocity error")]
    velocity_gain: f64,
    #[param(default = 0.5, range = 0.0..=50.0, unit = "1/s^2", doc = "acceleration for the integral of the velocity error")]
    integral_gain: f64,
    #[param(default = 40.0, range = 0.01..=500.0, unit = "1/s^2", doc = "angular acceleration for a heading error")]
    heading_gain: f64,
    #[param(default = 10.0, range = 0.01..=50.0, unit = "1/s", doc = "angular acceleration for a turn rate")]
    heading_damping: f64,
    #[param(default = 12.0, range = 0.0..=3600.0, unit = "s", doc = "time until it follows setpoints, as the published vehicle takes a while to get moving")]
    start_time: f64,
}

/// State of the control.
#[derive(Default, Serialize, Deserialize)]
pub struct AutopilotState {
    /// Start position: east, north, altitude, meters.
    start: Option<[f64; 3]>,
    /// Newest setpoint: east, north, altitude, meters.
    setpoint: Option<[f64; 3]>,
    /// Integral of the velocity error, meters.
    integral: [f64; 3],
}

/// Greatest acceleration of the integral part, m/s².
const MAX_INTEGRAL_ACCELERATION: f64 = 1.0;

/// Holds a position with heading east, by six thrusters assumed healthy.
pub struct Autopilot;

#[module(stage = Act)]
impl Module for Autopilot {
    type Io = AutopilotIo;
    type Params = AutopilotParams;
    type State = AutopilotState;

    fn tick(state: &mut AutopilotState, io: &AutopilotIo, params: &AutopilotParams, now: &Tick) -> Outcome {
        let Some(navigation) = io.navigation.fresh() else { return Outcome::Degraded };
        let position = [navigation.x, navigation.y, navigation.altitude];
        if let Some(newest) = io.setpoints.iter().last() {
            state.setpoint = Some([newest.x, newest.y, newest.altitude]);
        }
        let start = *state.start.get_or_insert(position);
        let setpoint =
            if now.seconds() < params.start_time { start } else { state.setpoint.unwrap_or(start) };
        let velocity = [navigation.velocity_x, navigation.velocity_y, navigation.velocity_z];
        let wanted = wanted_velocity(position, setpoint, params);
        let limit = MAX_INTEGRAL_ACCELERATION / math::max(params.integral_gain, 1e-6);
        let push: [f64; 3] = std::array::from_fn(|axis| {
            let error = wanted[axis] - velocity[axis];
            let integral = math::clamp(state.integral[axis] + error * now.elapsed(), -limit, limit);
            state.integral[axis] = integral;
            MASS * (params.velocity_gain * error + params.integral_gain * integral)
        });
        let (sine, cosine) = (math::sin(navigation.heading), math::cos(navigation.heading));
        let turn = -params.heading_gain * navigation.heading - params.heading_damping * navigation.turn_rate;
        let wrench =
            [cosine * push[0] + sine * push[1], cosine * push[1] - sine * push[0], push[2], INERTIA * turn];
        io.thrust.send(ThrusterForces::new(forces(wrench)), Priority::Plan);
        Outcome::Ok
    }
}

/// Returns the velocity towards the setpoint.
/// It is proportional to the distance and limited, m/s.
fn wanted_velocity(position: [f64; 3], setpoint: [f64; 3], params: &AutopilotParams) -> [f64; 3] {
    let mut wanted: [f64; 3] =
        std::array::from_fn(|axis| params.position_gain * (setpoint[axis] - position[axis]));
    let speed = math::hypot(wanted[0], wanted[1]);
    if speed > params.max_horizontal_velocity {
        wanted[0] *= params.max_horizontal_velocity / speed;
        wanted[1] *= params.max_horizontal_velocity / speed;
    }
    let limit = params.max_vertical_velocity;
    wanted[2] = math::clamp(wanted[2], -limit, limit);
    wanted
}

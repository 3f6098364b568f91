//! Motion of the vehicle: a BlueROV2 as in the exemplar's simulation.
//!
//! Mass, quadratic drag and placement of the thrusters are those of the model that the exemplar's simulation loads
//! (Rezenders/bluerov2_ignition, `models/bluerov2/model.sdf`).

use serde::{Deserialize, Serialize};
use slate_plugin::module::math;

/// Mass, kg.
pub const MASS: f64 = 10.0;
/// Moment of inertia about the vertical axis, kg m².
pub const INERTIA: f64 = 0.269;
/// Quadratic drag forward, to the left and up, N s²/m².
const DRAG: [f64; 3] = [33.732, 54.16, 73.225];
/// Quadratic drag of a turn, N m s².
const TURN_DRAG: f64 = 3.992;
/// Sine and cosine of the angle of the horizontal thrusters.
const SKEW: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Mounts of thrusters 1 to 4, meters, and the side to which each pushes.
/// Forward and to the left.
const HORIZONTAL: [([f64; 2], f64); 4] =
    [([0.14, -0.092], 1.0), ([0.14, 0.092], -1.0), ([-0.15, -0.092], -1.0), ([-0.15, 0.092], 1.0)];
/// Lowest altitude of its frame, meters.
const GROUND: f64 = 0.2;

/// Wrench on the body.
/// Force forward, to the left and up (N), and torque counter-clockwise (N m).
pub type Wrench = [f64; 4];

/// Returns the wrench of the forces of thrusters 1 to 6, newtons.
pub fn wrench(forces: [f64; 6]) -> Wrench {
    let mut sum = [0.0, 0.0, forces[4] + forces[5], 0.0];
    for (([x, y], side), force) in HORIZONTAL.into_iter().zip(forces) {
        let (forward, left) = (SKEW * force, SKEW * side * force);
        sum[0] += forward;
        sum[1] += left;
        sum[3] += x * left - y * forward;
    }
    sum
}

/// Returns the forces of six healthy thrusters for a wrench, newtons.
/// They are those of the autopilot's mixer, which does not know the failed ones.
pub fn forces(wrench: Wrench) -> [f64; 6] {
    // The mean lever of the four, meters.
    const LEVER: f64 = (0.14 + 0.15 + 2.0 * 0.092) / 2.0 * SKEW;
    let [forward, left, up, torque] = wrench;
    let (forward, left, torque) = (forward / (4.0 * SKEW), left / (4.0 * SKEW), torque / (4.0 * LEVER));
    [
        forward + left + torque,
        forward - left - torque,
        forward - left + torque,
        forward + left - torque,
        up / 2.0,
        up / 2.0,
    ]
}

/// Pose and velocity of the vehicle in the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vehicle {
    /// Position to the east and north, and altitude above the seabed, meters.
    pub position: [f64; 3],
    /// Counter-clockwise from the east, radians.
    pub heading: f64,
    /// Velocity over ground, m/s.
    pub velocity: [f64; 3],
    /// Counter-clockwise, rad/s.
    pub turn_rate: f64,
}

impl Vehicle {
    /// Simulates `step` seconds in a current (m/s).
    /// `thrust` has the forces of thrusters 1 to 6 (N).
    pub fn advance(&mut self, thrust: [f64; 6], current: [f64; 2], step: f64) {
        let (sine, cosine) = (math::sin(self.heading), math::cos(self.heading));
        let water = [self.velocity[0] - current[0], self.velocity[1] - current[1]];
        let body =
            [cosine * water[0] + sine * water[1], cosine * water[1] - sine * water[0], self.velocity[2]];
        let push = wrench(thrust);
        let net = |axis: usize| push[axis] - DRAG[axis] * body[axis].abs() * body[axis];
        let (forward, left) = (net(0) / MASS, net(1) / MASS);
        let acceleration = [cosine * forward - sine * left, sine * forward + cosine * left, net(2) / MASS];
        for (axis, acceleration) in acceleration.into_iter().enumerate() {
            self.velocity[axis] += acceleration * step;
            self.position[axis] += self.velocity[axis] * step;
        }
        if self.position[2] < GROUND {
            self.position[2] = GROUND;
            self.velocity[2] = math::max(self.velocity[2], 0.0);
        }
        let torque = push[3] - TURN_DRAG * self.turn_rate.abs() * self.turn_rate;
        self.turn_rate += torque / INERTIA * step;
        self.heading = math::wrap_angle(self.heading + self.turn_rate * step);
    }
}

use serde::{Deserialize, Serialize};
use slate_module::Random;

use super::odometer::Odometer;
use super::{Wheels, follow, held};
use crate::robot::{DriveDescription, NoiseDescription};

/// Two driven wheels on one axle that roll without slipping.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Differential {
    description: DriveDescription,
    command: Wheels,
    speed: Wheels,
    pub(super) odometer: Odometer,
}

impl Differential {
    /// Creates a standing drive with the biases of this run.
    pub fn new(description: DriveDescription, noise: &NoiseDescription, random: Random) -> Self {
        Self {
            odometer: Odometer::new(description.wheel_radius, description.track, noise, random),
            description,
            command: Wheels::default(),
            speed: Wheels::default(),
        }
    }

    pub(super) fn command(&mut self, wheels: Wheels) {
        let limit = self.description.maximum_wheel_speed;
        self.command = Wheels { left: held(wheels.left, limit), right: held(wheels.right, limit) };
    }

    /// Advances the wheels by `step` seconds.
    /// Returns the forward speed, m/s, and the turn rate, rad/s.
    pub fn advance(&mut self, step: f64) -> (f64, f64) {
        let change = self.description.maximum_wheel_acceleration * step;
        self.speed = Wheels {
            left: follow(self.speed.left, self.command.left, change),
            right: follow(self.speed.right, self.command.right, change),
        };
        let DriveDescription { wheel_radius, track, .. } = self.description;
        let Wheels { left, right } = self.speed;
        self.odometer.measure(left, right, step);
        ((left + right) / 2.0 * wheel_radius, (right - left) / track * wheel_radius)
    }
}

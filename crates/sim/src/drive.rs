//! Differential drive: wheels that follow their commands, and what the encoders say of them.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{clamp, cos, sin, wrap_angle};

use crate::geometry::Pose;
use crate::robot::{DriveDescription, NoiseDescription};

/// Speeds of the wheels, radians per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// Left side.
    pub left: f64,
    /// Right side.
    pub right: f64,
}

/// The drive of a robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Drive {
    description: DriveDescription,
    command: Wheels,
    speed: Wheels,
    /// Factors on the wheels' radii and on the track as odometry believes them.
    believed: (f64, f64, f64),
    white: f64,
    random: Random,
    /// Where odometry believes to be, from the start.
    odometry: Pose,
    /// Forward speed and turn, as odometry believes them.
    measured: (f64, f64),
}

impl Drive {
    /// A standing drive with the biases of this run.
    pub fn new(description: DriveDescription, noise: &NoiseDescription, mut random: Random) -> Self {
        let mut factor = |deviation: f64| 1.0 + deviation * random.normal();
        let believed =
            (factor(noise.wheel_radius_bias), factor(noise.wheel_radius_bias), factor(noise.track_bias));
        Self {
            description,
            command: Wheels::default(),
            speed: Wheels::default(),
            believed,
            white: noise.wheel_speed,
            random,
            odometry: Pose::default(),
            measured: (0.0, 0.0),
        }
    }

    /// What the wheels are told; held within their limits, and 0 for what is not a number.
    pub fn command(&mut self, wheels: Wheels) {
        let limit = self.description.maximum_wheel_speed;
        let held = |speed: f64| if speed.is_finite() { clamp(speed, -limit, limit) } else { 0.0 };
        self.command = Wheels { left: held(wheels.left), right: held(wheels.right) };
    }

    /// Lets the wheels follow for `step` seconds; returns the speed forward (m/s) and the turn (rad/s).
    pub fn advance(&mut self, step: f64) -> (f64, f64) {
        let change = self.description.maximum_wheel_acceleration * step;
        let follow = |speed: f64, command: f64| speed + clamp(command - speed, -change, change);
        self.speed = Wheels {
            left: follow(self.speed.left, self.command.left),
            right: follow(self.speed.right, self.command.right),
        };
        let DriveDescription { wheel_radius, track, .. } = self.description;
        self.measure(step);
        let Wheels { left, right } = self.speed;
        ((left + right) / 2.0 * wheel_radius, (right - left) / track * wheel_radius)
    }

    fn measure(&mut self, step: f64) {
        let DriveDescription { wheel_radius, track, .. } = self.description;
        let mut noisy = |speed: f64, radius: f64| {
            speed * wheel_radius * radius * (1.0 + self.white * self.random.normal())
        };
        let left = noisy(self.speed.left, self.believed.0);
        let right = noisy(self.speed.right, self.believed.1);
        let (linear, angular) = ((left + right) / 2.0, (right - left) / (track * self.believed.2));
        self.measured = (linear, angular);
        let middle = self.odometry.theta + angular * step / 2.0;
        self.odometry.x += linear * step * cos(middle);
        self.odometry.y += linear * step * sin(middle);
        self.odometry.theta = wrap_angle(self.odometry.theta + angular * step);
    }

    /// Where the encoders say the robot is, and how it moves (m/s, rad/s).
    pub fn odometry(&self) -> (Pose, (f64, f64)) {
        (self.odometry, self.measured)
    }

    /// The speeds of the wheels.
    pub fn speed(&self) -> Wheels {
        self.speed
    }
}

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{cos, sin, wrap_angle};

use crate::geometry::Pose;
use crate::robot::{NoiseDescription, OdometryDescription};

/// Returns the scale factors of an odometry without systematic errors of its own.
fn exact() -> (f64, f64) {
    (1.0, 1.0)
}

/// Dead reckoning from the encoders of both sides.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Odometer {
    wheel_radius: f64,
    /// Assumed track width, m.
    track: f64,
    /// Factors on both wheels' radii and on the track, as assumed by odometry.
    believed: (f64, f64, f64),
    white: f64,
    /// Scale factors of distance and rotation from the odometry's profile.
    #[serde(default = "exact")]
    scale: (f64, f64),
    random: Random,
    /// Pose estimate of the odometry, from the start.
    pub pose: Pose,
    /// Forward speed and turn rate by odometry, m/s and rad/s.
    pub measured: (f64, f64),
}

impl Odometer {
    /// Creates the odometer with the biases of this run.
    pub fn new(wheel_radius: f64, track: f64, noise: &NoiseDescription, mut random: Random) -> Self {
        let mut factor = |deviation: f64| 1.0 + deviation * random.normal();
        let believed =
            (factor(noise.wheel_radius_bias), factor(noise.wheel_radius_bias), factor(noise.track_bias));
        Self {
            wheel_radius,
            track,
            believed,
            white: noise.wheel_speed,
            scale: exact(),
            random,
            pose: Pose::default(),
            measured: (0.0, 0.0),
        }
    }

    /// Adds systematic errors of this run, drawn from a stream of their own.
    pub fn set_bias(&mut self, bias: &OdometryDescription, mut random: Random) {
        let mut factor = |deviation: f64| 1.0 + deviation * random.normal();
        self.scale = (factor(bias.distance_bias), factor(bias.turn_bias));
    }

    /// Integrates the wheel speeds of both sides, rad/s, over `step` seconds.
    pub fn measure(&mut self, left: f64, right: f64, step: f64) {
        let mut noisy = |speed: f64, radius: f64| {
            speed * self.wheel_radius * radius * (1.0 + self.white * self.random.normal())
        };
        let left = noisy(left, self.believed.0);
        let right = noisy(right, self.believed.1);
        let (distance, turn) = self.scale;
        let linear = distance * (left + right) / 2.0;
        let angular = turn * (right - left) / (self.track * self.believed.2);
        self.measured = (linear, angular);
        let middle = self.pose.theta + angular * step / 2.0;
        self.pose.x += linear * step * cos(middle);
        self.pose.y += linear * step * sin(middle);
        self.pose.theta = wrap_angle(self.pose.theta + angular * step);
    }
}

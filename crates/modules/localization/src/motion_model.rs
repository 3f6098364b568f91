//! Odometry motion model.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Particle, Pose2};
use slate_module::{Random, math};

/// Odometry noise of a differential drive.
/// Thrun, Burgard and Fox, *Probabilistic Robotics*, table 5.6. Dimensionless but for 1/m and m where rotation and
/// translation make noise of the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryAlphas {
    /// Variance of rotation from rotation, `alpha1`.
    pub alpha1: f64,
    /// Variance of rotation from translation, `alpha2`.
    pub alpha2: f64,
    /// Variance of translation from translation, `alpha3`.
    pub alpha3: f64,
    /// Variance of translation from rotation, `alpha4`.
    pub alpha4: f64,
}

impl Default for OdometryAlphas {
    fn default() -> Self {
        Self { alpha1: 0.2, alpha2: 0.2, alpha3: 0.2, alpha4: 0.2 }
    }
}

/// Odometry increment: rotation, translation, rotation.
/// With their standard deviations.
pub(crate) struct OdometryIncrement {
    rotation: [f64; 2],
    translation: f64,
    rotation_stddev: [f64; 2],
    translation_stddev: f64,
}

/// Translation below which its direction is noise, m.
const STILL: f64 = 0.01;

impl OdometryIncrement {
    /// Returns the increment between two poses in the odometry's frame.
    pub fn between(from: Pose2, to: Pose2, alphas: &OdometryAlphas) -> Self {
        let (right, up) = (to.x - from.x, to.y - from.y);
        let translation = math::hypot(right, up);
        let first =
            if translation < STILL { 0.0 } else { math::angle_between(from.theta, math::atan2(up, right)) };
        let second = math::angle_between(first, math::angle_between(from.theta, to.theta));
        // Driving backwards is no half turn.
        let turned = |angle: f64| {
            let half = math::angle_between(std::f64::consts::PI, angle).abs();
            if half < angle.abs() { half } else { angle.abs() }
        };
        let square = translation * translation;
        let rotation_stddev = [first, second]
            .map(|angle| (alphas.alpha1 * turned(angle) * turned(angle) + alphas.alpha2 * square).sqrt());
        let turns = turned(first) * turned(first) + turned(second) * turned(second);
        let translation_stddev = (alphas.alpha3 * square + alphas.alpha4 * turns).sqrt();
        Self { rotation: [first, second], translation, rotation_stddev, translation_stddev }
    }

    /// Moves a particle by the increment, with noise of its own.
    pub fn apply(&self, particle: &mut Particle, random: &mut Random) {
        let mut noisy = |mean: f64, stddev: f64| mean + stddev * random.normal();
        let first = noisy(self.rotation[0], self.rotation_stddev[0]);
        let translation = noisy(self.translation, self.translation_stddev);
        let second = noisy(self.rotation[1], self.rotation_stddev[1]);
        let direction = particle.pose.theta + first;
        particle.pose.x += translation * math::cos(direction);
        particle.pose.y += translation * math::sin(direction);
        particle.pose.theta = math::wrap_angle(direction + second);
    }
}

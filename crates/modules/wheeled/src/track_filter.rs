//! Kalman filter of the position and velocity of another robot.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Point2;

/// Standard deviation of the velocity of a new track, m/s.
const NEW_VELOCITY: f64 = 0.5;

/// Kalman filter of a track: constant velocity, white acceleration.
/// Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 6.2.2; its errors are the
/// same in x and in y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackFilter {
    position: [f64; 2],
    velocity: [f64; 2],
    /// Variance of position, covariance with velocity, variance of velocity.
    covariance: [f64; 3],
    /// Time of the belief, seconds.
    time: f64,
}

impl TrackFilter {
    /// Returns a track from a detection at a time (s), with its standard deviation (m).
    pub fn new(seen: Point2, stddev: f64, time: f64) -> Self {
        let covariance = [stddev * stddev, 0.0, NEW_VELOCITY * NEW_VELOCITY];
        Self { position: [seen.x, seen.y], velocity: [0.0; 2], covariance, time }
    }

    /// Predicts to a time (s).
    /// `acceleration` is the standard deviation of the robot's acceleration, m/s².
    pub fn predict(&mut self, time: f64, acceleration: f64) {
        let elapsed = time - self.time;
        if elapsed.is_nan() || elapsed <= 0.0 {
            return;
        }
        for (position, velocity) in self.position.iter_mut().zip(self.velocity) {
            *position += elapsed * velocity;
        }
        let [position, mixed, velocity] = self.covariance;
        let noise = acceleration * acceleration * elapsed * elapsed;
        self.covariance = [
            position + elapsed * (2.0 * mixed + elapsed * velocity) + noise * elapsed * elapsed / 4.0,
            mixed + elapsed * velocity + noise * elapsed / 2.0,
            velocity + noise,
        ];
        self.time = time;
    }

    /// Updates by a detection with its standard deviation (m).
    /// The detection is at the time of the belief. Returns false, without an update, if it is more than `gate` standard
    /// deviations of the innovation away.
    pub fn update(&mut self, seen: Point2, stddev: f64, gate: f64) -> bool {
        let [position, mixed, velocity] = self.covariance;
        let variance = position + stddev * stddev;
        let innovation = [seen.x - self.position[0], seen.y - self.position[1]];
        let squared = innovation[0] * innovation[0] + innovation[1] * innovation[1];
        // NaN does not fit either.
        let fits = squared <= gate * gate * variance;
        if !fits || variance <= 0.0 {
            return false;
        }
        let [gain, of_velocity] = [position / variance, mixed / variance];
        for (axis, innovation) in innovation.into_iter().enumerate() {
            self.position[axis] += gain * innovation;
            self.velocity[axis] += of_velocity * innovation;
        }
        self.covariance = [position - gain * position, mixed - gain * mixed, velocity - of_velocity * mixed];
        true
    }

    /// Returns the position in the map frame, meters.
    pub fn position(&self) -> Point2 {
        Point2 { x: self.position[0], y: self.position[1] }
    }

    /// Returns the velocity in the map frame, m/s.
    pub fn velocity(&self) -> [f64; 2] {
        self.velocity
    }
}

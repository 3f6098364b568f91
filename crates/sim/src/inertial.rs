//! Inertial measurement unit (IMU).
//! It measures angular velocity, acceleration and a drifting heading.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::wrap_angle;

use crate::contact::Motion;
use crate::fault::{Display, Measurement};
use crate::geometry::{Point, Pose};
use crate::rate::due;
use crate::robot::ImuDescription;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;
/// Standard deviation of the vertical acceleration by shaking, m/s².
/// It is that on the roughest ground at 1 m/s.
const SHAKING: f64 = 4.0;

/// Measurement of an inertial measurement unit, in its own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InertialReading {
    /// Heading of its x axis in the world, rad.
    pub heading: f64,
    /// Variance of the heading, rad².
    pub heading_variance: f64,
    /// Angular velocity about x, y and z, rad/s.
    pub angular_velocity: [f64; 3],
    /// Specific force along x, y and z, including gravity, m/s².
    pub acceleration: [f64; 3],
}

impl Measurement for Option<InertialReading> {
    fn is_none(&self) -> bool {
        Self::is_none(self)
    }

    fn spoil(&mut self) {
        let (heading, all) = (f64::NAN, [f64::NAN; 3]);
        let reading =
            InertialReading { heading, heading_variance: 0.0, angular_velocity: all, acceleration: all };
        *self = Some(reading);
    }
}

/// Inertial measurement unit with its errors.
///
/// An acceleration is the mean one since the last measurement. The heading is exact at the start and then the integral of the
/// measured angular velocity, as of a device without a compass.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct InertialSensor {
    description: ImuDescription,
    random: Random,
    /// Biases of angular velocity and acceleration, constant in a run.
    biases: [[f64; 3]; 2],
    /// Error of the heading, rad, and its variance, rad².
    drift: (f64, f64),
    /// Times of the first and the last measurement, ns.
    times: Option<(u64, u64)>,
    /// Velocity of the device at the last measurement, in the world, m/s.
    velocity: Point,
    /// Faults between it and its readers.
    pub display: Display<Option<InertialReading>>,
}

impl InertialSensor {
    /// Creates the sensor of a robot; `random` is the stream of its noise.
    pub fn new(description: ImuDescription, mut random: Random) -> Self {
        let ImuDescription { bias_angular_velocity, bias_acceleration, .. } = description;
        let biases = [bias_angular_velocity, bias_acceleration]
            .map(|deviation| std::array::from_fn(|_| deviation * random.normal()));
        Self {
            description,
            random,
            biases,
            drift: (0.0, 0.0),
            times: None,
            velocity: Point::default(),
            display: Display::default(),
        }
    }

    /// Returns mount and errors.
    pub fn description(&self) -> &ImuDescription {
        &self.description
    }

    /// Measures if a measurement is due at `now`, ns.
    /// `pose` and `body` are the pose and the motion of the robot, and `shaking` how much the ground shakes it.
    pub fn measure(&mut self, pose: Pose, body: Motion, shaking: f64, now: u64) -> Option<InertialReading> {
        let [x, y, degrees] = self.description.mount;
        let last = self.times.map(|(_, last)| last);
        if self.description.rate.is_some_and(|rate| !due(rate, 0.0, last, now)) {
            return None;
        }
        let frame = Pose { theta: pose.theta + degrees.to_radians(), ..pose }.frame();
        let velocity = body.at(pose.frame().apply(Point::new(x, y)));
        let seconds = last.map_or(0.0, |last| (now - last) as f64 * 1e-9);
        let change = frame.turn_back(velocity.minus(self.velocity));
        // Before the first measurement there was no velocity.
        let per_second = if seconds > 0.0 { 1.0 / seconds } else { 0.0 };
        // Even ground draws nothing from the stream.
        let up = GRAVITY + if shaking > 0.0 { SHAKING * shaking * self.random.normal() } else { 0.0 };
        let truth = [[0.0, 0.0, body.angular], [change.x * per_second, change.y * per_second, up]];
        let [angular_velocity, acceleration] = self.with_errors(truth);
        self.velocity = velocity;
        let first = self.times.map_or(now, |(first, _)| first);
        self.times = Some((first, now));
        self.integrate(angular_velocity[2] - body.angular, seconds, (now - first) as f64 * 1e-9);
        Some(InertialReading {
            heading: wrap_angle(pose.theta + degrees.to_radians() + self.drift.0),
            heading_variance: self.drift.1,
            angular_velocity,
            acceleration,
        })
    }

    /// Adds noise and bias to angular velocity and acceleration.
    fn with_errors(&mut self, truth: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        if self.description.is_exact() {
            return truth;
        }
        let noise = [self.description.noise_angular_velocity, self.description.noise_acceleration];
        std::array::from_fn(|kind| {
            std::array::from_fn(|axis| {
                truth[kind][axis] + self.biases[kind][axis] + noise[kind] * self.random.normal()
            })
        })
    }

    /// Integrates the error of the angular velocity into the heading.
    /// `elapsed` is the time since the start, s.
    fn integrate(&mut self, error: f64, seconds: f64, elapsed: f64) {
        let ImuDescription { noise_angular_velocity, bias_angular_velocity, .. } = self.description;
        let (by_bias, by_noise) = (bias_angular_velocity * elapsed, noise_angular_velocity * seconds);
        self.drift.0 += error * seconds;
        // A random walk of as many steps as there were measurements.
        let steps = if seconds > 0.0 { elapsed / seconds } else { 0.0 };
        self.drift.1 = by_bias * by_bias + by_noise * by_noise * steps;
    }
}

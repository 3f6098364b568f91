//! Parameters of the filter.

use serde::{Deserialize, Serialize};

use super::belief::{ProcessNoise, StateVariable, StateVector};
use crate::InvalidParameter;

/// Parameters of [`PlanarFilter`](super::PlanarFilter).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanarFilterParameters {
    /// Process noise: diagonal of `process_noise_covariance`.
    /// Variance that x, y (m²), heading (rad²), velocities forward and left (m²/s²), and angular velocity (rad²/s²)
    /// gain in a second.
    pub process_noise: [f64; 6],
    /// Variance that the bias of the gyroscope gains in a second, rad²/s².
    pub gyroscope_bias_noise: f64,
    /// Standard deviation of the initial twist.
    /// Velocities forward and left, m/s, and angular velocity, rad/s.
    pub initial_twist_stddev: [f64; 3],
    /// Standard deviation of the initial bias of the gyroscope, rad/s.
    pub initial_gyroscope_bias_stddev: f64,
    /// Standard deviation of the initial odometry scales: linear and angular.
    /// They are of its velocity and angular velocity; 0 for known ones of 1.
    pub initial_odometry_scale_stddev: [f64; 2],
    /// Standard deviation of the initial scale of landmarks' ranges.
    /// 0 for a known one of 1.
    pub initial_landmark_scale_stddev: f64,
    /// Process noise growing with the twist, `dynamic_process_noise_covariance`.
    /// If true, that of the pose is for a twist of norm 1, and grows with it.
    pub dynamic_process_noise: bool,
    /// Age up to which a late measurement is taken in, `history_length`, s.
    pub history_length: f64,
    /// Number of linearizations of a landmark's measurement.
    /// 1 is the plain extended Kalman filter.
    pub iterations: u32,
}

impl Default for PlanarFilterParameters {
    fn default() -> Self {
        Self {
            process_noise: [0.0001, 0.0001, 0.0001, 1.0, 0.001, 1.0],
            gyroscope_bias_noise: 1e-8,
            initial_twist_stddev: [0.1, 0.01, 0.1],
            initial_gyroscope_bias_stddev: 0.01,
            initial_odometry_scale_stddev: [0.0; 2],
            initial_landmark_scale_stddev: 0.0,
            dynamic_process_noise: false,
            history_length: 0.0,
            iterations: 3,
        }
    }
}

impl PlanarFilterParameters {
    pub(super) fn check(&self) -> Result<(), InvalidParameter> {
        let magnitudes = [
            ("process_noise_covariance", &self.process_noise[..]),
            ("gyroscope_bias_noise", &[self.gyroscope_bias_noise]),
            ("initial_twist_stddev", &self.initial_twist_stddev),
            ("initial_gyroscope_bias_stddev", &[self.initial_gyroscope_bias_stddev]),
            ("initial_odometry_scale_stddev", &self.initial_odometry_scale_stddev),
            ("initial_landmark_scale_stddev", &[self.initial_landmark_scale_stddev]),
            ("history_length", &[self.history_length]),
        ];
        for (name, values) in magnitudes {
            let is_magnitude = |value: &f64| value.is_finite() && *value >= 0.0;
            InvalidParameter::unless(values.iter().all(is_magnitude), name, "numbers from 0")?;
        }
        InvalidParameter::unless((1..=20).contains(&self.iterations), "iterations", "1 to 20")
    }

    pub(super) fn process_noise(&self) -> ProcessNoise {
        let mut variances = StateVector::zeros();
        variances.as_mut_slice()[..6].copy_from_slice(&self.process_noise);
        variances[StateVariable::GyroscopeBias as usize] = self.gyroscope_bias_noise;
        ProcessNoise { variances, is_dynamic: self.dynamic_process_noise }
    }

    /// Returns the mean and standard deviations of twist and calibration at the start.
    pub(super) fn initial(&self) -> (StateVector, StateVector) {
        let (mut mean, mut stddev) = (StateVector::zeros(), StateVector::zeros());
        stddev.as_mut_slice()[3..6].copy_from_slice(&self.initial_twist_stddev);
        stddev[StateVariable::GyroscopeBias as usize] = self.initial_gyroscope_bias_stddev;
        let [linear, angular] = self.initial_odometry_scale_stddev;
        for (scale, deviation) in [
            (StateVariable::OdometryLinearScale, linear),
            (StateVariable::OdometryAngularScale, angular),
            (StateVariable::LandmarkRangeScale, self.initial_landmark_scale_stddev),
        ] {
            (mean[scale as usize], stddev[scale as usize]) = (1.0, deviation);
        }
        (mean, stddev)
    }
}

use serde::{Deserialize, Serialize};

use super::{is_deviation, is_rate};

/// Inertial measurement unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuDescription {
    /// Mount on the robot: x and y in m, direction of its x axis in degrees.
    pub mount: [f64; 3],
    /// Standard deviation of an angular velocity about each axis, rad/s.
    pub noise_angular_velocity: f64,
    /// Standard deviation of an acceleration along each axis, m/s².
    pub noise_acceleration: f64,
    /// Standard deviation of the constant bias of the angular velocity, rad/s.
    /// The bias stays for a run.
    pub bias_angular_velocity: f64,
    /// Standard deviation of the constant bias of the acceleration, m/s².
    /// The bias stays for a run.
    pub bias_acceleration: f64,
    /// Rate, Hz; each sweep by default.
    #[serde(default)]
    pub rate: Option<f64>,
}

impl ImuDescription {
    /// Returns whether it measures without errors.
    pub fn is_exact(&self) -> bool {
        let Self {
            noise_angular_velocity, noise_acceleration, bias_angular_velocity, bias_acceleration, ..
        } = *self;
        [noise_angular_velocity, noise_acceleration, bias_angular_velocity, bias_acceleration]
            .iter()
            .all(|deviation| *deviation == 0.0)
    }

    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let deviation = "expected a standard deviation, not negative";
        let checks = [
            ("mount", self.mount.iter().all(|value| value.is_finite()), "expected finite numbers"),
            ("noise_angular_velocity", is_deviation(self.noise_angular_velocity), deviation),
            ("noise_acceleration", is_deviation(self.noise_acceleration), deviation),
            ("bias_angular_velocity", is_deviation(self.bias_angular_velocity), deviation),
            ("bias_acceleration", is_deviation(self.bias_acceleration), deviation),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

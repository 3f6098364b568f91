use serde::{Deserialize, Serialize};

use super::is_deviation;

/// Systematic errors of the odometry, in addition to those of `[noise]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryDescription {
    /// Standard deviation of the distance factor, constant in a run.
    pub distance_bias: f64,
    /// Standard deviation of the rotation factor, constant in a run.
    pub turn_bias: f64,
}

impl OdometryDescription {
    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let checks = [("distance_bias", self.distance_bias), ("turn_bias", self.turn_bias)];
        let wrong = checks.into_iter().find(|(_, value)| !is_deviation(*value));
        wrong.map(|(key, _)| (key, "expected a standard deviation, not negative"))
    }
}

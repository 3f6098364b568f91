use serde::{Deserialize, Serialize};

use super::{is_deviation, is_probability, is_rate};

/// Positioning system with a compass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositioningDescription {
    /// Standard deviation of x and of y, m.
    pub noise_position: f64,
    /// Standard deviation of the heading, rad.
    pub noise_orientation: f64,
    /// Probability of a missing position, and of a missing heading.
    pub dropout: f64,
    /// Rate, Hz; each sweep by default.
    #[serde(default)]
    pub rate: Option<f64>,
}

impl PositioningDescription {
    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let deviation = "expected a standard deviation, not negative";
        let checks = [
            ("noise_position", is_deviation(self.noise_position), deviation),
            ("noise_orientation", is_deviation(self.noise_orientation), deviation),
            ("dropout", is_probability(self.dropout), "expected a probability from 0 to 1"),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

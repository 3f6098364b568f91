use serde::{Deserialize, Serialize};

use super::{is_deviation, is_probability, is_rate};

/// Ring of sonars.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SonarDescription {
    /// Minimum range, m.
    pub range_min: f64,
    /// Maximum range, m.
    pub range_max: f64,
    /// Opening angle of a cone, rad.
    pub field_of_view: f64,
    /// Maximum angle of incidence on a face that returns an echo, rad.
    pub maximum_incidence: f64,
    /// Constant standard deviation of a range, m.
    pub noise_constant: f64,
    /// Standard deviation of a range, relative to it.
    pub noise_proportional: f64,
    /// Probability of a lost echo.
    pub dropout: f64,
    /// Probability of crosstalk: another sonar's pulse precedes the own echo.
    #[serde(default)]
    pub crosstalk: f64,
    /// Rate of each sonar, Hz; they fire in turns.
    /// Without it, all fire at each sweep.
    #[serde(default)]
    pub rate: Option<f64>,
    /// Mount of each sonar on the robot: x and y in m, direction in degrees.
    pub placements: Vec<[f64; 3]>,
}

impl SonarDescription {
    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let right_angle = std::f64::consts::FRAC_PI_2;
        let checks = [
            ("range_min", is_deviation(self.range_min), "expected a distance, which is not negative"),
            (
                "range_max",
                self.range_max.is_finite() && self.range_max > self.range_min,
                "expected more than `range_min`",
            ),
            (
                "field_of_view",
                self.field_of_view > 0.0 && self.field_of_view < 2.0 * right_angle,
                "expected an angle between 0 and pi",
            ),
            (
                "maximum_incidence",
                self.maximum_incidence > 0.0 && self.maximum_incidence < right_angle,
                "expected an angle between 0 and pi / 2",
            ),
            (
                "noise_constant",
                is_deviation(self.noise_constant),
                "expected a standard deviation, not negative",
            ),
            (
                "noise_proportional",
                is_deviation(self.noise_proportional),
                "expected a standard deviation, not negative",
            ),
            ("dropout", is_probability(self.dropout), "expected a probability from 0 to 1"),
            ("crosstalk", is_probability(self.crosstalk), "expected a probability from 0 to 1"),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
            (
                "placements",
                self.placements.len() <= 16
                    && self.placements.iter().flatten().all(|value| value.is_finite()),
                "expected at most 16 placements of finite numbers",
            ),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

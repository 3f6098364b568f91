use serde::{Deserialize, Serialize};

use super::{is_deviation, is_probability, is_rate};

/// A ring of sonars.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SonarDescription {
    /// Metres.
    pub range_min: f64,
    /// Metres.
    pub range_max: f64,
    /// Full opening angle of a cone, radians.
    pub field_of_view: f64,
    /// A face is heard when its normal is within this angle of the way to it, radians.
    pub maximum_incidence: f64,
    /// Standard deviation of a range, metres.
    pub noise_constant: f64,
    /// Standard deviation of a range, relative to it.
    pub noise_proportional: f64,
    /// Probability that an echo is lost.
    pub dropout: f64,
    /// Probability that another sonar's pulse is heard before the own echo.
    #[serde(default)]
    pub crosstalk: f64,
    /// Rate of each sonar, Hz, fired in turns; without it all fire at each sweep.
    #[serde(default)]
    pub rate: Option<f64>,
    /// x and y in metres, direction in degrees.
    pub placements: Vec<[f64; 3]>,
}

impl SonarDescription {
    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn mistake(&self) -> Option<(&'static str, &'static str)> {
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

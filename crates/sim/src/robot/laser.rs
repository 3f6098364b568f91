use serde::{Deserialize, Serialize};

use super::{is_deviation, is_probability, is_rate};

/// The most beams that a laser scanner has.
const BEAMS: u32 = 1024;

/// A laser scanner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaserDescription {
    /// x and y in metres, direction of the middle of its field of view in degrees.
    pub mount: [f64; 3],
    /// Metres.
    pub range_min: f64,
    /// Metres.
    pub range_max: f64,
    /// Full opening angle, from the first beam to the last, radians.
    pub field_of_view: f64,
    /// Number of beams, evenly spaced.
    pub beams: u32,
    /// Standard deviation of a range, metres.
    pub noise_constant: f64,
    /// Standard deviation of a range, relative to it.
    pub noise_proportional: f64,
    /// Probability that a beam does not come back.
    pub dropout: f64,
    /// Rate, Hz; each sweep by default.
    #[serde(default)]
    pub rate: Option<f64>,
}

impl LaserDescription {
    /// The angle between two beams, radians.
    pub fn increment(&self) -> f64 {
        self.field_of_view / f64::from(self.beams - 1)
    }

    /// The direction of a beam from the middle of the field of view, radians, counter-clockwise from the first one on.
    pub fn angle_of(&self, beam: u32) -> f64 {
        f64::from(beam) * self.increment() - self.field_of_view / 2.0
    }

    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn mistake(&self) -> Option<(&'static str, &'static str)> {
        let deviation = "expected a standard deviation, not negative";
        let turn = 2.0 * std::f64::consts::PI;
        let checks = [
            ("mount", self.mount.iter().all(|value| value.is_finite()), "expected finite numbers"),
            ("range_min", is_deviation(self.range_min), "expected a distance, which is not negative"),
            (
                "range_max",
                self.range_max.is_finite() && self.range_max > self.range_min,
                "expected more than `range_min`",
            ),
            (
                "field_of_view",
                self.field_of_view > 0.0 && self.field_of_view < turn,
                "expected an angle above 0, less than a full turn of 6.2832",
            ),
            ("beams", (2..=BEAMS).contains(&self.beams), "expected from 2 to 1024 beams"),
            ("noise_constant", is_deviation(self.noise_constant), deviation),
            ("noise_proportional", is_deviation(self.noise_proportional), deviation),
            ("dropout", is_probability(self.dropout), "expected a probability from 0 to 1"),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

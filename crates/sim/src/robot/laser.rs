use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::max;

use super::{is_deviation, is_probability, is_rate};

/// Largest number of beams.
const BEAMS: u32 = 1024;

/// Smallest depth step of a mixed pixel, m.
/// Obstacles with a smaller step act as one.
const LEAST_EDGE: f64 = 0.1;
/// Largest depth step of a mixed pixel, m.
/// Beyond it, some times the length of a pulse, the scanner separates the echoes.
const GREATEST_EDGE: f64 = 3.0;

/// Laser scanner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaserDescription {
    /// Mount on the robot: x and y in m, direction of the middle beam in degrees.
    pub mount: [f64; 3],
    /// Minimum range, m.
    pub range_min: f64,
    /// Maximum range, m.
    pub range_max: f64,
    /// Field of view from the first beam to the last, rad.
    pub field_of_view: f64,
    /// Number of beams, evenly spaced.
    pub beams: u32,
    /// Constant standard deviation of a range, m.
    pub noise_constant: f64,
    /// Standard deviation of a range, relative to it.
    pub noise_proportional: f64,
    /// Probability of a missing return.
    pub dropout: f64,
    /// Probability of a mixed pixel for a beam that an edge splits.
    /// It measures a range between the obstacle and the background (Ye and Borenstein, 2002, *Characterization of a 2-D
    /// laser scanner for mobile robot obstacle negotiation*).
    #[serde(default)]
    pub mixed_pixels: f64,
    /// Rate, Hz; each sweep by default.
    #[serde(default)]
    pub rate: Option<f64>,
}

impl LaserDescription {
    /// Returns the angle between two beams, rad.
    pub fn increment(&self) -> f64 {
        self.field_of_view / f64::from(self.beams - 1)
    }

    /// Returns the direction of a beam from the middle of the field of view, rad.
    /// Counter-clockwise from the first beam on.
    pub fn angle_of(&self, beam: u32) -> f64 {
        f64::from(beam) * self.increment() - self.field_of_view / 2.0
    }

    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
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
            ("mixed_pixels", is_probability(self.mixed_pixels), "expected a probability from 0 to 1"),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }

    /// Measures distances along the beams, in their order, m.
    /// Infinite without an obstacle, or a return.
    pub fn measure(&self, distances: &[f64], random: &mut Random, ranges: &mut Vec<f32>) {
        let Self { range_min, range_max, noise_constant, noise_proportional, dropout, .. } = *self;
        let is_noisy = noise_constant > 0.0 || noise_proportional > 0.0 || dropout > 0.0;
        ranges.clear();
        for (beam, distance) in distances.iter().enumerate() {
            let behind = distances.get(beam + 1).copied().unwrap_or(*distance);
            let distance = self.mix(*distance, behind, random);
            let mut measured = distance;
            if is_noisy {
                // Drawn in any case, so that one beam's echo does not shift another's noise.
                let (lost, error) = (random.unit() < dropout, random.normal());
                let noisy = distance + error * (noise_constant + noise_proportional * distance);
                measured = if lost { f64::INFINITY } else { noisy };
            }
            // A distance of infinity with noise is not a number.
            let range = if measured < range_max { max(measured, range_min) } else { f64::INFINITY };
            // A scanner reports fewer digits.
            ranges.push(range as f32);
        }
    }

    /// Returns the range of a beam that two adjacent obstacles split, m.
    fn mix(&self, distance: f64, other: f64, random: &mut Random) -> f64 {
        if self.mixed_pixels <= 0.0 {
            return distance;
        }
        let (is_mixed, share) = (random.unit() < self.mixed_pixels, random.unit());
        let step = (other - distance).abs();
        let is_edge = step > LEAST_EDGE && step < GREATEST_EDGE;
        if is_mixed && is_edge { distance + share * (other - distance) } else { distance }
    }
}

use serde::{Deserialize, Serialize};

use super::{is_deviation, is_probability, is_rate};

/// Detector of other robots: names, ranges and bearings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSensorDescription {
    /// Mount on the robot: x and y in m, direction in degrees.
    pub mount: [f64; 3],
    /// Maximum range from the sensor to the other's reference point, m.
    pub range_max: f64,
    /// Field of view, rad; at most a full turn.
    pub field_of_view: f64,
    /// Smallest visible fraction of the other's width.
    pub visible_share: f64,
    /// Constant standard deviation of a range, m.
    pub noise_constant: f64,
    /// Standard deviation of a range, relative to it.
    pub noise_proportional: f64,
    /// Standard deviation of a bearing, rad.
    pub noise_bearing: f64,
    /// Probability of a missed robot.
    pub dropout: f64,
    /// Probability of a missing measurement.
    #[serde(default)]
    pub sweep_dropout: f64,
    /// Rate, Hz; each sweep by default.
    #[serde(default)]
    pub rate: Option<f64>,
    /// Radius of the robots that it detects, for the robot's own model of them, m.
    /// By default that of a Pioneer.
    #[serde(default)]
    pub robot_radius: Option<f64>,
}

impl RobotSensorDescription {
    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let deviation = "expected a standard deviation, not negative";
        let turn = 2.0 * std::f64::consts::PI;
        let checks = [
            ("mount", self.mount.iter().all(|value| value.is_finite()), "expected finite numbers"),
            (
                "range_max",
                self.range_max.is_finite() && self.range_max > 0.0,
                "expected a positive, finite number",
            ),
            (
                "field_of_view",
                // People write a full turn with a few digits.
                self.field_of_view > 0.0 && self.field_of_view < turn + 0.001,
                "expected an angle above 0, at most a full turn of 6.2832",
            ),
            (
                "visible_share",
                self.visible_share > 0.0 && self.visible_share <= 1.0,
                "expected a share above 0, at most 1",
            ),
            ("noise_constant", is_deviation(self.noise_constant), deviation),
            ("noise_proportional", is_deviation(self.noise_proportional), deviation),
            ("noise_bearing", is_deviation(self.noise_bearing), deviation),
            ("dropout", is_probability(self.dropout), "expected a probability from 0 to 1"),
            ("sweep_dropout", is_probability(self.sweep_dropout), "expected a probability from 0 to 1"),
            (
                "robot_radius",
                self.robot_radius.is_none_or(|radius| radius.is_finite() && radius > 0.0),
                "expected a positive, finite number",
            ),
            ("rate", self.rate.is_none_or(is_rate), "expected a positive number of hertz"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

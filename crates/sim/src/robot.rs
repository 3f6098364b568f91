//! Robots as TOML: body, drive, sonars and noise.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::{DescriptionError, Step, text_of};
use crate::geometry::{Point, Polygon};

/// The robots that come with the simulator.
const ROBOTS: [(&str, &str); 1] = [("pioneer_p3dx", include_str!("../../../robots/pioneer_p3dx.toml"))];

/// A type of robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// What it is called.
    pub name: String,
    /// Kilograms.
    pub mass: f64,
    /// Corners of the convex body, in metres from the midpoint of the axle; either way round.
    pub footprint: Vec<[f64; 2]>,
    /// How it moves.
    pub drive: DriveDescription,
    /// How far it is from ideal.
    pub noise: NoiseDescription,
    /// Profiles of its sonars, by name.
    #[serde(default)]
    pub sonar: BTreeMap<String, SonarDescription>,
}

/// Two driven sides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveDescription {
    /// Metres.
    pub wheel_radius: f64,
    /// Metres between the sides.
    pub track: f64,
    /// Radians per second.
    pub maximum_wheel_speed: f64,
    /// Radians per second squared.
    pub maximum_wheel_acceleration: f64,
}

/// Standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseDescription {
    /// Of a factor on each wheel's radius that stays for a run.
    pub wheel_radius_bias: f64,
    /// Of a factor on the track that stays for a run.
    pub track_bias: f64,
    /// Of the measured wheel speed, relative to it.
    pub wheel_speed: f64,
    /// Of the position sensor, metres.
    pub position: f64,
    /// Of the orientation sensor, radians.
    pub orientation: f64,
}

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
    /// x and y in metres, direction in degrees.
    pub placements: Vec<[f64; 3]>,
}

impl RobotDescription {
    /// A robot that comes with the simulator.
    pub fn named(name: &str) -> Option<Result<Self, DescriptionError>> {
        ROBOTS.iter().any(|(known, _)| *known == name).then(|| Self::load(name))
    }

    /// A robot that comes with the simulator, by its name, or one from a file, by its path.
    ///
    /// # Errors
    /// When there is none, and as [`parse`](Self::parse).
    pub fn load(name: &str) -> Result<Self, DescriptionError> {
        let (source_name, text) = text_of("robot", name, &ROBOTS)?;
        Self::parse(&source_name, &text)
    }

    /// Reads a robot.
    ///
    /// # Errors
    /// Names the file, the line and what was expected.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, DescriptionError> {
        let mut robot: Self = DescriptionError::parse(source_name, text)?;
        let wrong = |path: &[Step<'_>], message: &str| {
            Err(DescriptionError::within(source_name, text, path, message))
        };
        if !robot.outline().is_convex() {
            robot.footprint.reverse();
            if !robot.outline().is_convex() {
                let message = "expected the corners of a convex polygon, at least three, one way round";
                return wrong(&[Step::Key("footprint")], message);
            }
        }
        let DriveDescription { wheel_radius, track, maximum_wheel_speed, maximum_wheel_acceleration } =
            robot.drive;
        let positive = [
            (vec![Step::Key("mass")], robot.mass),
            (vec![Step::Key("drive"), Step::Key("wheel_radius")], wheel_radius),
            (vec![Step::Key("drive"), Step::Key("track")], track),
            (vec![Step::Key("drive"), Step::Key("maximum_wheel_speed")], maximum_wheel_speed),
            (vec![Step::Key("drive"), Step::Key("maximum_wheel_acceleration")], maximum_wheel_acceleration),
        ];
        if let Some((path, _)) = positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return wrong(path, "expected a positive, finite number");
        }
        let NoiseDescription { wheel_radius_bias, track_bias, wheel_speed, position, orientation } =
            robot.noise;
        let deviations = [wheel_radius_bias, track_bias, wheel_speed, position, orientation];
        if !deviations.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return wrong(&[Step::Key("noise")], "expected standard deviations, which are not negative");
        }
        for (name, sonar) in &robot.sonar {
            if let Some((key, message)) = sonar.mistake() {
                return wrong(&[Step::Key("sonar"), Step::Key(name), Step::Key(key)], message);
            }
        }
        Ok(robot)
    }

    /// The body around the midpoint of the axle.
    pub fn outline(&self) -> Polygon {
        Polygon { points: self.footprint.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
    }
}

impl SonarDescription {
    /// Which key has a value that no sonar can have, and what is expected of it.
    fn mistake(&self) -> Option<(&'static str, &'static str)> {
        let right_angle = std::f64::consts::FRAC_PI_2;
        let probability = |value: f64| (0.0..=1.0).contains(&value);
        let deviation = |value: f64| value.is_finite() && value >= 0.0;
        let checks = [
            ("range_min", deviation(self.range_min), "expected a distance, which is not negative"),
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
            ("noise_constant", deviation(self.noise_constant), "expected a standard deviation, not negative"),
            (
                "noise_proportional",
                deviation(self.noise_proportional),
                "expected a standard deviation, not negative",
            ),
            ("dropout", probability(self.dropout), "expected a probability from 0 to 1"),
            ("crosstalk", probability(self.crosstalk), "expected a probability from 0 to 1"),
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

//! Robots as TOML: body, drive, sonars and noise.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Polygon};
use crate::world::DescriptionError;

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
    /// x and y in metres, direction in degrees.
    pub placements: Vec<[f64; 3]>,
}

impl RobotDescription {
    /// A robot that comes with the simulator.
    pub fn named(name: &str) -> Option<Result<Self, DescriptionError>> {
        let text = match name {
            "pioneer_p3dx" => include_str!("../../../robots/pioneer_p3dx.toml"),
            _ => return None,
        };
        Some(Self::parse(&format!("robots/{name}.toml"), text))
    }

    /// Reads a robot.
    ///
    /// # Errors
    /// Names the file, the line and what was expected.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, DescriptionError> {
        let mut robot: Self = toml_edit::de::from_str(text)
            .map_err(|error| DescriptionError::new(source_name, error.to_string()))?;
        let wrong = |message: &str| Err(DescriptionError::new(source_name, message));
        let outline = |points: &[[f64; 2]]| Polygon {
            points: points.iter().map(|[x, y]| Point::new(*x, *y)).collect(),
        };
        if !outline(&robot.footprint).is_convex() {
            robot.footprint.reverse();
            if !outline(&robot.footprint).is_convex() {
                return wrong("`footprint` is not a convex polygon of at least three corners");
            }
        }
        let drive = &robot.drive;
        let positive = [
            robot.mass,
            drive.wheel_radius,
            drive.track,
            drive.maximum_wheel_speed,
            drive.maximum_wheel_acceleration,
        ];
        if positive.iter().any(|value| !(value.is_finite() && *value > 0.0)) {
            return wrong("mass, wheel radius, track, maximum wheel speed and acceleration are positive");
        }
        for (name, sonar) in &robot.sonar {
            if sonar.placements.len() > 16 || sonar.range_max <= sonar.range_min || sonar.field_of_view <= 0.0
            {
                return wrong(&format!("sonar `{name}` has at most 16 placements, an opening and a range"));
            }
        }
        Ok(robot)
    }

    /// The body around the midpoint of the axle.
    pub fn outline(&self) -> Polygon {
        Polygon { points: self.footprint.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
    }
}

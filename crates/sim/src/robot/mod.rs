//! Robots as TOML: body, drive, sensors and noise.

mod drive;
mod laser;
mod robot_sensor;
mod sonar;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Chassis, Point2};
use slate_module::{Sequence, Text};
use slate_robots::ROBOTS;

use crate::error::{DescriptionError, DocumentStep, text_of};
use crate::geometry::{Point, Polygon};

pub use drive::{DriveDescription, DriveKind, Friction, WheelFriction};
pub use laser::LaserDescription;
pub use robot_sensor::RobotSensorDescription;
pub use sonar::SonarDescription;

/// A type of robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// Name.
    pub name: String,
    /// Kilograms.
    pub mass: f64,
    /// Corners of the convex body, in metres from the middle between the wheels; either way round.
    pub footprint: Vec<[f64; 2]>,
    /// Drive.
    pub drive: DriveDescription,
    /// Imperfections.
    pub noise: NoiseDescription,
    /// Profiles of its sonars, by name.
    #[serde(default)]
    pub sonar: BTreeMap<String, SonarDescription>,
    /// Laser scanners that it may carry, by name.
    #[serde(default)]
    pub laser: BTreeMap<String, LaserDescription>,
    /// Profiles of the sensor that sees other robots, by name.
    #[serde(default)]
    pub robot_sensor: BTreeMap<String, RobotSensorDescription>,
    /// Its bumpers.
    #[serde(default)]
    pub bumper: Option<BumperDescription>,
}

/// Bumpers around the body: front and back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BumperDescription {
    /// Least x of contacts of the front bumper, metres.
    pub front: f64,
    /// Greatest x of contacts of the back bumper, metres.
    pub back: f64,
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
        let wrong = |path: &[DocumentStep<'_>], message: &str| {
            Err(DescriptionError::within(source_name, text, path, message))
        };
        if !robot.outline().is_convex() {
            robot.footprint.reverse();
            if !robot.outline().is_convex() {
                let message = "expected the corners of a convex polygon, at least three, one way round";
                return wrong(&[DocumentStep::Key("footprint")], message);
            }
        }
        if robot.footprint.len() > 16 {
            return wrong(&[DocumentStep::Key("footprint")], "expected at most 16 corners");
        }
        if !(robot.mass.is_finite() && robot.mass > 0.0) {
            return wrong(&[DocumentStep::Key("mass")], "expected a positive, finite number");
        }
        if let Some((keys, message)) = robot.drive.mistake() {
            let path: Vec<_> = std::iter::once("drive").chain(keys).map(DocumentStep::Key).collect();
            return wrong(&path, &message);
        }
        let NoiseDescription { wheel_radius_bias, track_bias, wheel_speed, position, orientation } =
            robot.noise;
        let deviations = [wheel_radius_bias, track_bias, wheel_speed, position, orientation];
        if !deviations.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return wrong(
                &[DocumentStep::Key("noise")],
                "expected standard deviations, which are not negative",
            );
        }
        for (name, sonar) in &robot.sonar {
            if let Some((key, message)) = sonar.mistake() {
                return wrong(
                    &[DocumentStep::Key("sonar"), DocumentStep::Key(name), DocumentStep::Key(key)],
                    message,
                );
            }
        }
        for (name, sensor) in &robot.robot_sensor {
            if let Some((key, message)) = sensor.mistake() {
                return wrong(
                    &[DocumentStep::Key("robot_sensor"), DocumentStep::Key(name), DocumentStep::Key(key)],
                    message,
                );
            }
        }
        for (name, laser) in &robot.laser {
            if let Some((key, message)) = laser.mistake() {
                return wrong(
                    &[DocumentStep::Key("laser"), DocumentStep::Key(name), DocumentStep::Key(key)],
                    message,
                );
            }
        }
        if let Some(BumperDescription { front, back }) = robot.bumper
            && !(front.is_finite() && back.is_finite() && back <= front)
        {
            return wrong(&[DocumentStep::Key("bumper")], "expected a `front` that is not behind `back`");
        }
        Ok(robot)
    }

    /// The body as robots know it of themselves.
    pub fn chassis(&self) -> Chassis {
        let corners: Vec<_> = self.footprint.iter().map(|[x, y]| Point2 { x: *x, y: *y }).collect();
        Chassis {
            wheel_radius: self.drive.wheel_radius,
            track: self.drive.odometry_track.unwrap_or(self.drive.track),
            maximum_wheel_speed: self.drive.maximum_wheel_speed,
            maximum_wheel_acceleration: self.drive.maximum_wheel_acceleration,
            outline: Sequence::new(&corners),
            model: Text::new(&self.name),
        }
    }

    /// The body around the middle between the wheels.
    pub fn outline(&self) -> Polygon {
        Polygon { points: self.footprint.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
    }
}

fn is_probability(value: f64) -> bool {
    (0.0..=1.0).contains(&value)
}

fn is_deviation(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

fn is_rate(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

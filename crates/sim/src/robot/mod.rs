//! Robots in TOML: body, drive, sensors and noise.

mod camera;
mod drive;
mod imu;
mod laser;
mod odometry;
mod positioning;
mod robot_sensor;
mod sonar;
mod wheel_angles;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Chassis, Point2};
use slate_module::{Sequence, Text};
use slate_robots::ROBOTS;
use slate_sorted::SortedMap;

use crate::error::{DescriptionError, DocumentStep, text_of};
use crate::geometry::{Point, Polygon};

pub use camera::{CameraDescription, HeadDescription};
pub use drive::{DriveDescription, DriveKind, Friction, WheelFriction};
pub use imu::ImuDescription;
pub use laser::LaserDescription;
pub use odometry::OdometryDescription;
pub use positioning::PositioningDescription;
pub use robot_sensor::RobotSensorDescription;
pub use sonar::SonarDescription;
pub use wheel_angles::WheelAngles;

/// Type of robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// Name.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Corners of the convex body, from the middle between the wheels, m.
    /// Either way round.
    pub footprint: Vec<[f64; 2]>,
    /// Drive.
    pub drive: DriveDescription,
    /// Noise of the drive and its encoders.
    pub noise: NoiseDescription,
    /// Profiles of the sonars, by name.
    #[serde(default)]
    pub sonar: SortedMap<String, SonarDescription>,
    /// Laser scanners that it may carry, by name.
    #[serde(default)]
    pub laser: SortedMap<String, LaserDescription>,
    /// Profiles of the sensor that sees other robots, by name.
    #[serde(default)]
    pub robot_sensor: SortedMap<String, RobotSensorDescription>,
    /// Profiles of the positioning system and compass, by name; exact without.
    #[serde(default)]
    pub positioning: SortedMap<String, PositioningDescription>,
    /// Profiles of the odometry, by name.
    /// Without one, its errors are those of `noise`.
    #[serde(default)]
    pub odometry: SortedMap<String, OdometryDescription>,
    /// Profiles of the optional inertial measurement unit, by name.
    /// The unit is exact without profiles.
    #[serde(default)]
    pub imu: SortedMap<String, ImuDescription>,
    /// Cameras that it may carry, by name.
    #[serde(default)]
    pub camera: SortedMap<String, CameraDescription>,
    /// Bumpers of the robot.
    #[serde(default)]
    pub bumper: Option<BumperDescription>,
}

/// Front and back bumpers around the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BumperDescription {
    /// Smallest x of contacts of the front bumper, m.
    pub front: f64,
    /// Largest x of contacts of the back bumper, m.
    pub back: f64,
}

/// Standard deviations of the drive's errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseDescription {
    /// Standard deviation of each wheel's radius factor, constant in a run.
    pub wheel_radius_bias: f64,
    /// Standard deviation of the track factor, constant in a run.
    pub track_bias: f64,
    /// Standard deviation of the measured wheel speed, relative to it.
    pub wheel_speed: f64,
}

impl RobotDescription {
    /// Returns a built-in type of robot.
    pub fn named(name: &str) -> Option<Result<Self, DescriptionError>> {
        ROBOTS.iter().any(|(known, _)| *known == name).then(|| Self::load(name))
    }

    /// Loads a robot by the name of a built-in one, or by the path of a file.
    ///
    /// # Errors
    /// If it does not exist, and as [`parse`](Self::parse).
    pub fn load(name: &str) -> Result<Self, DescriptionError> {
        let (source_name, text) = text_of("robot", name, &ROBOTS)?;
        Self::parse(&source_name, &text)
    }

    /// Reads a robot.
    ///
    /// # Errors
    /// The file, the line and the expectation.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, DescriptionError> {
        let mut robot: Self = DescriptionError::parse(source_name, text).map_err(with_new_place)?;
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
        if let Some((keys, message)) = robot.drive.invalid_value() {
            let path: Vec<_> = std::iter::once("drive").chain(keys).map(DocumentStep::Key).collect();
            return wrong(&path, &message);
        }
        let NoiseDescription { wheel_radius_bias, track_bias, wheel_speed } = robot.noise;
        let deviations = [wheel_radius_bias, track_bias, wheel_speed];
        if !deviations.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return wrong(
                &[DocumentStep::Key("noise")],
                "expected standard deviations, which are not negative",
            );
        }
        if let Some((keys, message)) = robot.invalid_sensor_value() {
            return wrong(&keys.map(DocumentStep::Key), message);
        }
        if let Some(BumperDescription { front, back }) = robot.bumper
            && !(front.is_finite() && back.is_finite() && back <= front)
        {
            return wrong(&[DocumentStep::Key("bumper")], "expected a `front` that is not behind `back`");
        }
        Ok(robot)
    }

    /// Returns the keys of an invalid value of a sensor, and the expectation.
    fn invalid_sensor_value(&self) -> Option<([&str; 3], &'static str)> {
        let sonars = self.sonar.iter().map(|(name, it)| ("sonar", name, it.invalid_value()));
        let sensors = self.robot_sensor.iter().map(|(name, it)| ("robot_sensor", name, it.invalid_value()));
        let lasers = self.laser.iter().map(|(name, it)| ("laser", name, it.invalid_value()));
        let positioning = self.positioning.iter().map(|(name, it)| ("positioning", name, it.invalid_value()));
        let odometry = self.odometry.iter().map(|(name, it)| ("odometry", name, it.invalid_value()));
        let imus = self.imu.iter().map(|(name, it)| ("imu", name, it.invalid_value()));
        let cameras = self.camera.iter().map(|(name, it)| ("camera", name, it.invalid_value()));
        let mut all =
            sonars.chain(sensors).chain(lasers).chain(positioning).chain(odometry).chain(imus).chain(cameras);
        all.find_map(|(table, name, invalid_value)| {
            invalid_value.map(|(key, message)| ([table, name.as_str(), key], message))
        })
    }

    /// Returns the chassis: the robot's own model of its body.
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

    /// Returns the outline of the body around the middle between the wheels.
    pub fn outline(&self) -> Polygon {
        Polygon { points: self.footprint.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
    }
}

/// Adds a hint about a setting that has moved.
fn with_new_place(mut error: DescriptionError) -> DescriptionError {
    for key in ["position", "orientation"] {
        if error.message.starts_with(&format!("unknown field `{key}`")) {
            error.message = format!(
                "`{key}` is a setting of the positioning system: write `noise_{key}` in [positioning.NAME], which has \
                 `noise_position`, `noise_orientation`, `dropout` and, if it is slower than the sweeps, `rate`"
            );
        }
    }
    error
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

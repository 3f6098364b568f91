//! Body, drive, sensors and actuators of a robot, from its description.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Deserialize;

use crate::ROBOTS;

/// Body, drive, sensors and actuators of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotDevices {
    /// Name of the robot model.
    pub name: String,
    /// Corners of the body, meters.
    pub footprint: Vec<[f64; 2]>,
    /// Drive.
    pub drive: Drive,
    /// Sensors.
    pub sensors: Vec<DeviceDescription>,
    /// Actuators.
    pub actuators: Vec<DeviceDescription>,
    /// Radius of the robots that the robot sensor detects, meters.
    pub detected_radius: f64,
}

/// Drive of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// True for four wheels that steer by skidding, false for two on one axle.
    pub is_skid_steer: bool,
    /// Radius of the wheels, meters.
    pub wheel_radius: f64,
    /// Effective track: that of a differential drive that turns as fast, meters.
    pub track: f64,
    /// Radians per second.
    pub maximum_wheel_speed: f64,
    /// Radians per second squared.
    pub maximum_wheel_acceleration: f64,
}

/// Sensor or actuator of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceDescription {
    /// Name.
    pub name: &'static str,
    /// Number of its elements, such as the sonars of a ring.
    pub count: usize,
    /// Mount in the robot's frame: x, y in m and heading in rad.
    /// Zero for a device that measures in that frame.
    pub mount: [f64; 3],
    /// The same of each of its elements, if it has several.
    pub placements: Vec<[f64; 3]>,
    /// Least value of what it measures or does.
    pub minimum: f64,
    /// Greatest value; zero, as the least one, without limits.
    pub maximum: f64,
    /// Rate, Hz.
    /// Zero for a device that measures in each cycle, or when its driver reports.
    pub rate: f64,
}

/// Profiles of a robot's sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorProfiles<'a> {
    /// Of all sensors.
    pub all: &'a str,
    /// Of the sonars; empty for that of all sensors.
    pub sonar: &'a str,
    /// Of the sensor that sees other robots; empty for that of all sensors.
    pub robot_sensor: &'a str,
}

impl<'a> SensorProfiles<'a> {
    /// The same profile for all sensors.
    pub fn all(profile: &'a str) -> Self {
        Self { all: profile, sonar: "", robot_sensor: "" }
    }

    fn or_all(self, single: &'a str) -> &'a str {
        if single.is_empty() { self.all } else { single }
    }
}

/// Error of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DescriptionProblem {
    message: String,
    is_of_profile: bool,
}

impl DescriptionProblem {
    fn new(message: String) -> Self {
        Self { message, is_of_profile: false }
    }

    /// Returns the argument that is wrong: `robot` or `profile`.
    pub fn argument(&self) -> &'static str {
        if self.is_of_profile { "profile" } else { "robot" }
    }
}

impl fmt::Display for DescriptionProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for DescriptionProblem {}

/// Keys of a description that devices are made of; `slate-sim` checks the others.
#[derive(Deserialize)]
struct Document {
    name: String,
    footprint: Vec<[f64; 2]>,
    drive: DriveTable,
    #[serde(default)]
    sonar: BTreeMap<String, RangeTable>,
    #[serde(default)]
    laser: BTreeMap<String, RangeTable>,
    #[serde(default)]
    robot_sensor: BTreeMap<String, RangeTable>,
    #[serde(default)]
    positioning: BTreeMap<String, RateTable>,
    #[serde(default)]
    odometry: BTreeMap<String, AnyTable>,
    bumper: Option<BumperTable>,
}

impl Document {
    /// Returns the profiles of all sensors but the laser, which has its own ones.
    fn profiles(&self) -> BTreeSet<&str> {
        let Self { sonar, robot_sensor, positioning, odometry, .. } = self;
        let names = sonar.keys().chain(robot_sensor.keys()).chain(positioning.keys()).chain(odometry.keys());
        names.map(String::as_str).collect()
    }
}

/// A profile of which only the name matters here.
#[derive(Deserialize)]
struct AnyTable {}

#[derive(Deserialize)]
struct DriveTable {
    #[serde(default)]
    kind: DriveKind,
    wheel_radius: f64,
    track: f64,
    odometry_track: Option<f64>,
    maximum_wheel_speed: f64,
    maximum_wheel_acceleration: f64,
}

#[derive(Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum DriveKind {
    #[default]
    Differential,
    SkidSteer,
    Omni,
}

/// A profile of a sensor that measures ranges.
#[derive(Deserialize)]
struct RangeTable {
    /// Meters, meters, degrees.
    #[serde(default)]
    mount: [f64; 3],
    #[serde(default)]
    range_min: f64,
    range_max: f64,
    rate: Option<f64>,
    /// Of a robot sensor: radius of the robots that it detects.
    robot_radius: Option<f64>,
    placements: Option<Vec<[f64; 3]>>,
}

/// A profile of the positioning system and the compass.
#[derive(Deserialize)]
struct RateTable {
    rate: Option<f64>,
}

#[derive(Deserialize)]
struct BumperTable {}

impl RangeTable {
    fn device(&self, name: &'static str) -> DeviceDescription {
        let in_radians = |[x, y, degrees]: [f64; 3]| [x, y, degrees.to_radians()];
        let placements: Vec<_> = self.placements.iter().flatten().copied().map(in_radians).collect();
        DeviceDescription {
            mount: in_radians(self.mount),
            minimum: self.range_min,
            maximum: self.range_max,
            rate: self.rate.unwrap_or(0.0),
            count: self.placements.as_ref().map_or(1, Vec::len),
            placements,
            ..plain(name)
        }
    }
}

/// Creates a device of the robot's frame, in each cycle and without limits.
fn plain(name: &'static str) -> DeviceDescription {
    let (mount, placements) = ([0.0; 3], Vec::new());
    DeviceDescription { name, count: 1, mount, placements, minimum: 0.0, maximum: 0.0, rate: 0.0 }
}

/// Radius of other robots where no description says it, meters: that of a Pioneer.
const ROBOT_RADIUS: f64 = 0.28;

/// The profile of that name, or else the first one.
fn choose<'a, T>(profiles: &'a BTreeMap<String, T>, profile: &str) -> Option<&'a T> {
    profiles.get(profile).or_else(|| profiles.values().next())
}

impl RobotDevices {
    /// Reads the description of a robot, by its name or by the path of a file.
    ///
    /// A device without the named profile has its first one.
    ///
    /// # Errors
    /// The name is unknown, no sensor has the profile, or the description is invalid.
    pub fn load(robot: &str, profiles: SensorProfiles<'_>) -> Result<Self, DescriptionProblem> {
        if let Some((_, text)) = ROBOTS.iter().find(|(name, _)| *name == robot) {
            return Self::parse(robot, text, profiles);
        }
        let known = ROBOTS.map(|(name, _)| name).join(", ");
        let expected =
            format!("expected one of {known}, or the path of a description such as `my_robot.toml`");
        if robot.is_empty() {
            return Err(DescriptionProblem::new(format!("no robot is named; {expected}")));
        }
        if !robot.ends_with(".toml") {
            return Err(DescriptionProblem::new(format!("no description of a robot `{robot}`; {expected}")));
        }
        let text = std::fs::read_to_string(robot)
            .map_err(|error| DescriptionProblem::new(format!("can't read `{robot}`: {error}; {expected}")))?;
        Self::parse(robot, &text, profiles)
    }

    /// Reads a description.
    fn parse(source: &str, text: &str, of: SensorProfiles<'_>) -> Result<Self, DescriptionProblem> {
        let profile = of.all;
        let document: Document = toml_edit::de::from_str(text).map_err(|error| {
            DescriptionProblem::new(format!("{source}: {}", error.to_string().trim_end()))
        })?;
        if document.drive.kind == DriveKind::Omni {
            let message = format!(
                "{source}: its wheels are omni wheels; expected a robot with a differential drive or skid steering"
            );
            return Err(DescriptionProblem::new(message));
        }
        let profiles = document.profiles();
        if !profiles.is_empty() && !profiles.contains(profile) {
            let known = profiles.into_iter().collect::<Vec<_>>().join(", ");
            let message = format!("{source}: no sensor has a profile `{profile}`; expected one of {known}");
            return Err(DescriptionProblem { message, is_of_profile: true });
        }
        let ranges = [
            choose(&document.sonar, of.or_all(of.sonar)).map(|sonar| sonar.device("sonar")),
            choose(&document.robot_sensor, of.or_all(of.robot_sensor))
                .map(|sensor| sensor.device("robot_sensor")),
            choose(&document.laser, profile).map(|laser| laser.device("laser")),
            document.bumper.as_ref().map(|_| plain("bumper")),
        ];
        let detector = choose(&document.robot_sensor, of.or_all(of.robot_sensor));
        let detected_radius = detector.and_then(|sensor| sensor.robot_radius).unwrap_or(ROBOT_RADIUS);
        if !(detected_radius > 0.0 && detected_radius.is_finite()) {
            return Err(DescriptionProblem::new(format!(
                "{source}: `robot_radius` of the robot sensor is {detected_radius}; expected a positive number of meters"
            )));
        }
        let rate =
            choose(&document.positioning, profile).and_then(|positioning| positioning.rate).unwrap_or(0.0);
        let sensors = ["position", "orientation"].map(|name| DeviceDescription { rate, ..plain(name) });
        let sensors = sensors.into_iter().chain([plain("odometry")]);
        let drive = &document.drive;
        let limit = drive.maximum_wheel_speed;
        Ok(Self {
            drive: Drive {
                is_skid_steer: drive.kind == DriveKind::SkidSteer,
                wheel_radius: drive.wheel_radius,
                track: drive.odometry_track.unwrap_or(drive.track),
                maximum_wheel_speed: limit,
                maximum_wheel_acceleration: drive.maximum_wheel_acceleration,
            },
            sensors: sensors.chain(ranges.into_iter().flatten()).collect(),
            actuators: vec![DeviceDescription { minimum: -limit, maximum: limit, ..plain("wheels") }],
            name: document.name,
            footprint: document.footprint,
            detected_radius,
        })
    }
}

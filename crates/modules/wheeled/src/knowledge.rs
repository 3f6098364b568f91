//! Knowledge of a wheeled robot: goal and robot model.

use serde::{Deserialize, Serialize};
use slate_avoidance::{MAX_DISTANCE, Parameters, ROBOT_SENSOR, ReflexRules, SONAR, SensorRule, Sides};
use slate_plugin::interfaces::{
    Bumper, Chassis, LaserScan, OccupancyGrid, Odometry, Orientation, Point2, Pose2, PoseEstimate, Position,
    SensorAccuracy, Sightings, SonarScan, Twist2, WheelSpeeds,
};
use slate_plugin::mapek::{Device, DeviceHealth, Kinematics, RobotModel, Steering};
use slate_plugin::prelude::*;
use slate_robots::{DescriptionProblem, DeviceDescription, RobotDevices};

use crate::rules::{RefusedRule, RefusedRules, RulePorts, default_sensor_rules, has_threshold};

/// Model of a wheeled robot.
#[interface]
pub struct WheeledModel {
    /// Pose, drive, sensors and actuators.
    pub robot: RobotModel,
    /// Outline and wheels.
    pub chassis: Chassis,
    /// Errors of the sensors; zero if they are exact.
    pub accuracy: SensorAccuracy,
}

impl WheeledModel {
    /// Reads the description of a robot by its name or path, as yet without pose and measurements.
    ///
    /// # Errors
    /// The description is unknown or invalid.
    pub fn load(robot: &str, profile: &str) -> Result<Self, DescriptionProblem> {
        RobotDevices::load(robot, profile).map(|devices| Self::of(&devices))
    }

    /// Model of a robot by its description, as yet without pose and measurements.
    pub fn of(devices: &RobotDevices) -> Self {
        let corners: Vec<_> = devices.footprint.iter().map(|[x, y]| Point2 { x: *x, y: *y }).collect();
        let list = |devices: &[DeviceDescription]| devices.iter().map(device).collect::<Vec<_>>();
        let drive = devices.drive;
        let steering = if drive.is_skid_steer { Steering::SKID_STEER } else { Steering::DIFFERENTIAL };
        Self {
            robot: RobotModel {
                pose: Pose2::default(),
                drive: Kinematics { wheel_radius: drive.wheel_radius, track: drive.track, steering },
                sensors: Sequence::new(&list(&devices.sensors)),
                actuators: Sequence::new(&list(&devices.actuators)),
            },
            chassis: Chassis {
                wheel_radius: drive.wheel_radius,
                track: drive.track,
                maximum_wheel_speed: drive.maximum_wheel_speed,
                maximum_wheel_acceleration: drive.maximum_wheel_acceleration,
                outline: Sequence::new(&corners),
                model: Text::new(&devices.name),
            },
            accuracy: SensorAccuracy::default(),
        }
    }

    /// Inverse kinematics: wheel speeds of a twist (m/s, rad/s); zero while the drive is unknown.
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        self.robot.drive.wheels_for(Twist2 { linear, angular })
    }

    /// Usual deceleration, m/s², limited by the wheels; zero while the drive is unknown.
    pub fn deceleration(&self) -> f64 {
        let greatest = self.chassis.maximum_wheel_acceleration * self.robot.drive.wheel_radius;
        math::min(Parameters::default().deceleration, greatest)
    }

    /// Returns the estimated pose of a robot whose positioning system or compass errs.
    pub fn estimated_pose(&self) -> Option<Pose2> {
        let SensorAccuracy { position_stddev, orientation_stddev, .. } = self.accuracy;
        (position_stddev > 0.0 || orientation_stddev > 0.0).then_some(self.robot.pose)
    }

    /// Response of the wheels of each side; `None` while the drive is unknown.
    pub fn sides(&self) -> Option<Sides> {
        let Kinematics { wheel_radius, track, .. } = self.robot.drive;
        let acceleration = self.chassis.maximum_wheel_acceleration * wheel_radius;
        (track > 0.0 && acceleration > 0.0).then_some(Sides { track, acceleration })
    }
}

/// A device as its description says.
fn device(description: &DeviceDescription) -> Device {
    let [x, y, theta] = description.mount;
    Device {
        mount: Pose2 { x, y, theta },
        minimum: description.minimum,
        maximum: description.maximum,
        rate: description.rate,
        name: Text::new(description.name),
        ..Device::default()
    }
}

/// Sensors, and facts of the knowledge. The RobotModel lists each Sensor by the name of its input, from its first measurement on.
#[ports]
pub struct WheeledModels {
    /// Ring of sonars.
    #[stale(after = "1s")]
    sonar: Sensed<SonarScan>,
    /// Positioning system.
    #[stale(after = "1s")]
    position: Sensed<Position>,
    /// Compass.
    #[stale(after = "1s")]
    orientation: Sensed<Orientation>,
    /// Wheel encoders.
    #[stale(after = "1s")]
    odometry: Sensed<Odometry>,
    /// Bumpers.
    #[stale(after = "1s")]
    bumper: Sensed<Bumper>,
    /// Laser scanner.
    #[stale(after = "1s")]
    laser: Sensed<LaserScan>,
    /// Sensor that sees other robots.
    #[stale(after = "1s")]
    robot_sensor: Sensed<Sightings>,
    /// Errors of the sensors, as their maker tells them; exact sensors without.
    accuracy: Sensed<SensorAccuracy>,
    /// Goal of the robot.
    goal: Output<Point2>,
    /// Robot model and pose.
    robot: Output<WheeledModel>,
    /// Estimated pose, with its covariance. It takes the place of the measured one.
    #[stale(after = "200ms")]
    pub pose: Known<PoseEstimate>,
    /// Map of the surroundings.
    pub map: Known<OccupancyGrid>,
}

impl WheeledModels {
    /// The input of a sensor that the robot's description names.
    fn sensor(&self, name: &str) -> Option<&dyn SensorInput> {
        Some(match name {
            SONAR => &self.sonar,
            "position" => &self.position,
            "orientation" => &self.orientation,
            "odometry" => &self.odometry,
            "bumper" => &self.bumper,
            "laser" => &self.laser,
            ROBOT_SENSOR => &self.robot_sensor,
            _ => return None,
        })
    }

    /// Updates a device from the Sensor of its name; returns whether that has measured.
    fn watch(&self, device: &mut Device, now: &Tick) -> bool {
        let Some(input) = self.sensor(device.name.as_str()).filter(|input| input.has_measured()) else {
            return false;
        };
        // The sonars know better than a profile.
        if let Some(scan) = self.sonar.get().filter(|_| device.name.as_str() == SONAR) {
            (device.minimum, device.maximum) = (scan.range_min, scan.range_max);
        }
        input.watch(device, now);
        true
    }

    /// Names of the described sensors that the robot has and that may have a rule, and how many there are.
    fn ruled_sensors<'m>(&self, model: &'m WheeledModel) -> ([&'m str; 16], usize) {
        let (mut names, mut length) = ([""; 16], 0);
        for device in model.robot.sensors.iter() {
            let name = device.name.as_str();
            if has_threshold(name) && self.sensor(name).is_some_and(SensorInput::is_there) {
                names[length] = name;
                length += 1;
            }
        }
        (names, length)
    }

    /// The estimated pose; before the first estimate, the measured one of these devices.
    fn newest_pose(&self, sensors: &[Device]) -> Option<Pose2> {
        if self.pose.get().is_some() {
            let pose = self.pose.fresh()?.pose;
            // NaN is no pose.
            return (pose.x + pose.y + pose.theta).is_finite().then_some(pose);
        }
        let measures = |name: &str| {
            sensors.iter().any(|sensor| sensor.name.as_str() == name && sensor.health == DeviceHealth::FRESH)
        };
        let (position, orientation) = (self.position.get()?, self.orientation.get()?);
        (measures("position") && measures("orientation")).then_some(Pose2 {
            x: position.x,
            y: position.y,
            theta: orientation.theta,
        })
    }
}

/// Input of a Sensor of any interface.
trait SensorInput {
    /// Whether a Sensor of the robot writes it.
    fn is_there(&self) -> bool;
    /// Whether it has measured.
    fn has_measured(&self) -> bool;
    /// Updates health and time of measurement.
    fn watch(&self, device: &mut Device, now: &Tick);
}

impl<T: Interface + ?Sized> SensorInput for Sensed<T> {
    fn is_there(&self) -> bool {
        self.has_writer() || self.has_measured()
    }

    fn has_measured(&self) -> bool {
        self.get().is_some()
    }

    fn watch(&self, device: &mut Device, now: &Tick) {
        device.watch(self, now);
    }
}

/// Parameters of [`WheeledKnowledge`].
#[params]
#[derive(PartialEq)]
pub struct WheeledKnowledgeParams {
    #[param(default = "", doc = "robot's description: `pioneer_p3dx`, `summit_xl`, or the path of a file")]
    pub robot: Text<252>,
    #[param(
        default = "vrep",
        doc = "profile of its sensors, which a simulated world sets by its own key; a sensor without it has its first one"
    )]
    pub profile: Text<28>,
    #[param(default = 0.0, unit = "m", doc = "x of the goal")]
    pub goal_x: f64,
    #[param(default = 0.0, unit = "m", doc = "y of the goal")]
    pub goal_y: f64,
    #[param(default = default_sensor_rules(), doc = "distances ahead of the robot's front below which sensors cause a reflex, in metres")]
    pub sensor_rules: Sequence<SensorRule, 4>,
    #[param(default = 0.3, range = 0.0..=5.0, unit = "s", doc = "additional distance of a reflex per speed")]
    pub reaction_time: f64,
    #[param(default = 0.03, range = 0.0..=1.0, unit = "m", doc = "clearance on both sides of the strip ahead below which a reflex follows")]
    pub side_clearance: f64,
    #[param(default = 0.03, range = 0.0..=1.0, unit = "m", doc = "distance from the outline below which any echo causes a reflex")]
    pub min_clearance: f64,
    #[param(default = 0.6, range = 0.0..=10.0, unit = "m", doc = "free length of a heading that a reflex turns to")]
    pub free_distance: f64,
    #[param(default = 0.02, range = 0.0..=1.0, unit = "m", doc = "additional clearance on both sides of such a heading")]
    pub turn_clearance: f64,
    #[param(default = 0.2, range = 0.01..=10.0, unit = "m", doc = "length of the drive of a reflex")]
    pub drive_distance: f64,
    #[param(default = 0.3, range = 0.01..=3.0, unit = "m/s", doc = "linear velocity of that drive")]
    pub reflex_velocity: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "additional distance of the sonars' rule, if the sonars err")]
    pub error_distance: f64,
    #[param(default = 0.04, range = 0.0..=1.0, unit = "m", doc = "addition to `side_clearance` and `min_clearance`, if the sonars err")]
    pub error_clearance: f64,
}

impl WheeledKnowledgeParams {
    /// The rules for sensors with these errors.
    fn rules_for(&self, accuracy: &SensorAccuracy) -> ReflexRules {
        let mut rules = self.rules();
        if accuracy.sonar_outliers > 0.0 {
            rules.side_clearance += self.error_clearance;
            rules.min_clearance += self.error_clearance;
            let mut sensors = [SensorRule::default(); 4];
            for (raised, rule) in sensors.iter_mut().zip(self.sensor_rules.iter()) {
                let more = if rule.sensor.as_str() == SONAR { self.error_distance } else { 0.0 };
                *raised = SensorRule {
                    distance: math::max(rule.distance, math::min(rule.distance + more, MAX_DISTANCE)),
                    ..*rule
                };
            }
            rules.sensors = Sequence::new(&sensors[..self.sensor_rules.len()]);
        }
        rules
    }

    /// The rules for exact sensors.
    fn rules(&self) -> ReflexRules {
        ReflexRules {
            reaction_time: self.reaction_time,
            side_clearance: self.side_clearance,
            min_clearance: self.min_clearance,
            free_distance: self.free_distance,
            turn_clearance: self.turn_clearance,
            drive_distance: self.drive_distance,
            linear_velocity: self.reflex_velocity,
            sensors: self.sensor_rules,
        }
    }
}

/// State of [`WheeledKnowledge`]: the robot by its description, which is read again after a restart.
#[derive(Default, Serialize, Deserialize)]
pub struct WheeledKnowledgeState {
    #[serde(skip)]
    robot: KnownRobot,
    #[serde(skip)]
    refused: RefusedRules,
    /// Health of the described sensors, and when they measured last.
    #[serde(default)]
    watched: [(u64, u8); SENSORS],
}

/// Maximum number of sensors of a robot model.
const SENSORS: usize = 12;

/// A robot by its description.
#[derive(Default)]
pub struct KnownRobot {
    known: Option<(Text<252>, Text<28>, Option<WheeledModel>)>,
}

impl KnownRobot {
    /// Reads the description, if the parameters name one.
    ///
    /// # Errors
    /// It is unknown or invalid.
    pub fn new(params: &WheeledKnowledgeParams) -> Result<Self, Refusal> {
        // A library is checked with the defaults of its kinds; a robot without a description logs an error.
        if params.robot.as_str().is_empty() {
            return Ok(Self::default());
        }
        Self::read(params)
    }

    fn read(params: &WheeledKnowledgeParams) -> Result<Self, Refusal> {
        let model = WheeledModel::load(params.robot.as_str(), params.profile.as_str())
            .map_err(|problem| Refusal(format!("params.robot: {problem}")))?;
        Ok(Self { known: Some((params.robot, params.profile, Some(model))) })
    }

    /// The model of the description that was read.
    fn described(&self) -> Option<&WheeledModel> {
        self.known.as_ref()?.2.as_ref()
    }

    /// The model; none after an error, which is logged.
    fn model(&mut self, params: &WheeledKnowledgeParams, now: &Tick) -> Option<&WheeledModel> {
        let is_known = |(robot, profile, _): &(_, _, _)| *robot == params.robot && *profile == params.profile;
        if !self.known.as_ref().is_some_and(is_known) {
            *self = Self::read(params).unwrap_or_else(|refusal| {
                now.error(format_args!("{refusal}"));
                Self { known: Some((params.robot, params.profile, None)) }
            });
        }
        self.known.as_ref()?.2.as_ref()
    }
}

/// Knowledge of the robot.
pub struct WheeledKnowledge;

impl Knowledge for WheeledKnowledge {
    const NAME: &'static str = "wheeled_knowledge";
    const DOC: &'static str = "Knows the robot's goal and model.";
    type Models = (WheeledModels, RulePorts);
    type Params = WheeledKnowledgeParams;
    type State = WheeledKnowledgeState;

    fn create(_: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<WheeledKnowledgeState, Refusal> {
        let robot = KnownRobot::new(params)?;
        if let Some(model) = robot.described() {
            // Which of them it has, the links say.
            let names = model.robot.sensors.iter().map(|device| device.name.as_str());
            let names: Vec<_> = names.filter(|name| has_threshold(name)).collect();
            params
                .rules()
                .check(&names)
                .map_err(|error| Refusal(RefusedRule { error, sensors: &names }.to_string()))?;
        }
        Ok(WheeledKnowledgeState { robot, ..WheeledKnowledgeState::default() })
    }

    fn update(
        state: &mut WheeledKnowledgeState,
        (models, rules): &Self::Models,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) {
        models.goal.set(Point2 { x: params.goal_x, y: params.goal_y });
        let Some(known) = state.robot.model(params, now) else { return };
        let (names, length) = models.ruled_sensors(known);
        let accuracy = models.accuracy.get().copied().unwrap_or_default();
        state.refused.update(rules, params.rules_for(&accuracy), &names[..length], now);
        let mut sensors = [Device::default(); SENSORS];
        let mut length = 0;
        for (sensor, (measured, health)) in known.robot.sensors.iter().zip(&mut state.watched) {
            let mut sensor = Device { measured: *measured, health: DeviceHealth(*health), ..*sensor };
            let has_measured = models.watch(&mut sensor, now);
            (*measured, *health) = (sensor.measured, sensor.health.0);
            let has_rule = params.sensor_rules.iter().any(|rule| rule.sensor == sensor.name);
            if has_measured || has_rule {
                sensors[length] = sensor;
                length += 1;
            }
        }
        let sensors = &sensors[..length];
        // Without a pose the model is unknown.
        let Some(pose) = models.newest_pose(sensors) else { return };
        models.robot.write(0, |model| {
            *model = *known;
            model.robot.pose = pose;
            model.accuracy = accuracy;
            model.robot.sensors = Sequence::new(sensors);
        });
    }
}

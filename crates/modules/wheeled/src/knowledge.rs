//! Knowledge of a wheeled robot: goal and robot model.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Parameters, ROBOT_SENSOR, SONAR, Sides};
use slate_plugin::interfaces::{
    Bumper, Chassis, LaserScan, OccupancyGrid, Odometry, Orientation, Point2, Pose2, PoseEstimate, Position,
    SensorAccuracy, Sightings, SonarPlacement, SonarScan, Twist2, WheelSpeeds,
};
use slate_plugin::mapek::{ActuatorStatus, Device, DeviceHealth, Kinematics, RobotModel, Steering};
use slate_plugin::module::Hardware;
use slate_plugin::prelude::*;
use slate_robots::{DescriptionProblem, DeviceDescription, RobotDevices, SensorProfiles};

use crate::frozen_sensors::{FrozenSensors, FrozenSince};
use crate::goals::Goals;
use crate::hardware::hardware_of;
use crate::knowledge_params::DescribedRobot;
use crate::rules::{CheckedRules, RefusedRule, RulePorts, WheeledRules, default_sensor_rules, has_threshold};
use crate::traveled_pose::TraveledPose;

pub use crate::hardware::{ODOMETRY, ORIENTATION, POSITION};
pub use crate::knowledge_params::WheeledKnowledgeParams;

/// Model of a wheeled robot.
#[interface]
pub struct WheeledModel {
    /// Robot model: pose, drive, sensors and actuators.
    /// The pose is [`Pose2::UNKNOWN`] while no sensor measures it.
    pub robot: RobotModel,
    /// Outline and wheels.
    pub chassis: Chassis,
    /// Errors of the sensors; zero if they are exact.
    pub accuracy: SensorAccuracy,
    /// Mount of each sonar of the sensor `sonar`.
    pub sonars: Sequence<SonarPlacement, 16>,
    /// Radius of the robots that its robot sensor detects.
    #[unit("m")]
    pub detected_radius: f64,
}

impl WheeledModel {
    /// Loads the description of a robot by its name or path.
    /// The model has no pose and measurements yet.
    ///
    /// # Errors
    /// The description is unknown or invalid.
    pub fn load(robot: &str, profile: &str) -> Result<Self, DescriptionProblem> {
        RobotDevices::load(robot, SensorProfiles::all(profile)).map(|devices| Self::of(&devices))
    }

    /// Returns the model of a robot by its description.
    /// It has no pose and measurements yet.
    pub fn of(devices: &RobotDevices) -> Self {
        let corners: Vec<_> = devices.footprint.iter().map(|[x, y]| Point2 { x: *x, y: *y }).collect();
        let list = |devices: &[DeviceDescription]| devices.iter().map(device).collect::<Vec<_>>();
        let sonars = devices.sensors.iter().find(|sensor| sensor.name == SONAR);
        let sonars = sonars.iter().flat_map(|ring| &ring.placements);
        let sonars: Vec<_> =
            sonars.map(|[x, y, theta]| SonarPlacement { x: *x, y: *y, theta: *theta }).collect();
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
            sonars: Sequence::new(&sonars),
            detected_radius: devices.detected_radius,
        }
    }

    /// Returns true if the robot has wheel encoders that are late or have stopped.
    /// It must not drive on.
    pub fn has_lost_odometry(&self) -> bool {
        let odometry = self.robot.sensor(ODOMETRY);
        odometry.is_some_and(|device| matches!(device.health, DeviceHealth::LATE | DeviceHealth::SILENT))
    }

    /// Inverse kinematics: wheel speeds of a twist (m/s, rad/s).
    /// Zero while the drive is unknown.
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        self.robot.drive.wheels_for(Twist2 { linear, angular })
    }

    /// Returns the usual deceleration, m/s², limited by the wheels.
    /// Zero while the drive is unknown.
    pub fn deceleration(&self) -> f64 {
        let greatest = self.chassis.maximum_wheel_acceleration * self.robot.drive.wheel_radius;
        math::min(Parameters::default().deceleration, greatest)
    }

    /// Returns the response of the wheels of each side.
    /// `None` while the drive is unknown.
    pub fn sides(&self) -> Option<Sides> {
        let Kinematics { wheel_radius, track, .. } = self.robot.drive;
        let acceleration = self.chassis.maximum_wheel_acceleration * wheel_radius;
        (track > 0.0 && acceleration > 0.0).then_some(Sides { track, acceleration })
    }
}

/// Returns a device from its description.
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

/// Inputs of sensors, and facts of the knowledge.
/// The RobotModel lists each Sensor by the name of its input, from its first measurement on.
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
    /// Errors of the sensors, from their data sheets; exact sensors without.
    accuracy: Sensed<SensorAccuracy>,
    /// Status of the wheels, by the name of their gate.
    #[role("actuator_status")]
    wheels: Input<ActuatorStatus>,
    /// Goal of the robot; no value without one, and while it has several.
    goal: Output<Point2>,
    /// Goals that it visits in turn, if it has several.
    goals: Output<Goals>,
    /// Robot model and pose.
    robot: Output<WheeledModel>,
    /// Estimated pose, with its covariance. It takes the place of the measured one.
    #[stale(after = "200ms")]
    pub pose: Known<PoseEstimate>,
    /// Map of the surroundings.
    pub map: Known<OccupancyGrid>,
    /// Goal of an exploration.
    pub exploration_goal: Known<Point2>,
}

impl WheeledModels {
    /// Returns the input of a sensor that the robot's description names.
    fn sensor(&self, name: &str) -> Option<&dyn SensorInput> {
        Some(match name {
            SONAR => &self.sonar,
            POSITION => &self.position,
            ORIENTATION => &self.orientation,
            ODOMETRY => &self.odometry,
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

    /// Returns names and number of the described sensors that may have a rule.
    /// The robot has these sensors.
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

    /// Publishes the rules, and returns them.
    fn publish_rules(
        &self,
        checked: &mut CheckedRules,
        model: &WheeledModel,
        ports: &RulePorts,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) -> WheeledRules {
        let given = params.rules();
        let (names, length) = self.ruled_sensors(model);
        let refused = RefusedRule::find(&given.avoid_obstacle, &names[..length]);
        // By default, of a robot that may have no sonars.
        let refused = refused.filter(|_| given.avoid_obstacle.sensors != default_sensor_rules());
        let has_sonars = model.robot.sensor(SONAR).is_some();
        let rules = if has_sonars { given.with_sonars() } else { given };
        let errs = self.accuracy.get().is_some_and(|accuracy| accuracy.sonar_outliers > 0.0);
        let rules = if errs { rules.widened(params.error_distance, params.error_clearance) } else { rules };
        checked.publish(ports, rules, refused, now);
        rules
    }

    /// Returns since when sensors have been frozen, by their newest measurements.
    fn update_frozen(&self, frozen: &mut FrozenSensors, model: &WheeledModel, now: &Tick) -> FrozenSince {
        let (odometry, device) = (TraveledPose::of(&self.odometry), |name| model.robot.sensor(name));
        let FrozenSensors { sonars, position, orientation, odometry: encoders, robot_sensor } = frozen;
        FrozenSince::new([
            sonars.update(self.sonar.updated(), odometry, device(SONAR), now),
            position.update(self.position.updated(), odometry, device(POSITION), now),
            orientation.update(self.orientation.updated(), odometry, device(ORIENTATION), now),
            encoders.update(self.odometry.updated(), device(ODOMETRY), now),
            robot_sensor.update(self.robot_sensor.updated(), odometry, device(ROBOT_SENSOR), now),
        ])
    }

    /// Lists the sensors with their health, and returns their number.
    ///
    /// Listed are those that have measured or have a rule. Frozen ones are silent since then.
    fn list_sensors(
        &self,
        list: &mut [Device; SENSORS],
        watched: &mut [WatchedSensor; SENSORS],
        model: &WheeledModel,
        (rules, frozen): (&WheeledRules, FrozenSince),
        now: &Tick,
    ) -> usize {
        let mut length = 0;
        for (sensor, watched) in model.robot.sensors.iter().zip(watched) {
            let WatchedSensor { measured, health } = *watched;
            let mut sensor = Device { measured, health: DeviceHealth(health), ..*sensor };
            let has_measured = self.watch(&mut sensor, now);
            // A repeated value is not a measurement.
            if let Some(since) = frozen.of(sensor.name.as_str()) {
                (sensor.measured, sensor.health) = (since, DeviceHealth::SILENT);
            }
            if rules.is_required(sensor.name.as_str()) {
                log_late(DeviceHealth(health), &sensor, now);
            }
            *watched = WatchedSensor { measured: sensor.measured, health: sensor.health.0 };
            if has_measured || rules.is_required(sensor.name.as_str()) {
                list[length] = sensor;
                length += 1;
            }
        }
        length
    }

    /// Sets the goals of the parameters.
    fn set_goals(&self, params: &WheeledKnowledgeParams) {
        match (params.has_goal.get(), params.goals.is_empty()) {
            (false, _) => {}
            (true, true) => self.goal.set(Point2 { x: params.goal_x, y: params.goal_y }),
            (true, false) => self.goals.set(Goals { list: params.goals }),
        }
    }

    /// Returns the estimated pose.
    /// Before the first estimate, it is the one measured by these devices.
    fn newest_pose(&self, sensors: &[Device]) -> Option<Pose2> {
        if self.pose.get().is_some() {
            let pose = self.pose.fresh()?.pose;
            return pose.is_known().then_some(pose);
        }
        let measures = |name: &str| {
            sensors.iter().any(|sensor| sensor.name.as_str() == name && sensor.health == DeviceHealth::FRESH)
        };
        let (position, orientation) = (self.position.get()?, self.orientation.get()?);
        (measures(POSITION) && measures(ORIENTATION)).then_some(Pose2 {
            x: position.x,
            y: position.y,
            theta: orientation.theta,
        })
    }
}

/// Logs once that a sensor with a rule is late, and once that it is fresh again.
/// The Monitor logs a sensor that has stopped.
fn log_late(before: DeviceHealth, sensor: &Device, now: &Tick) {
    let name = sensor.name.as_str();
    match (before, sensor.health) {
        (DeviceHealth::FRESH, DeviceHealth::LATE) => now.warn(format_args!(
            "the sensor `{name}` is late: its newest value is {:.2} s old; reflexes with a rule for it stop the robot",
            now.now().saturating_sub(sensor.measured) as f64 * 1e-9
        )),
        (DeviceHealth::LATE | DeviceHealth::SILENT, DeviceHealth::FRESH) => {
            now.info(format_args!("the sensor `{name}` is on time again"));
        }
        _ => {}
    }
}

/// Input of a Sensor of any interface.
trait SensorInput {
    /// Returns true if a Sensor of the robot writes it.
    fn is_there(&self) -> bool;
    /// Returns true if it has measured.
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

/// State of a sensor in Knowledge.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct WatchedSensor {
    /// Time of the newest measurement, nanoseconds.
    measured: u64,
    /// Health of the sensor, a [`DeviceHealth`].
    health: u8,
}

/// State of [`WheeledKnowledge`]: the robot by its description.
/// The description is read again after a restart.
#[derive(Default, Serialize, Deserialize)]
pub struct WheeledKnowledgeState {
    #[serde(skip)]
    robot: KnownRobot,
    #[serde(skip)]
    rules: CheckedRules,
    /// Described sensors, as they were last.
    #[serde(default)]
    watched: [WatchedSensor; SENSORS],
    #[serde(default)]
    frozen: FrozenSensors,
    /// True if the pose was known once.
    #[serde(default)]
    was_placed: bool,
}

/// Maximum number of sensors of a robot model.
const SENSORS: usize = 12;
/// Maximum number of actuators of a robot model.
const ACTUATORS: usize = 4;

/// Robot by its description.
#[derive(Default)]
pub struct KnownRobot {
    known: Option<(DescribedRobot, Option<WheeledModel>)>,
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
        let model = WheeledModel::of(&params.devices()?);
        Ok(Self { known: Some((params.described(), Some(model))) })
    }

    /// Returns the model of the description that was read.
    fn described(&self) -> Option<&WheeledModel> {
        self.known.as_ref()?.1.as_ref()
    }

    /// Returns the model.
    /// After an error, which is logged, that of the description before.
    fn model(&mut self, params: &WheeledKnowledgeParams, now: &Tick) -> Option<&WheeledModel> {
        let described = params.described();
        if self.known.as_ref().is_none_or(|(known, _)| *known != described) {
            let before = self.described().copied();
            let model = Self::read(params).and_then(|read| match (before, read.described()) {
                (Some(before), Some(model)) if before.robot.drive != model.robot.drive => Err(Refusal(format!(
                    "params.robot: a robot that runs as a `{}` can't become a `{}`: set it in the configuration, and start anew",
                    before.chassis.model.as_str(),
                    params.robot.as_str()
                ))),
                (_, model) => Ok(model.copied()),
            });
            let model = model.unwrap_or_else(|refusal| {
                now.error(format_args!("{refusal}"));
                before
            });
            self.known = Some((described, model));
        }
        self.described()
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
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(_: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<Vec<Hardware>, Refusal> {
        Ok(vec![hardware_of(params.devices()?)])
    }

    fn create(_: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<WheeledKnowledgeState, Refusal> {
        let robot = KnownRobot::new(params)?;
        if let Some(model) = robot.described() {
            // The links decide which of them the robot has.
            let names = model.robot.sensors.iter().map(|device| device.name.as_str());
            let names: Vec<_> = names.filter(|name| has_threshold(name)).collect();
            if let Some(refused) = RefusedRule::find(&params.rules().avoid_obstacle, &names) {
                return Err(Refusal(refused.to_string()));
            }
        }
        Ok(WheeledKnowledgeState { robot, ..WheeledKnowledgeState::default() })
    }

    fn update(
        state: &mut WheeledKnowledgeState,
        (models, rules): &Self::Models,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) {
        models.set_goals(params);
        let Some(known) = state.robot.model(params, now) else { return };
        let accuracy = models.accuracy.get().copied().unwrap_or_default();
        let known_rules = models.publish_rules(&mut state.rules, known, rules, params, now);
        let frozen = models.update_frozen(&mut state.frozen, known, now);
        let mut sensors = [Device::default(); SENSORS];
        let context = (&known_rules, frozen);
        let length = models.list_sensors(&mut sensors, &mut state.watched, known, context, now);
        let sensors = &sensors[..length];
        let pose = models.newest_pose(sensors);
        state.was_placed |= pose.is_some();
        // The model begins with the first pose, and then tells also of the sensors that do not give it.
        let Some(pose) = pose.or(state.was_placed.then_some(Pose2::UNKNOWN)) else { return };
        models.robot.write(0, |model| {
            *model = *known;
            model.robot.pose = pose;
            model.accuracy = accuracy;
            // The sonars know better than a profile.
            if let Some(scan) = models.sonar.get().filter(|scan| !scan.placements.is_empty()) {
                model.sonars = scan.placements;
            }
            model.robot.sensors = Sequence::new(sensors);
            let mut actuators = [Device::default(); ACTUATORS];
            let described = known.robot.actuators.iter();
            for (actuator, own) in described.zip(&mut actuators) {
                *own = *actuator;
                if own.name.as_str() == "wheels" {
                    own.report(&models.wheels);
                }
            }
            let length = known.robot.actuators.iter().len();
            model.robot.actuators = Sequence::new(&actuators[..length]);
        });
    }
}

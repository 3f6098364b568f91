use slate_interfaces::{FourWheelSpeeds, Pose2, Twist2, WheelSpeeds};
use slate_module::{Input, Interface, Sequence, Text, Tick, interface, math};

use crate::port::Sensed;

/// Health of a sensor or an actuator.
#[interface]
pub enum DeviceHealth {
    /// No measurement and no status yet.
    Unknown,
    /// The sensor measures as expected.
    Fresh,
    /// The newest measurement is older than [`Device::late_after`].
    /// The state ends when the sensor has measured twice in time since.
    Late,
    /// The sensor has stopped.
    /// Its newest measurement is older than [`Device::silent_after`].
    Silent,
    /// An actuator obeys a command that has passed its gate.
    Ready,
    /// An actuator has its safe command, as no command that holds has passed its gate.
    Safe,
    /// The gate of an actuator is not armed.
    Disarmed,
    /// The gate of an actuator is stopped, until it is reset and armed.
    Stopped,
    /// An actuator does not obey.
    /// Its driver reports a fault, or its driver or its block hangs or has failed.
    Failed,
}

/// Status of an Actuator, written when it changes.
#[interface]
#[derive(PartialEq)]
pub struct ActuatorStatus {
    /// Health: one of those of actuators.
    pub health: DeviceHealth,
}

impl ActuatorStatus {
    /// Status of an Actuator that hangs or has failed.
    pub const FAILED: Self = Self { health: DeviceHealth::FAILED };
}

/// Periods without a measurement after which a device is late.
/// Several, because devices lose single measurements.
const LATE_PERIODS: f64 = 5.0;
/// Periods between two measurements of a device that is no longer late.
const FRESH_PERIODS: f64 = 3.0;
/// Least age at which a device is late, and at which it has stopped, seconds.
const MIN_LATE_AGE: f64 = 0.2;
const LEAST_SILENT: f64 = 1.0;

/// Sensor or actuator of a robot.
#[interface]
#[derive(PartialEq)]
pub struct Device {
    /// Mount: pose of the frame of its measurements in the robot's frame (`base_link`).
    /// It is zero for a device that measures in the robot's frame: odometry, a positioning system and a compass,
    /// bumpers, wheels, and a ring of sonars, whose scan has the mount of each.
    pub mount: Pose2,
    /// Minimum, such as of a range or a wheel speed, in the unit of the device.
    pub minimum: f64,
    /// Greatest value; zero, as the least one, without limits.
    pub maximum: f64,
    /// Rate of its measurements.
    /// Zero for a device that measures in each cycle, or as often as its driver reports.
    #[unit("Hz")]
    pub rate: f64,
    /// Time of its newest measurement; zero before the first.
    /// For an actuator, the time of its newest change of health.
    #[unit("ns")]
    pub measured: u64,
    /// Health.
    pub health: DeviceHealth,
    /// Name in the robot's description, such as `sonar`.
    pub name: Text<28>,
}

impl Device {
    /// Updates health and time of measurement from the sensor's input.
    /// Keep the device from update to update.
    ///
    /// Health has hysteresis: a late device is fresh again when two measurements follow each other within three periods.
    pub fn watch<T: Interface + ?Sized>(&mut self, input: &Sensed<T>, now: &Tick) {
        let stamp = input.stamp();
        if stamp.sequence == 0 {
            return;
        }
        let before = std::mem::replace(&mut self.measured, stamp.time);
        let seconds = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-9;
        let age = seconds(stamp.time, now.now());
        let is_new = stamp.time > before;
        let in_time =
            is_new && seconds(before, stamp.time) <= math::max(self.periods(FRESH_PERIODS), MIN_LATE_AGE);
        let was_late = matches!(self.health, DeviceHealth::LATE | DeviceHealth::SILENT)
            || (before > 0 && seconds(before, stamp.time) > self.late_after());
        self.health = if age > self.silent_after() {
            DeviceHealth::SILENT
        } else if age > self.late_after() || (was_late && !in_time) {
            DeviceHealth::LATE
        } else {
            DeviceHealth::FRESH
        };
    }

    /// Updates the health of an actuator from the status of its Actuator.
    pub fn report(&mut self, status: &Input<ActuatorStatus>) {
        let Some(reported) = status.get() else { return };
        self.measured = status.stamp().time;
        // Its writer hangs or is gone.
        self.health = if status.is_stale() { DeviceHealth::FAILED } else { reported.health };
    }

    /// Returns true if a value is within the device's limits, or it has no limits.
    /// The device can then measure or do the value.
    pub fn permits(&self, value: f64) -> bool {
        (self.minimum == 0.0 && self.maximum == 0.0) || (self.minimum..=self.maximum).contains(&value)
    }

    /// Returns the age of the newest measurement above which the device is late, s.
    /// It is five periods, at least 0.2 s.
    pub fn late_after(&self) -> f64 {
        math::max(self.periods(LATE_PERIODS), MIN_LATE_AGE)
    }

    /// Returns the age of the newest measurement above which the device has stopped, s.
    /// It is five periods, at least 1 s.
    pub fn silent_after(&self) -> f64 {
        math::max(self.periods(LATE_PERIODS), LEAST_SILENT)
    }

    fn periods(&self, count: f64) -> f64 {
        if self.rate > 0.0 { count / self.rate } else { 0.0 }
    }
}

/// Steering of a wheeled drive.
#[interface]
pub enum Steering {
    /// No drive is known.
    Unknown,
    /// Two driven wheels on one axle.
    Differential,
    /// Four driven wheels that steer by skidding.
    SkidSteer,
}

/// Kinematics of a wheeled drive.
#[interface]
#[derive(PartialEq)]
pub struct Kinematics {
    /// Radius of the wheels.
    #[unit("m")]
    pub wheel_radius: f64,
    /// Distance of the wheels.
    /// For skid steer, the effective track: that of a differential drive that turns as fast.
    #[unit("m")]
    pub track: f64,
    /// Steering.
    pub steering: Steering,
}

impl Kinematics {
    /// Returns whether the drive is known.
    pub fn is_known(&self) -> bool {
        // NaN is not greater than zero either.
        self.steering != Steering::UNKNOWN && self.wheel_radius > 0.0 && self.track > 0.0
    }

    /// Inverse kinematics: returns the speeds of the wheels of each side.
    /// Zero while the drive is unknown.
    pub fn wheels_for(&self, twist: Twist2) -> WheelSpeeds {
        if !self.is_known() {
            return WheelSpeeds::ZERO;
        }
        let (radius, turn) = (self.wheel_radius, twist.angular * self.track / 2.0);
        WheelSpeeds { left: (twist.linear - turn) / radius, right: (twist.linear + turn) / radius }
    }

    /// Forward kinematics: returns the twist of wheels of these speeds.
    /// Zero while the drive is unknown.
    pub fn twist_of(&self, wheels: WheelSpeeds) -> Twist2 {
        if !self.is_known() {
            return Twist2::ZERO;
        }
        let (left, right) = (wheels.left * self.wheel_radius, wheels.right * self.wheel_radius);
        Twist2 { linear: (left + right) / 2.0, angular: (right - left) / self.track }
    }

    /// Inverse kinematics of four wheels.
    pub fn four_wheels_for(&self, twist: Twist2) -> FourWheelSpeeds {
        let WheelSpeeds { left, right } = self.wheels_for(twist);
        FourWheelSpeeds { front_left: left, front_right: right, back_left: left, back_right: right }
    }

    /// Forward kinematics of four wheels: each side moves as its wheels do on average.
    pub fn twist_of_four(&self, wheels: FourWheelSpeeds) -> Twist2 {
        self.twist_of(WheelSpeeds {
            left: (wheels.front_left + wheels.back_left) / 2.0,
            right: (wheels.front_right + wheels.back_right) / 2.0,
        })
    }
}

/// Robot model: pose, drive, sensors and actuators (RoCS, 4.2 and 5.1).
///
/// Extend it by an interface of your own with a field of this type:
///
/// ```
/// use slate_mapek::RobotModel;
/// use slate_module::interface;
///
/// /// A Pioneer 3-DX.
/// #[interface]
/// pub struct PioneerP3dxModel {
///     /// Place, drive, sensors and actuators.
///     pub robot: RobotModel,
///     /// Weight that it may carry.
///     #[unit("kg")]
///     pub payload: f64,
/// }
/// ```
#[interface]
pub struct RobotModel {
    /// Pose in the map frame.
    pub pose: Pose2,
    /// Drive.
    pub drive: Kinematics,
    /// Sensors.
    pub sensors: Sequence<Device, 12>,
    /// Actuators.
    pub actuators: Sequence<Device, 4>,
}

impl RobotModel {
    /// Returns the sensor of that name.
    pub fn sensor(&self, name: &str) -> Option<&Device> {
        self.sensors.iter().find(|device| device.name.as_str() == name)
    }

    /// Returns the actuator of that name.
    pub fn actuator(&self, name: &str) -> Option<&Device> {
        self.actuators.iter().find(|device| device.name.as_str() == name)
    }

    /// Returns whether the robot has a sensor of that name that has stopped.
    pub fn is_silent(&self, name: &str) -> bool {
        self.sensor(name).is_some_and(|device| device.health == DeviceHealth::SILENT)
    }
}

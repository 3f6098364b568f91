//! Monitors, one for each type of sensor.
//! Each finds its device in the RobotModel. A device is degraded after a second without a measurement, or five periods
//! of a slower device, as sensors lose single ones, while the newest one is not a number, and while the sensor is frozen.

use serde::{Deserialize, Serialize};
use slate_avoidance::SONAR;
use slate_plugin::interfaces::{Echo, Odometry, Orientation, Pose2, Position, SonarScan};
use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

use crate::frozen_sensors::{FrozenOdometry, FrozenSensor, log_frozen};
use crate::frozen_sonars::FrozenSonars;
use crate::knowledge::{ODOMETRY, ORIENTATION, POSITION, WheeledModel};
use crate::traveled_pose::TraveledPose;

/// Returns the device of that name in a robot model, if that is known.
pub(crate) fn device<'m>(robot: &'m Input<WheeledModel>, name: &str) -> Option<&'m Device> {
    robot.get()?.robot.sensor(name)
}

/// Ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "1s")]
    sonar: Sensed<SonarScan>,
    /// Wheel encoders, which measure the robot's motion.
    /// Without them a frozen sonar can't be recognized.
    odometry: Input<Odometry>,
    /// Robot model with the limits and mounts of the sonars, from Knowledge.
    robot: Input<WheeledModel>,
}

impl Sonar {
    /// Returns a scan limited to the sonars' ranges in the robot model (REP 117).
    /// Beyond their maximum range they detect no obstacle, and an obstacle nearer than their minimum range is at that
    /// range. A scan without mounts takes those of the model.
    fn interpreted(&self, scan: &SonarScan) -> SonarScan {
        let mut scan = *scan;
        let Some(robot) = self.robot.get() else { return scan };
        if scan.placements.is_empty() {
            scan.placements = robot.sonars;
        }
        if let Some(device) = robot.robot.sensor(SONAR) {
            let mut echoes = [Echo::default(); 16];
            for (echo, measured) in echoes.iter_mut().zip(scan.echoes.iter()) {
                *echo = within(*measured, device);
            }
            scan.echoes = Sequence::new(&echoes[..scan.echoes.len()]);
        }
        scan
    }
}

/// Returns an echo within the limits of a device. NaN stays NaN.
fn within(echo: Echo, device: &Device) -> Echo {
    match echo.range {
        range if !range.is_finite() || device.permits(range) => echo,
        range if range > device.maximum => Echo { range: device.maximum, heard: false.into() },
        _ => Echo { range: device.minimum, ..echo },
    }
}

/// Returns true if a scan has a mount for each sonar and all ranges are numbers.
pub fn is_valid(scan: &SonarScan) -> bool {
    let echoes = scan.echoes.len();
    echoes > 0
        && echoes == scan.placements.len()
        && scan.echoes.iter().all(|echo| echo.range.is_finite() && echo.range >= 0.0)
}

/// Returns the newest valid measurement of a sensor.
/// `None` while it is invalid, which is logged when that begins.
fn valid<T: Copy>(
    is_invalid: &mut bool,
    (sensor, newest): (&str, Option<&T>),
    is_valid: impl Fn(&T) -> bool,
    now: &Tick,
) -> Option<T> {
    let newest = newest?;
    let was_invalid = std::mem::replace(is_invalid, !is_valid(newest));
    if *is_invalid && !was_invalid {
        now.warn(format_args!("the measurements of the sensor `{sensor}` are dropped: one is NaN"));
    }
    (!*is_invalid).then_some(*newest)
}

/// State of [`RangeMonitor`].
#[derive(Default, Serialize, Deserialize)]
pub struct RangeMonitorState {
    /// True if the newest scan is invalid.
    is_invalid: bool,
    /// True if a sonar is frozen.
    is_frozen: bool,
    sonars: FrozenSonars,
}

/// Monitors the sonars: ranges are within the limits of the device.
///
/// Drops scans with a NaN range, and all scans while a sonar is frozen.
pub struct RangeMonitor;

impl Monitor for RangeMonitor {
    const NAME: &'static str = "range_monitor";
    const DOC: &'static str = "Monitors the sonars.";
    type Sensors = Sonar;
    type Params = ();
    type State = RangeMonitorState;
    type Value = SonarScan;

    fn interpret(state: &mut RangeMonitorState, sensors: &Sonar, _: &(), now: &Tick) -> Option<SonarScan> {
        let scan = sensors.sonar.updated();
        let since = state.sonars.update(
            scan,
            TraveledPose::of(&sensors.odometry),
            device(&sensors.robot, SONAR),
            now,
        );
        log_frozen(&mut state.is_frozen, SONAR, "an echo is the same", since, now);
        let scan = scan.map(|scan| sensors.interpreted(scan));
        valid(&mut state.is_invalid, (SONAR, scan.as_ref()), is_valid, now).filter(|_| since.is_none())
    }

    fn device<'s>(sensors: &'s Sonar, port: &str) -> Option<&'s Device> {
        device(&sensors.robot, port)
    }

    fn is_degraded(state: &RangeMonitorState) -> bool {
        state.is_invalid || state.is_frozen
    }
}

/// State of a Monitor that drops measurements of a sensor that is frozen.
#[derive(Default, Serialize, Deserialize)]
pub struct MonitorState<F> {
    /// True if the newest measurement is invalid.
    is_invalid: bool,
    /// True if the sensor is frozen.
    is_frozen: bool,
    sensor: F,
}

/// Positioning system.
#[ports]
pub struct Positioning {
    #[stale(after = "1s")]
    position: Sensed<Position>,
    /// Wheel encoders, which measure the robot's motion.
    /// Without them a frozen positioning system can't be recognized.
    odometry: Input<Odometry>,
    /// Robot model with the rate of the device, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Monitors the positioning system.
pub struct PositionMonitor;

impl Monitor for PositionMonitor {
    const NAME: &'static str = "position_monitor";
    const DOC: &'static str = "Monitors the positioning system.";
    type Sensors = Positioning;
    type Params = ();
    type State = MonitorState<FrozenSensor>;
    type Value = Position;

    fn interpret(state: &mut Self::State, sensors: &Positioning, _: &(), now: &Tick) -> Option<Position> {
        let (newest, device) = (sensors.position.updated(), device(&sensors.robot, POSITION));
        let since = state.sensor.update(newest, TraveledPose::of(&sensors.odometry), device, now);
        log_frozen(&mut state.is_frozen, POSITION, "it is the same", since, now);
        let is_valid = |position: &Position| position.x.is_finite() && position.y.is_finite();
        valid(&mut state.is_invalid, (POSITION, newest), is_valid, now).filter(|_| since.is_none())
    }

    fn device<'s>(sensors: &'s Positioning, port: &str) -> Option<&'s Device> {
        device(&sensors.robot, port)
    }

    fn is_degraded(state: &Self::State) -> bool {
        state.is_invalid || state.is_frozen
    }
}

/// Compass.
#[ports]
pub struct Compass {
    #[stale(after = "1s")]
    orientation: Sensed<Orientation>,
    /// Wheel encoders, which measure the robot's turn.
    /// Without them a frozen compass can't be recognized.
    odometry: Input<Odometry>,
    /// Robot model with the rate of the device, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Monitors the compass.
pub struct OrientationMonitor;

impl Monitor for OrientationMonitor {
    const NAME: &'static str = "orientation_monitor";
    const DOC: &'static str = "Monitors the compass.";
    type Sensors = Compass;
    type Params = ();
    type State = MonitorState<FrozenSensor>;
    type Value = Orientation;

    fn interpret(state: &mut Self::State, sensors: &Compass, _: &(), now: &Tick) -> Option<Orientation> {
        let (newest, device) = (sensors.orientation.updated(), device(&sensors.robot, ORIENTATION));
        let since = state.sensor.update(newest, TraveledPose::of(&sensors.odometry), device, now);
        log_frozen(&mut state.is_frozen, ORIENTATION, "it is the same", since, now);
        let is_valid = |orientation: &Orientation| orientation.theta.is_finite();
        valid(&mut state.is_invalid, (ORIENTATION, newest), is_valid, now).filter(|_| since.is_none())
    }

    fn device<'s>(sensors: &'s Compass, port: &str) -> Option<&'s Device> {
        device(&sensors.robot, port)
    }

    fn is_degraded(state: &Self::State) -> bool {
        state.is_invalid || state.is_frozen
    }
}

/// Wheel encoders.
#[ports]
pub struct Encoders {
    #[stale(after = "1s")]
    odometry: Sensed<Odometry>,
    /// Robot model with the rate of the device, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Monitors the odometry.
pub struct OdometryMonitor;

impl Monitor for OdometryMonitor {
    const NAME: &'static str = "odometry_monitor";
    const DOC: &'static str = "Monitors the odometry.";
    type Sensors = Encoders;
    type Params = ();
    type State = MonitorState<FrozenOdometry>;
    type Value = Odometry;

    fn interpret(state: &mut Self::State, sensors: &Encoders, _: &(), now: &Tick) -> Option<Odometry> {
        let (newest, device) = (sensors.odometry.updated(), device(&sensors.robot, ODOMETRY));
        let since = state.sensor.update(newest, device, now);
        log_frozen(&mut state.is_frozen, ODOMETRY, "its pose is the same", since, now);
        let is_valid = |Odometry { pose: Pose2 { x, y, theta }, .. }: &Odometry| {
            x.is_finite() && y.is_finite() && theta.is_finite()
        };
        valid(&mut state.is_invalid, (ODOMETRY, newest), is_valid, now).filter(|_| since.is_none())
    }

    fn device<'s>(sensors: &'s Encoders, port: &str) -> Option<&'s Device> {
        device(&sensors.robot, port)
    }

    fn is_degraded(state: &Self::State) -> bool {
        state.is_invalid || state.is_frozen
    }
}

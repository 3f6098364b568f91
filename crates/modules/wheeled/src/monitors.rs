//! Monitors, one for each type of sensor. Each is degraded after a second without a measurement, as sensors lose single ones,
//! and while the newest one is no number.

use slate_plugin::interfaces::{Odometry, Orientation, Pose2, Position, SonarScan};
use slate_plugin::prelude::*;

/// Ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "1s")]
    sonar: Sensed<SonarScan>,
}

/// Returns whether a scan has a placement for each sonar and all ranges are numbers.
pub fn is_valid(scan: &SonarScan) -> bool {
    let echoes = scan.echoes.len();
    echoes > 0
        && echoes == scan.placements.len()
        && scan.echoes.iter().all(|echo| echo.range.is_finite() && echo.range >= 0.0)
}

/// Returns the newest measurement of a sensor; none while it is invalid, which is logged when that begins.
fn valid<T: Copy>(
    is_invalid: &mut bool,
    (sensor, newest): (&str, Option<&T>),
    is_valid: impl Fn(&T) -> bool,
    now: &Tick,
) -> Option<T> {
    let newest = newest?;
    let was_invalid = std::mem::replace(is_invalid, !is_valid(newest));
    if *is_invalid && !was_invalid {
        now.warn(format_args!(
            "the measurements of the sensor `{sensor}` are invalid: one is no number; they are dropped"
        ));
    }
    (!*is_invalid).then_some(*newest)
}

/// Monitors the sonars; drops scans with a range that is no number.
pub struct RangeMonitor;

impl Monitor for RangeMonitor {
    const NAME: &'static str = "range_monitor";
    const DOC: &'static str = "Monitors the sonars.";
    type Sensors = Sonar;
    type Params = ();
    /// Whether the newest scan is invalid.
    type State = bool;
    type Value = SonarScan;

    fn interpret(is_invalid: &mut bool, sensors: &Sonar, _: &(), now: &Tick) -> Option<SonarScan> {
        valid(is_invalid, ("sonar", sensors.sonar.updated()), is_valid, now)
    }

    fn is_degraded(is_invalid: &bool) -> bool {
        *is_invalid
    }
}

/// Positioning system.
#[ports]
pub struct Positioning {
    #[stale(after = "1s")]
    position: Sensed<Position>,
}

/// Monitors the positioning system.
pub struct PositionMonitor;

impl Monitor for PositionMonitor {
    const NAME: &'static str = "position_monitor";
    const DOC: &'static str = "Monitors the positioning system.";
    type Sensors = Positioning;
    type Params = ();
    /// Whether the newest measurement is invalid.
    type State = bool;
    type Value = Position;

    fn interpret(is_invalid: &mut bool, sensors: &Positioning, _: &(), now: &Tick) -> Option<Position> {
        let is_valid = |position: &Position| position.x.is_finite() && position.y.is_finite();
        valid(is_invalid, ("position", sensors.position.updated()), is_valid, now)
    }

    fn is_degraded(is_invalid: &bool) -> bool {
        *is_invalid
    }
}

/// Compass.
#[ports]
pub struct Compass {
    #[stale(after = "1s")]
    orientation: Sensed<Orientation>,
}

/// Monitors the compass.
pub struct OrientationMonitor;

impl Monitor for OrientationMonitor {
    const NAME: &'static str = "orientation_monitor";
    const DOC: &'static str = "Monitors the compass.";
    type Sensors = Compass;
    type Params = ();
    /// Whether the newest measurement is invalid.
    type State = bool;
    type Value = Orientation;

    fn interpret(is_invalid: &mut bool, sensors: &Compass, _: &(), now: &Tick) -> Option<Orientation> {
        let is_valid = |orientation: &Orientation| orientation.theta.is_finite();
        valid(is_invalid, ("orientation", sensors.orientation.updated()), is_valid, now)
    }

    fn is_degraded(is_invalid: &bool) -> bool {
        *is_invalid
    }
}

/// Wheel encoders.
#[ports]
pub struct Encoders {
    #[stale(after = "1s")]
    odometry: Sensed<Odometry>,
}

/// Monitors the odometry.
pub struct OdometryMonitor;

impl Monitor for OdometryMonitor {
    const NAME: &'static str = "odometry_monitor";
    const DOC: &'static str = "Monitors the odometry.";
    type Sensors = Encoders;
    type Params = ();
    /// Whether the newest measurement is invalid.
    type State = bool;
    type Value = Odometry;

    fn interpret(is_invalid: &mut bool, sensors: &Encoders, _: &(), now: &Tick) -> Option<Odometry> {
        let is_valid = |Odometry { pose: Pose2 { x, y, theta }, .. }: &Odometry| {
            x.is_finite() && y.is_finite() && theta.is_finite()
        };
        valid(is_invalid, ("odometry", sensors.odometry.updated()), is_valid, now)
    }

    fn is_degraded(is_invalid: &bool) -> bool {
        *is_invalid
    }
}

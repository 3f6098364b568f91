//! Monitors, one for each type of sensor. Each is degraded after a second without a measurement: sensors lose single ones.

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

/// Monitors the sonars; drops scans with a range that is no number.
pub struct RangeMonitor;

impl Monitor for RangeMonitor {
    const NAME: &'static str = "range_monitor";
    const DOC: &'static str = "Monitors the sonars.";
    type Sensors = Sonar;
    type Params = ();
    /// Whether the newest scan was dropped.
    type State = bool;
    type Value = SonarScan;

    fn interpret(is_dropped: &mut bool, sensors: &Sonar, _: &(), now: &Tick) -> Option<SonarScan> {
        let scan = sensors.sonar.updated()?;
        let is_valid = is_valid(scan);
        if !is_valid && !*is_dropped {
            now.warn(format_args!(
                "the scans of the sensor `sonar` are invalid: a range is no number; they are dropped"
            ));
        }
        *is_dropped = !is_valid;
        is_valid.then_some(*scan)
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
    type State = ();
    type Value = Position;

    fn interpret(_: &mut (), sensors: &Positioning, _: &(), _: &Tick) -> Option<Position> {
        let position = sensors.position.updated()?;
        (position.x.is_finite() && position.y.is_finite()).then_some(*position)
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
    type State = ();
    type Value = Orientation;

    fn interpret(_: &mut (), sensors: &Compass, _: &(), _: &Tick) -> Option<Orientation> {
        let orientation = sensors.orientation.updated()?;
        orientation.theta.is_finite().then_some(*orientation)
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
    type State = ();
    type Value = Odometry;

    fn interpret(_: &mut (), sensors: &Encoders, _: &(), _: &Tick) -> Option<Odometry> {
        let odometry = sensors.odometry.updated()?;
        let Pose2 { x, y, theta } = odometry.pose;
        (x.is_finite() && y.is_finite() && theta.is_finite()).then_some(*odometry)
    }
}

//! Health of a range sensor from its measurements.
//! Sensors of the managing loop read them in the managed robot.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Odometry, SonarScan};
use slate_plugin::mapek::driver_sensors;
use slate_plugin::prelude::*;

/// Health of a sensor.
#[interface]
#[derive(PartialEq)]
pub struct SensorHealth {
    /// Age of the newest measurement.
    #[unit("s")]
    pub age: f64,
    /// Share of the measurement that is not a number, 0 to 1.
    pub invalid: f64,
    /// Travel of the robot, or of its sides in a turn, with unchanged measurements.
    #[unit("m")]
    pub unchanged: f64,
}

driver_sensors! {
    ManagedSonar("managed_sonar", "Range measurements of the robot that is managed."): SonarScan,
    ManagedOdometry("managed_odometry", "Odometry of the robot that is managed."): Odometry,
}

/// Range measurements of the sensor, and odometry of its robot.
#[ports]
pub struct RangeSensor {
    /// Measurements of the sensor.
    ranges: Input<SonarScan>,
    /// Odometry of the wheels.
    odometry: Input<Odometry>,
}

/// Last measurement, and the robot's travel since it changed.
#[derive(Default, Serialize, Deserialize)]
pub struct RangeHealthState {
    /// Time of the first tick, nanoseconds.
    begun: Option<u64>,
    ranges: Vec<f64>,
    /// Pose at the last tick: x, y, theta.
    pose: Option<(f64, f64, f64)>,
    /// Travel since the measurement changed, meters.
    /// `way` counts until now, `unchanged` until the newest measurement.
    way: f64,
    unchanged: f64,
}

/// Half the width of a robot, meters.
/// Its sides travel so far in a turn of a radian.
const SIDE: f64 = 0.2;

/// Monitors the health of a range sensor.
pub struct RangeHealthMonitor;

impl Monitor for RangeHealthMonitor {
    const NAME: &'static str = "range_health_monitor";
    const DOC: &'static str = "Monitors the health of a range sensor.";
    type Sensors = RangeSensor;
    type Params = ();
    type State = RangeHealthState;
    type Value = SensorHealth;

    fn interpret(
        memory: &mut RangeHealthState,
        sensors: &RangeSensor,
        _: &(),
        now: &Tick,
    ) -> Option<SensorHealth> {
        let begun = *memory.begun.get_or_insert(now.now());
        if let Some(Odometry { pose, .. }) = sensors.odometry.updated() {
            let (x, y, theta) =
                memory.pose.replace((pose.x, pose.y, pose.theta)).unwrap_or((pose.x, pose.y, pose.theta));
            let turn = math::angle_between(theta, pose.theta).abs();
            let way = math::hypot(pose.x - x, pose.y - y) + SIDE * turn;
            memory.way += if way.is_finite() { way } else { 0.0 };
        }
        if let Some(scan) = sensors.ranges.updated() {
            let heard = scan.echoes.iter().any(|echo| echo.heard.get());
            let ranges = || scan.echoes.iter().map(|echo| echo.range);
            // Compared as bits: a NaN equals itself, too.
            let same = ranges().map(f64::to_bits).eq(memory.ranges.iter().map(|range| range.to_bits()));
            // Without any echo, readings stay the same everywhere.
            if !same || !heard {
                memory.ranges.clear();
                memory.ranges.extend(ranges());
                memory.way = 0.0;
            }
            memory.unchanged = memory.way;
        }
        // Before the first scan it is only late.
        let scan = sensors.ranges.get();
        let newest = scan.map_or(begun, |_| sensors.ranges.stamp().time);
        Some(SensorHealth {
            age: now.now().saturating_sub(newest) as f64 * 1e-9,
            invalid: scan.map_or(0.0, invalid_share),
            unchanged: memory.unchanged,
        })
    }
}

/// Returns the fraction of NaN in a scan; 1 without echoes.
pub(crate) fn invalid_share(scan: &SonarScan) -> f64 {
    let invalid = scan.echoes.iter().filter(|echo| !echo.range.is_finite()).count();
    if scan.echoes.is_empty() { 1.0 } else { invalid as f64 / scan.echoes.len() as f64 }
}

//! Check of scans.

use serde::{Deserialize, Serialize};
use slate_interfaces::{LaserScan, Pose2};
use slate_module::{Tick, math};

use super::fault::{FaultyInput, InputFault};

/// Scans of another shape in a row after which that shape is expected.
const SHAPE_CHANGE_SCANS: u8 = 10;
/// Travel without a changed range after which a laser counts as stuck, m.
const STUCK_DISTANCE: f64 = 0.3;
/// Turn without a changed range after which a laser counts as stuck, rad.
const STUCK_ANGLE: f64 = 0.3;

/// Check of successive scans of a laser.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ScanCheck {
    /// Number of beams, first direction and increment; none before the first scan.
    shape: Option<(usize, f64, f64)>,
    /// Scans of another shape in a row.
    others: u8,
    /// Time of the newest scan, ns.
    newest: u64,
    /// Hash of the newest ranges, and the odometry when they came first.
    ranges: u64,
    since: Option<[f64; 3]>,
    /// True while the robot moves without a changed range.
    is_stuck: bool,
    /// Fault of the newest scan.
    fault: Option<InputFault>,
}

impl ScanCheck {
    /// Checks a new scan, taken at a pose of the odometry if that is known.
    pub fn check(&mut self, scan: &LaserScan, time: u64, odometry: Option<&Pose2>) {
        self.fault = self.examine(scan, time, odometry).err();
    }

    /// Forgets the pose of the odometry, which has jumped.
    pub fn rebase(&mut self) {
        self.since = None;
    }

    /// Returns the fault of the newest scan, or that scans have stopped.
    pub fn fault(&self, timeout: f64, now: &Tick) -> Result<(), InputFault> {
        let age = now.now().saturating_sub(self.newest) as f64 * 1e-9;
        if age > timeout {
            let reason = format_args!("has stopped: the newest one is {age:.2} s old");
            return Err(InputFault::with(FaultyInput::StoppedScan, reason));
        }
        self.fault.clone().map_or(Ok(()), Err)
    }

    fn examine(&mut self, scan: &LaserScan, time: u64, odometry: Option<&Pose2>) -> Result<(), InputFault> {
        let fault = |reason: std::fmt::Arguments<'_>| Err(InputFault::with(FaultyInput::Scan, reason));
        let before = std::mem::replace(&mut self.newest, time);
        if time < before {
            return fault(format_args!("went back in time by {:.3} s", (before - time) as f64 * 1e-9));
        }
        let numbers = [scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max];
        if scan.ranges.is_empty() || numbers.iter().any(|number| !number.is_finite()) {
            return fault(format_args!("has no beams, or angles or limits that are NaN"));
        }
        self.check_shape((scan.ranges.len(), scan.angle_min, scan.angle_increment))?;
        let invalid = scan.ranges.iter().filter(|range| range.is_nan()).count();
        if 2 * invalid > scan.ranges.len() {
            return fault(format_args!("has {invalid} NaN ranges of {}", scan.ranges.len()));
        }
        self.check_change(scan, odometry)
    }

    /// Checks that a scan has the beams of those before.
    fn check_shape(&mut self, shape: (usize, f64, f64)) -> Result<(), InputFault> {
        let expected = *self.shape.get_or_insert(shape);
        if expected == shape {
            self.others = 0;
            return Ok(());
        }
        self.others += 1;
        if self.others >= SHAPE_CHANGE_SCANS {
            (self.shape, self.others) = (Some(shape), 0);
        }
        let reason = format_args!("has {} beams from {:.3} rad, expected {}", shape.0, shape.1, expected.0);
        Err(InputFault::with(FaultyInput::Scan, reason))
    }

    /// Checks that ranges change while the robot moves.
    fn check_change(&mut self, scan: &LaserScan, odometry: Option<&Pose2>) -> Result<(), InputFault> {
        let ranges = hash(&scan.ranges);
        if std::mem::replace(&mut self.ranges, ranges) != ranges {
            (self.since, self.is_stuck) = (None, false);
        }
        // Without an obstacle in range, scans are the same at all poses.
        let is_return =
            |range: &f32| f64::from(*range) > scan.range_min && f64::from(*range) < scan.range_max;
        let Some(odometry) = odometry.filter(|_| scan.ranges.iter().any(is_return)) else { return Ok(()) };
        let [x, y, theta] = *self.since.get_or_insert([odometry.x, odometry.y, odometry.theta]);
        let travel = math::hypot(odometry.x - x, odometry.y - y);
        let turn = math::angle_between(theta, odometry.theta).abs();
        self.is_stuck |= travel > STUCK_DISTANCE || turn > STUCK_ANGLE;
        if self.is_stuck {
            let reason = format_args!("is stuck: no range has changed on {travel:.2} m and {turn:.2} rad");
            return Err(InputFault::with(FaultyInput::Scan, reason));
        }
        Ok(())
    }
}

/// Returns the FNV-1a hash of the ranges' bits.
fn hash(ranges: &[f32]) -> u64 {
    ranges.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, range| {
        (hash ^ u64::from(range.to_bits())).wrapping_mul(0x0100_0000_01b3)
    })
}

//! Obstacles around the robot, for its local planner.

use std::fmt;

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{LaserScan, Odometry, Point2, Pose2};
use slate_plugin::mapek::RobotModel;
use slate_plugin::prelude::*;

use crate::body::CostmapClear;
use crate::frames::PlanarTransform;
use crate::obstacles::ObstaclePoints;
use crate::scan_memory::{MemoryLimits, ScanMemory};

/// Ports of [`LocalCostmap`].
#[ports]
pub struct LocalCostmapIo {
    /// Scan of the laser.
    scan: Observed<LaserScan>,
    /// Odometry of the wheels.
    #[stale(after = "500ms")]
    odometry: Observed<Odometry>,
    /// Robot model, from Knowledge: it has the mount of the laser.
    /// Without it, the laser is at the robot's origin.
    robot: Input<RobotModel>,
    /// Request to forget obstacles out of sight, from Knowledge.
    clear: Input<CostmapClear>,
    /// Points on obstacles, with each scan.
    #[capacity(16_384)]
    change: Change<ObstaclePoints>,
}

/// Parameters of [`LocalCostmap`], with the names of Nav2's obstacle layer.
#[params]
pub struct LocalCostmapParams {
    #[param(default = 3.0, range = 0.0..=60.0, unit = "s", doc = "time for which obstacles out of sight are kept")]
    observation_persistence: f64,
    #[param(default = 6.0, range = 0.1..=100.0, unit = "m", doc = "maximum range of a beam that marks")]
    obstacle_max_range: f64,
    #[param(default = 720, range = 1..=2000, doc = "maximum number of beams of a scan that are used")]
    max_beams: i64,
    #[param(default = 0.5, range = 0.05..=60.0, unit = "s", doc = "age of the newest scan above which the laser counts as stopped")]
    scan_timeout: f64,
    #[param(default = "laser", doc = "name of the laser in the robot model, which has its mount")]
    laser: Text<28>,
}

/// Local costmap: obstacles in view of the laser, and recent ones beside it.
///
/// An invalid input is named in the log, and the block is degraded: obstacles become stale, and the robot stops, until the
/// input has recovered.
pub struct LocalCostmap;

/// State of [`LocalCostmap`].
#[derive(Default, Serialize, Deserialize)]
pub struct LocalCostmapState {
    memory: ScanMemory,
    fault: Option<ObstacleFault>,
    /// Number of the newest request to clear.
    cleared: u64,
}

impl Analyze for LocalCostmap {
    const NAME: &'static str = "local_costmap";
    const DOC: &'static str = "Keeps the obstacles around the robot that its laser detects.";
    type Observed = LocalCostmapIo;
    type Params = LocalCostmapParams;
    type State = LocalCostmapState;
    type Value = InPlace<ObstaclePoints>;

    fn process(
        state: &mut LocalCostmapState,
        io: &LocalCostmapIo,
        params: &LocalCostmapParams,
        now: &Tick,
    ) -> Option<InPlace<ObstaclePoints>> {
        let has_inputs = io.scan.get().is_some() && io.odometry.get().is_some();
        // Devices take a while to begin.
        if now.seconds() < params.scan_timeout && !has_inputs {
            return None;
        }
        let seen = see(io, params, now);
        state.report(seen.as_ref().err().copied(), now);
        let (scan, pose, laser) = seen.ok()?;
        let request = io.clear.get().map_or(0, |clear| clear.number);
        if std::mem::replace(&mut state.cleared, request) != request {
            state.memory.clear();
        }
        if !io.scan.is_new() {
            return None;
        }
        let limits = MemoryLimits {
            persistence: params.observation_persistence,
            max_range: params.obstacle_max_range,
            max_beams: usize::try_from(params.max_beams).unwrap_or(1),
        };
        state.memory.insert(scan, &laser, &limits, now.seconds());
        let all = state.memory.points(scan, &laser).count();
        let count = all.min(io.change.capacity());
        Some(io.change.write(count, |obstacles| {
            obstacles.pose = pose;
            // The newest come last, and are kept.
            let points = state.memory.points(scan, &laser).skip(all - count);
            for (place, [x, y]) in obstacles.points.iter_mut().zip(points) {
                *place = Point2 { x, y };
            }
        }))
    }

    fn is_degraded(state: &LocalCostmapState) -> bool {
        state.fault.is_some()
    }
}

/// Input that is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum ObstacleFault {
    NoScan,
    StoppedScan,
    InvalidScan,
    NoOdometry,
    NoMount,
}

impl fmt::Display for ObstacleFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoScan => "`scan` has no value yet",
            Self::StoppedScan => "`scan` has stopped",
            Self::InvalidScan => "`scan` is invalid: no beams, or half of its numbers are NaN",
            Self::NoOdometry => "`odometry` is missing, old or no number",
            Self::NoMount => "`laser` is a sensor that the robot model lacks",
        })
    }
}

/// Returns the scan, and the poses of robot and laser in the odometry frame.
fn see<'a>(
    io: &'a LocalCostmapIo,
    params: &LocalCostmapParams,
    now: &Tick,
) -> Result<(&'a LaserScan, Pose2, Pose2), ObstacleFault> {
    let scan = io.scan.get().ok_or(ObstacleFault::NoScan)?;
    let age = now.now().saturating_sub(io.scan.stamp().time) as f64 * 1e-9;
    if age > params.scan_timeout {
        return Err(ObstacleFault::StoppedScan);
    }
    let numbers = [scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max];
    let invalid = scan.ranges.iter().filter(|range| range.is_nan()).count();
    let is_valid = numbers.iter().all(|number| number.is_finite()) && scan.angle_increment > 0.0;
    if scan.ranges.is_empty() || !is_valid || 2 * invalid > scan.ranges.len() {
        return Err(ObstacleFault::InvalidScan);
    }
    let odometry = io.odometry.fresh().filter(|odometry| odometry.pose.is_known());
    let pose = odometry.ok_or(ObstacleFault::NoOdometry)?.pose;
    let mount = match io.robot.get() {
        Some(robot) => robot.sensor(params.laser.as_str()).ok_or(ObstacleFault::NoMount)?.mount,
        None => Pose2::default(),
    };
    Ok((scan, pose, PlanarTransform::of(&pose).pose(&mount)))
}

impl LocalCostmapState {
    /// Logs a fault that begins, and its end.
    fn report(&mut self, fault: Option<ObstacleFault>, now: &Tick) {
        match (std::mem::replace(&mut self.fault, fault), fault) {
            (before, Some(fault)) if before != Some(fault) => {
                now.warn(format_args!("{fault}; the robot stops until it has recovered"));
            }
            (Some(_), None) => now.info(format_args!("scan and odometry have recovered")),
            _ => {}
        }
    }
}

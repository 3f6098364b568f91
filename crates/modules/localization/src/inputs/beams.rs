//! Ends of beams in the robot's frame.

use slate_interfaces::{LaserScan, Pose2};
use slate_mapek::RobotModel;
use slate_module::math;

use super::fault::{FaultyInput, InputFault};

/// Beams of a scan that are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamSelection {
    /// Greatest number of beams.
    pub max_beams: usize,
    /// Range up to which a beam is not a measurement, m.
    pub min_range: f64,
    /// Range from which a beam hits nothing, m.
    pub max_range: f64,
}

/// Returns the mount of a laser from the robot model.
/// It is the robot's origin without a model.
///
/// # Errors
/// A laser that the robot model lacks.
pub fn laser_mount(robot: Option<&RobotModel>, laser: &str) -> Result<Pose2, InputFault> {
    let Some(robot) = robot else { return Ok(Pose2::default()) };
    let missing = || {
        let reason = format_args!("is invalid: `laser` is `{laser}`, which the robot model lacks");
        InputFault::with(FaultyInput::Parameter, reason)
    };
    robot.sensor(laser).map(|device| device.mount).ok_or_else(missing)
}

/// Fills `points` with the ends of about `max_beams` beams.
/// They are in the robot's frame, m, without beams that hit no obstacle.
pub fn ends_of_beams(scan: &LaserScan, mount: &Pose2, beams: BeamSelection, points: &mut Vec<[f64; 2]>) {
    points.clear();
    let step = scan.ranges.len().div_ceil(beams.max_beams.max(1));
    let most = math::min(scan.range_max, beams.max_range);
    let least = math::max(scan.range_min, beams.min_range);
    for (beam, range) in scan.ranges.iter().enumerate().step_by(step.max(1)) {
        let range = f64::from(*range);
        // False for NaN, too.
        if range > least && range < most {
            let angle = mount.theta + scan.angle_min + beam as f64 * scan.angle_increment;
            points.push([mount.x + range * math::cos(angle), mount.y + range * math::sin(angle)]);
        }
    }
}

//! R2, as EXP1 and EXP3 have it.

use slate::prelude::*;
use slate::sim::devices::{
    SimulatedAccuracy, SimulatedOdometry, SimulatedOrientation, SimulatedPosition, SimulatedWheels,
};
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams};
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor, RangeMonitor};

/// Returns R2, a Pioneer P3-DX, without its Plan.
/// The Plan notices the only Analyze of each of its types.
///
/// `S` are its sonars, and `set` changes the parameters of its Knowledge.
pub fn r2<S: Sensor>(set: impl FnOnce(&mut WheeledKnowledgeParams)) -> Robot {
    Robot::new("r2")
        .sensor::<S>("sonar")
        .sensor::<SimulatedPosition>("position")
        .sensor::<SimulatedOrientation>("orientation")
        .sensor::<SimulatedOdometry>("odometry")
        .sensor::<SimulatedAccuracy>("accuracy")
        .actuator::<SimulatedWheels>("motors")
        .monitor::<RangeMonitor>("range_monitor")
        .attach::<PassRange>("pass_range")
        .monitor::<PositionMonitor>("position_monitor")
        .attach::<PassPosition>("pass_position")
        .attach::<EstimatePose>("estimate_pose")
        .monitor::<OrientationMonitor>("orientation_monitor")
        .attach::<PassOrientation>("pass_orientation")
        .attach::<EstimatePose>("estimate_pose")
        .monitor::<OdometryMonitor>("odometry_monitor")
        .attach::<EstimatePose>("estimate_pose")
        .analyze::<EstimatePose>("estimate_pose")
        .link_previous("robot", "knowledge/robot")
        .analyze::<PassRange>("pass_range")
        .analyze::<PassPosition>("pass_position")
        .analyze::<PassOrientation>("pass_orientation")
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(|params| {
            params.robot = "pioneer_p3dx".into();
            set(params);
        })
        .link("pose", "estimate_pose/estimate")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .execute::<DifferentialActions>("execute")
        .gate("wheels", Gate::new(WheelSpeeds::ZERO).time_to_live("100ms"))
        .finish()
}

//! R3, as EXP2 and EXP3 have it.

use slate::interfaces::{FourWheelSpeeds, Point2};
use slate::prelude::*;
use slate::sim::devices::{
    SimulatedAccuracy, SimulatedOdometry, SimulatedOrientation, SimulatedPosition, SimulatedSkidSteerWheels,
};
use slate_avoidance::SensorRule;
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::held_robot_sensor::HeldRobotSensor;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams};
use slate_wheeled::locate_robot::{LocateRobot, RobotMonitor};
use slate_wheeled::median_sonar::MedianSonar;
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor, RangeMonitor};
use slate_wheeled::skid_steer::SkidSteerActions;

/// Returns R3, a Summit XL, without a Plan and `locate_robot`.
/// `locate_robot` tracks another robot in each experiment. It is `robots/r3.toml` as a program. R3 goes to the goal, if
/// it has one.
pub fn r3(goal: Option<Point2>) -> Robot {
    Robot::new("r3")
        .sensor::<MedianSonar>("sonar")
        .sensor::<SimulatedPosition>("position")
        .sensor::<SimulatedOrientation>("orientation")
        .sensor::<SimulatedOdometry>("odometry")
        .sensor::<SimulatedAccuracy>("accuracy")
        .sensor::<HeldRobotSensor>("robot_sensor")
        .actuator::<SimulatedSkidSteerWheels>("motors")
        .monitor::<RangeMonitor>("range_monitor")
        .attach::<PassRange>("pass_range")
        .monitor::<PositionMonitor>("position_monitor")
        .attach::<PassPosition>("pass_position")
        .attach::<EstimatePose>("estimate_pose")
        .attach::<LocateRobot>("locate_robot")
        .monitor::<OrientationMonitor>("orientation_monitor")
        .attach::<PassOrientation>("pass_orientation")
        .attach::<EstimatePose>("estimate_pose")
        .attach::<LocateRobot>("locate_robot")
        .monitor::<RobotMonitor>("robot_monitor")
        .attach::<LocateRobot>("locate_robot")
        .monitor::<OdometryMonitor>("odometry_monitor")
        .attach::<EstimatePose>("estimate_pose")
        .analyze::<EstimatePose>("estimate_pose")
        .link_previous("robot", "knowledge/robot")
        .analyze::<PassRange>("pass_range")
        .analyze::<PassPosition>("pass_position")
        .analyze::<PassOrientation>("pass_orientation")
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(move |knowledge| summit(knowledge, goal))
        .link("pose", "estimate_pose/estimate")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .reactive::<GiveWayModel>("give_way")
        .execute::<SkidSteerActions>("execute")
        .gate("wheels", Gate::new(FourWheelSpeeds::ZERO).time_to_live("100ms"))
        .finish()
}

/// Returns a Summit XL, its goal and the rules of its reflexes.
fn summit(knowledge: &mut WheeledKnowledgeParams, goal: Option<Point2>) {
    let Point2 { x: goal_x, y: goal_y } = goal.unwrap_or_default();
    let rule = |sensor: &str, distance| SensorRule { distance, sensor: sensor.into() };
    *knowledge = WheeledKnowledgeParams {
        robot: "summit_xl".into(),
        has_goal: goal.is_some().into(),
        goal_x,
        goal_y,
        sensor_rules: Sequence::new(&[rule("sonar", 0.3), rule("robot_sensor", 0.25)]),
        reaction_time: 0.7,
        side_clearance: 0.05,
        free_distance: 0.754,
        turn_clearance: 0.01,
        drive_distance: 0.8,
        error_distance: 0.1,
        error_clearance: 0.05,
        ..WheeledKnowledgeParams::default()
    };
}

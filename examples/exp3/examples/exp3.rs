//! EXP3 as a program: `cargo run --release -p slate-exp3 --example exp3` runs it, and `-- --toml` behind that prints its
//! configuration.

use slate::interfaces::FourWheelSpeeds;
use slate::prelude::*;
use slate::sim::devices::{
    SimulatedAccuracy, SimulatedOdometry, SimulatedOrientation, SimulatedPosition, SimulatedSkidSteerWheels,
    SimulatedSonar, SimulatedWheels,
};
use slate_avoidance::SensorRule;
use slate_exp3::follow::FollowPlanner;
use slate_exp3::patrol::PatrolPlanner;
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::held_robot_sensor::HeldRobotSensor;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams};
use slate_wheeled::locate_robot::{LocateRobot, RobotMonitor};
use slate_wheeled::median_sonar::MedianSonar;
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor, RangeMonitor};
use slate_wheeled::skid_steer::SkidSteerActions;

fn main() -> ExitCode {
    robots().run()
}

/// R2 and R3 in the world of EXP3.
pub fn robots() -> Robot {
    r2().with(r3()).world_of(slate_exp3::CONFIGURATION)
}

/// R2 visits the corners.
fn r2() -> Robot {
    let wheels = Gate::new(WheelSpeeds::ZERO).limit("left", -12.3..=12.3).limit("right", -12.3..=12.3);
    Robot::new("r2")
        .sensor::<SimulatedSonar>("sonar")
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
        .attach::<PatrolPlanner>("planner")
        .analyze::<PassPosition>("pass_position")
        .attach::<PatrolPlanner>("planner")
        .analyze::<PassOrientation>("pass_orientation")
        .attach::<PatrolPlanner>("planner")
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(|params| params.robot = "pioneer_p3dx".into())
        .link("pose", "estimate_pose/estimate")
        .plan::<PatrolPlanner>("planner")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .execute::<DifferentialActions>("execute")
        .gate("wheels", wheels.time_to_live("100ms"))
        .finish()
}

/// R3 follows R2.
fn r3() -> Robot {
    let fields = ["front_left", "front_right", "back_left", "back_right"];
    let wheels = Gate::new(FourWheelSpeeds::ZERO).time_to_live("100ms");
    let wheels = fields.iter().fold(wheels, |gate, field| gate.limit(field, -13.6..=13.6));
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
        .analyze::<LocateRobot>("locate_robot")
        .attach::<FollowPlanner>("planner")
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(summit)
        .link("pose", "estimate_pose/estimate")
        .plan::<FollowPlanner>("planner")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .reactive::<GiveWayModel>("give_way")
        .execute::<SkidSteerActions>("execute")
        .gate("wheels", wheels)
        .finish()
}

/// A Summit XL, with the goal and the rules of EXP2.
fn summit(knowledge: &mut WheeledKnowledgeParams) {
    let rule = |sensor: &str, distance| SensorRule { distance, sensor: sensor.into() };
    *knowledge = WheeledKnowledgeParams {
        robot: "summit_xl".into(),
        goal_x: 1.2,
        goal_y: 1.2,
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

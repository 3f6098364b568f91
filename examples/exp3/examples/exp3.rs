//! EXP3 as a program: `cargo run --release -p slate-exp3 --example exp3` runs it, and `-- --toml` behind that prints its
//! configuration.

use slate::interfaces::Point2;
use slate::prelude::*;
use slate::sim::devices::{
    SimulatedAccuracy, SimulatedOdometry, SimulatedOrientation, SimulatedPosition, SimulatedSonar,
    SimulatedWheels,
};
use slate_exp3::follow::FollowPlanner;
use slate_exp3::patrol::PatrolPlanner;
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams};
use slate_wheeled::locate_robot::LocateRobot;
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor, RangeMonitor};

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
        .params(pioneer)
        .link("pose", "estimate_pose/estimate")
        .plan::<PatrolPlanner>("planner")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .execute::<DifferentialActions>("execute")
        .gate("wheels", wheels.time_to_live("100ms"))
        .finish()
}

/// A Pioneer, with the corners in the order in which the authors' robot visits them.
fn pioneer(knowledge: &mut WheeledKnowledgeParams) {
    let corners = [(2.0, 2.0), (2.0, -2.0), (-2.0, 2.0), (-2.0, -2.0)];
    knowledge.robot = "pioneer_p3dx".into();
    knowledge.goals = Sequence::new(&corners.map(|(x, y)| Point2 { x, y }));
}

/// R3, which is that of EXP2, follows R2.
fn r3() -> Robot {
    slate_exp2::r3(None)
        .analyze::<LocateRobot>("locate_robot")
        .attach::<FollowPlanner>("planner")
        .plan::<FollowPlanner>("planner")
        .finish()
}

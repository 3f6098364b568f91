//! EXP1 as a program: Figure 6 of RoCS. `cargo run --release -p slate-exp1 --example exp1` runs it, and `-- --toml` behind
//! that prints its configuration.

use slate::prelude::*;
use slate::sim::devices::{
    SimulatedAccuracy, SimulatedOdometry, SimulatedOrientation, SimulatedPosition, SimulatedSonar,
    SimulatedWheels,
};
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::go_to_origin::GoToOriginPlanner;
use slate_wheeled::knowledge::WheeledKnowledge;
use slate_wheeled::local_map::MapObstacles;
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor, RangeMonitor};

fn main() -> ExitCode {
    robot().run()
}

/// R2 in the world of EXP1.
pub fn robot() -> Robot {
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
        .attach::<GoToOriginPlanner>("planner")
        .analyze::<PassPosition>("pass_position")
        .attach::<GoToOriginPlanner>("planner")
        .analyze::<PassOrientation>("pass_orientation")
        .attach::<GoToOriginPlanner>("planner")
        .analyze::<MapObstacles>("map_obstacles")
        .unlinked("robots")
        .disabled()
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(|params| params.robot = "pioneer_p3dx".into())
        .link("pose", "estimate_pose/estimate")
        .plan::<GoToOriginPlanner>("planner")
        .reactive::<AvoidObstacleModel>("avoid_obstacle")
        .reactive::<AvoidWallModel>("avoid_wall")
        .disabled()
        .execute::<DifferentialActions>("execute")
        .gate("wheels", wheels())
        .world_of(slate_exp1::CONFIGURATION)
        // Its variants name more kinds of blocks.
        .plugin(slate_wheeled::plugin())
}

/// Both wheels of a Pioneer P3-DX, radians per second.
fn wheels() -> Gate {
    Gate::new(WheelSpeeds::ZERO)
        .limit("left", -12.3..=12.3)
        .limit("right", -12.3..=12.3)
        .time_to_live("100ms")
}

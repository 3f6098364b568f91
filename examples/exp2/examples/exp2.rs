//! EXP2 as a program.
//! `cargo run --release -p slate-exp2 --example exp2` runs it, and `-- --toml` behind that prints its configuration.

use slate::interfaces::Point2;
use slate::prelude::*;
use slate_wheeled::go_to_origin::GoToOriginPlanner;
use slate_wheeled::local_map::MapObstacles;
use slate_wheeled::locate_robot::LocateRobot;

fn main() -> ExitCode {
    robot().run()
}

/// Returns R3 in the world of EXP2.
/// Its Plan notices the only Analyze of each of its types.
pub fn robot() -> Robot {
    slate_exp2::r3(Some(Point2 { x: 1.2, y: 1.2 }))
        .analyze::<LocateRobot>("locate_robot")
        .params(|params| params.robot = "r1".into())
        .attach::<GoToOriginPlanner>("planner")
        .analyze::<MapObstacles>("map_obstacles")
        .params(|params| params.obstacle_timeout = 20.0)
        .disabled()
        .plan::<GoToOriginPlanner>("planner")
        .world_of(slate_exp2::CONFIGURATION)
        // Its variants name more kinds of blocks.
        .plugin(slate_wheeled::plugin())
}

//! EXP3 as a program.
//! `cargo run --release -p slate-exp3 --example exp3` runs it, and `-- --toml` behind that prints its configuration.

use slate::interfaces::Point2;
use slate::prelude::*;
use slate_exp3::follow::FollowPlanner;
use slate_exp3::patrol::PatrolPlanner;
use slate_wheeled::locate_robot::LocateRobot;
use slate_wheeled::median_sonar::MedianSonar;

fn main() -> ExitCode {
    robots().run()
}

/// Returns R2 and R3 in the world of EXP3.
pub fn robots() -> Robot {
    r2().with(r3()).world_of(slate_exp3::CONFIGURATION)
}

/// Returns R2, as in EXP1, which visits the corners in the authors' order.
/// They are near walls: where sonars err, their median takes the place of wider rules.
fn r2() -> Robot {
    let corners = [(2.0, 2.0), (2.0, -2.0), (-2.0, 2.0), (-2.0, -2.0)].map(|(x, y)| Point2 { x, y });
    slate_exp1::r2::<MedianSonar>(|knowledge| {
        (knowledge.error_distance, knowledge.error_clearance) = (0.0, 0.0);
        knowledge.goals = Sequence::new(&corners);
    })
    .plan::<PatrolPlanner>("planner")
    .params(|planner| planner.goal_tolerance = 0.05)
    .finish()
}

/// Returns R3, as in EXP2, which follows R2.
fn r3() -> Robot {
    slate_exp2::r3(None)
        .analyze::<LocateRobot>("locate_robot")
        .attach::<FollowPlanner>("planner")
        .plan::<FollowPlanner>("planner")
        .finish()
}

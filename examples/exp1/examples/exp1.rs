//! EXP1 as a program: Figure 6 of RoCS.
//! `cargo run --release -p slate-exp1 --example exp1` runs it, and `-- --toml` behind that prints its configuration.

use slate::prelude::*;
use slate::sim::devices::SimulatedSonar;
use slate_wheeled::go_to_origin::GoToOriginPlanner;
use slate_wheeled::local_map::MapObstacles;

fn main() -> ExitCode {
    robot().run()
}

/// Returns R2 in the world of EXP1.
pub fn robot() -> Robot {
    slate_exp1::r2::<SimulatedSonar>(|_| {})
        .analyze::<MapObstacles>("map_obstacles")
        .unlinked("robots")
        .disabled()
        .plan::<GoToOriginPlanner>("planner")
        .world_of(slate_exp1::CONFIGURATION)
        // Its variants name more kinds of blocks.
        .plugin(slate_wheeled::plugin())
}

//! The third experiment of RoCS (section 6.5): other tasks for the same robots. R2, a Pioneer, visits the four corners, R3, a
//! Summit XL, follows it at a safe distance, and R1 wanders. New are the two Plans, [`patrol`] and [`follow`]; all other
//! blocks are those of EXP1 and EXP2.

pub mod follow;
pub mod patrol;

use slate_plugin::mapek::PlanBlock;
use slate_plugin::prelude::*;

/// Name of the example.
pub const NAME: &str = "exp3";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP3: a Pioneer visits the four corners, a Summit XL follows it";
/// Its configuration.
pub const CONFIGURATION: &str = include_str!("../exp3.toml");

/// Variants of the example by the value of `controller`, and the settings that make them.
pub const CONTROLLERS: [(&str, &[&str]); 3] = [
    ("slate", &[]),
    (
        "rocs",
        &[
            "robots.r2.modules.avoid_obstacle.enabled=false",
            "robots.r2.modules.avoid_wall.enabled=true",
            "robots.r3.modules.avoid_obstacle.enabled=false",
            "robots.r3.modules.give_way.enabled=false",
            "robots.r3.modules.avoid_wall.enabled=true",
            // The authors' wheels turn with 1 rad/s.
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
        ],
    ),
    (
        "rocs-fixed",
        &[
            "robots.r2.modules.avoid_obstacle.enabled=false",
            "robots.r2.modules.avoid_wall.enabled=true",
            "robots.r2.modules.avoid_wall.params.corrected_clamp=true",
            "robots.r3.modules.avoid_obstacle.enabled=false",
            "robots.r3.modules.give_way.enabled=false",
            "robots.r3.modules.avoid_wall.enabled=true",
            "robots.r3.modules.avoid_wall.params.corrected_clamp=true",
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
        ],
    ),
];

/// What the plans know of obstacles, by the value of `planner`.
pub const PLANNERS: [(&str, &[&str]); 1] = [("straight", &[])];

/// How fast the robots may drive, by the value of `pace`, and the settings that make it.
pub const PACES: [(&str, &[&str]); 3] = [
    ("default", &[]),
    (
        "authors",
        &[
            // The authors' wheels turn with 1 rad/s.
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
            "robots.r2.modules.knowledge.params.reflex_velocity=0.0975",
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
            "robots.r3.modules.knowledge.params.reflex_velocity=0.11",
        ],
    ),
    (
        "robots",
        &[
            // The limits of the actuators, where there is room.
            "robots.r2.modules.planner.params.max_linear_velocity=1.2",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.3",
            "robots.r2.modules.knowledge.params.reflex_velocity=1.2",
            "robots.r3.modules.planner.params.max_linear_velocity=1.5",
            "robots.r3.modules.knowledge.params.reflex_velocity=1.5",
        ],
    ),
];

plugin!(PlanBlock<patrol::PatrolPlanner>, PlanBlock<follow::FollowPlanner>);

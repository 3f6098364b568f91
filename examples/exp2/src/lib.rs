//! The second experiment of RoCS (section 6.4): another robot with the same task. A Summit XL, which has four wheels, three
//! sonars and a sensor that sees other robots, goes to a place and holds it. All its blocks come from `slate-wheeled`.

/// Name of the example.
pub const NAME: &str = "exp2";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP2: a Summit XL with four wheels reaches (1.2, 1.2) and holds that place";
/// Its configuration.
pub const CONFIGURATION: &str = include_str!("../exp2.toml");

/// Variants of the example by the value of `controller`, and the settings that make them.
pub const CONTROLLERS: [(&str, &[&str]); 3] = [
    ("slate", &[]),
    (
        "rocs",
        &[
            "robots.r3.modules.avoid_obstacle.enabled=false",
            "robots.r3.modules.give_way.enabled=false",
            "robots.r3.modules.avoid_wall.enabled=true",
            // The authors' wheels turn with 1 rad/s.
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
            "robots.r3.modules.planner.params.careful_linear_velocity=0.11",
        ],
    ),
    (
        "rocs-fixed",
        &[
            "robots.r3.modules.avoid_obstacle.enabled=false",
            "robots.r3.modules.give_way.enabled=false",
            "robots.r3.modules.avoid_wall.enabled=true",
            "robots.r3.modules.avoid_wall.params.corrected_clamp=true",
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
            "robots.r3.modules.planner.params.careful_linear_velocity=0.11",
        ],
    ),
];

/// What the plan knows of obstacles, by the value of `planner`, and the settings that make it.
pub const PLANNERS: [(&str, &[&str]); 2] = [
    ("straight", &[]),
    (
        "local",
        &[
            "robots.r3.modules.avoid_obstacle.enabled=false",
            "robots.r3.modules.map_obstacles.enabled=true",
            "robots.r3.modules.planner.kind=local_planner",
            "robots.r3.modules.planner.params.min_clearance=0.1",
        ],
    ),
];

/// How fast the robots may drive, by the value of `pace`, and the settings that make it.
pub const PACES: [(&str, &[&str]); 3] = [
    ("default", &[]),
    (
        "authors",
        &[
            // The authors' wheels turn with 1 rad/s.
            "robots.r3.modules.planner.params.max_linear_velocity=0.11",
            "robots.r3.modules.planner.params.careful_linear_velocity=0.11",
            "robots.r3.modules.knowledge.params.reflex_velocity=0.11",
        ],
    ),
    (
        "robots",
        &[
            // The limits of the actuators, where there is room.
            "robots.r3.modules.planner.params.max_linear_velocity=1.5",
            "robots.r3.modules.planner.params.careful_linear_velocity=0.3",
            "robots.r3.modules.knowledge.params.reflex_velocity=1.5",
        ],
    ),
];

//! The first experiment of RoCS (section 6.3): a Pioneer P3-DX goes to the origin. Its plan knows no obstacle; the box
//! beside its way and the robot that wanders there are met by reflexes alone. All its blocks come from `slate-wheeled`.

/// Name of the example.
pub const NAME: &str = "exp1";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP1: a Pioneer P3-DX reaches the origin past a box and a wandering robot";
/// Its configuration.
pub const CONFIGURATION: &str = include_str!("../exp1.toml");

/// The same robot at its serial line instead of in the simulator.
pub const PIONEER: &str = include_str!("../pioneer.toml");

/// Variants of the example by the value of `controller`, and the settings that make them.
pub const CONTROLLERS: [(&str, &[&str]); 3] = [
    ("slate", &[]),
    (
        "rocs",
        &[
            "robots.r2.modules.avoid_obstacle.enabled=false",
            "robots.r2.modules.avoid_wall.enabled=true",
            // The authors' wheels turn with 1 rad/s.
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
        ],
    ),
    (
        "rocs-fixed",
        &[
            "robots.r2.modules.avoid_obstacle.enabled=false",
            "robots.r2.modules.avoid_wall.enabled=true",
            "robots.r2.modules.avoid_wall.params.corrected_clamp=true",
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
        ],
    ),
];

/// What the plan knows of obstacles, by the value of `planner`, and the settings that make it.
pub const PLANNERS: [(&str, &[&str]); 2] = [
    ("straight", &[]),
    (
        "local",
        &[
            "robots.r2.modules.avoid_obstacle.enabled=false",
            "robots.r2.modules.map_obstacles.enabled=true",
            "robots.r2.modules.planner.kind=local_planner",
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
            "robots.r2.modules.planner.params.max_linear_velocity=0.0975",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.0975",
            "robots.r2.modules.knowledge.params.reflex_velocity=0.0975",
        ],
    ),
    (
        "robots",
        &[
            // The limits of the actuators, where there is room.
            "robots.r2.modules.planner.params.max_linear_velocity=1.2",
            "robots.r2.modules.planner.params.careful_linear_velocity=0.3",
            "robots.r2.modules.knowledge.params.reflex_velocity=1.2",
        ],
    ),
];

//! Kinds of modules of features that are not built in.

use slate::runtime::ErrorCode;
use slate::runtime::configuration::{Configuration, Report};
use slate_sorted::SortedSet;

use crate::FEATURES;

/// Each feature that brings modules, and their kinds.
pub const KINDS: [(&str, &[&str]); 5] = [
    (
        "drivers",
        &[
            "gps",
            "gps_device",
            "hokuyo",
            "imu_device",
            "joystick",
            "joystick_device",
            "joystick_teleop",
            "joystick_wheels",
            "laser_device",
            "pioneer",
            "pioneer_bumper",
            "pioneer_odometry",
            "pioneer_sonar",
            "pioneer_wheels",
            "rplidar",
            "vector_nav",
        ],
    ),
    ("lua", &["behavior_manager", "behavior_plan"]),
    (
        "missions",
        &[
            "behavior_tree_manager",
            "behavior_tree_plan",
            "golog_manager",
            "golog_plan",
            "mission_knowledge",
            "petri_net_manager",
            "petri_net_plan",
            "wheeled_conditions",
        ],
    ),
    (
        "navigation",
        &[
            "amcl",
            "collision_stop",
            "delivery_referee",
            "ekf",
            "exploration_referee",
            "frontier_explorer",
            "frontier_finder",
            "global_costmap",
            "local_costmap",
            "log_player",
            "log_referee",
            "map_monitor",
            "map_saver",
            "map_server",
            "navigation_execute",
            "navigation_knowledge",
            "obstacle_avoidance",
            "route_planner",
            "scan_localizer",
            "slam",
        ],
    ),
    (
        "vision",
        &[
            "blob_finder",
            "camera_interface",
            "feature_seeker",
            "feature_tracker",
            "image_processor",
            "pan_tilt_controller",
            "victim_saver",
            "vision_master",
            "vision_player",
        ],
    ),
];

/// Modules that an error names.
const MAX_NAMED_MODULES: usize = 4;

/// Checks that the modules of a configuration are built in.
///
/// # Errors
/// One for all modules that need missing features, in place of one for each of their kinds and links.
pub fn check_kinds(configuration: &Configuration) -> Result<(), Report> {
    check_built(configuration, |feature| FEATURES.contains(&(feature, true)))
}

/// Checks as [`check_kinds`], for a program with other features.
///
/// # Errors
/// One for all modules that need missing features.
pub fn check_built(configuration: &Configuration, is_built: impl Fn(&str) -> bool) -> Result<(), Report> {
    // A library may bring a kind of the same name.
    if configuration.plugins().iter().any(|plugin| plugin.members.is_none()) {
        return Ok(());
    }
    let needed = |kind: &str| {
        let (feature, _) = KINDS.iter().find(|(_, kinds)| kinds.contains(&kind))?;
        (!is_built(feature)).then_some(*feature)
    };
    let modules = configuration.modules().iter();
    let absent: Vec<_> =
        modules.filter_map(|module| needed(&module.kind.value).map(|feature| (module, feature))).collect();
    let Some((first, _)) = absent.first() else { return Ok(()) };
    let features: SortedSet<_> = absent.iter().map(|(_, feature)| *feature).collect();
    let names = absent.iter().take(MAX_NAMED_MODULES);
    let names = names.map(|(module, _)| format!("{} ({})", module.name.value, module.kind.value));
    let mut names = names.collect::<Vec<_>>().join(", ");
    if absent.len() > MAX_NAMED_MODULES {
        names += &format!(" and {} more", absent.len() - MAX_NAMED_MODULES);
    }
    let quoted = features.iter().map(|feature| format!("`{feature}`")).collect::<Vec<_>>().join(" and ");
    let message = format!("this program is built without the feature {quoted}, which modules need: {names}");
    let features = features.into_iter().collect::<Vec<_>>().join(",");
    let help = format!("build it with: cargo build --release --features {features}");
    Err(configuration.diagnostic(first.kind.span, ErrorCode::Feature.of(message), Some(help)).into())
}

//! Kinds of modules of features that are not built in.

use std::collections::BTreeSet;

use slate::runtime::ErrorCode;
use slate::runtime::configuration::{Configuration, Report};
use slate_robotics_cli::FEATURES;

/// Each feature that brings modules, and their kinds.
const KINDS: [(&str, &[&str]); 4] = [
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

fn check_built(configuration: &Configuration, is_built: impl Fn(&str) -> bool) -> Result<(), Report> {
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
    let features: BTreeSet<_> = absent.iter().map(|(_, feature)| *feature).collect();
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

#[cfg(test)]
mod tests {
    use slate::module::Plugin;
    use slate::runtime::configuration::Options;

    use super::*;

    const PATROL: &str = "[modules]\n\
        plan.kind = \"petri_net_plan\"\nknowledge.kind = \"mission_knowledge\"\nmap.kind = \"map_server\"\n\
        [links]\n\"plan/fact\" = \"knowledge/fact\"\n";

    #[test]
    fn modules_of_missing_features_are_one_error_that_names_them() {
        let configuration = Configuration::from_text("patrol.toml", PATROL, &Options::default()).unwrap();
        let report = check_built(&configuration, |_| false).unwrap_err().to_string();
        assert_eq!(report.lines().count(), 1, "{report}");
        for words in [
            "`missions` and `navigation`",
            "plan (petri_net_plan)",
            "cargo build --release --features missions,navigation",
        ] {
            assert!(report.contains(words), "{words}: {report}");
        }
        assert!(check_built(&configuration, |_| true).is_ok());
    }

    #[test]
    #[cfg(all(feature = "drivers", feature = "lua", feature = "missions", feature = "navigation"))]
    fn features_list_the_kinds_of_their_plugins() {
        let kinds = |plugins: &[Plugin]| -> BTreeSet<String> {
            plugins.iter().flat_map(Plugin::kinds).map(|kind| kind.name().to_owned()).collect()
        };
        let listed = |features: &[&str]| -> BTreeSet<String> {
            let listed = KINDS.iter().filter(|(feature, _)| features.contains(feature));
            listed.flat_map(|(_, kinds)| *kinds).map(|kind| (*kind).to_owned()).collect()
        };
        assert_eq!(listed(&["drivers"]), kinds(&[slate_arcos::plugin(), slate_drivers::plugin()]));
        assert_eq!(listed(&["lua", "missions"]), kinds(&[slate_executive::plugin()]));
        let navigation = [
            slate_exploration::plugin(),
            slate_localization::plugin(),
            slate_navigation::plugin(),
            slate_slam::plugin(),
        ];
        assert_eq!(listed(&["navigation"]), kinds(&navigation));
    }
}

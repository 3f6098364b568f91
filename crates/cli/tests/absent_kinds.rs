//! Kinds of modules of features that are not built in.

use std::collections::BTreeSet;

use slate::module::Plugin;
use slate::runtime::configuration::{Configuration, Options};
use slate_robotics_cli::absent_kinds::{KINDS, check_built};

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
#[cfg(all(
    feature = "drivers",
    feature = "lua",
    feature = "missions",
    feature = "navigation",
    feature = "vision"
))]
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
    assert_eq!(listed(&["vision"]), kinds(&[slate_vision::plugin()]));
}

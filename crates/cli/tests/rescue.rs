//! The rescue robot in its three steps: modules and links are those of the figures of the OpenRDK paper (section 4).
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use slate::module::Plugin;
use slate::runtime::configuration::{Configuration, Database, Options as Layers};
use slate::runtime::{Agent, Mode, Options, Rate};

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/rescue");

/// Modules of the figures, by agent.
const AGENT_1: [&str; 7] = [
    "hw_interface",
    "localizer",
    "mapper",
    "path_planner",
    "obstacle_avoidance",
    "frontier_finder",
    "mission_manager",
];
const AGENT_2: [&str; 4] = ["camera_interface", "image_processor", "pantilt_controller", "feature_seeker"];

/// Links of Figure 5, as source and destination: the figure's property behind each is the comment's.
const FIGURE_5: [(&str, &str); 2] = [
    ("hw_interface/laser_scan", "obstacle_avoidance/laser_scan"), // laserScan
    ("obstacle_avoidance/control_speed", "hw_interface/control_speed"), // controlSpeed
];

/// Links that Figure 6 adds.
const FIGURE_6: [(&str, &str); 15] = [
    ("hw_interface/odometry", "localizer/odometry"),
    ("hw_interface/laser_scan", "localizer/scan"),
    ("localizer/change/pose", "mapper/pose"), // estimatedPose, robotPose
    ("hw_interface/laser_scan", "mapper/scan"), // laserScan, laser
    ("localizer/change/pose", "path_planner/robot_pose"), // estimatedPose, robotPose
    ("mapper/change", "path_planner/map"),
    ("mission_manager/target", "path_planner/target_pose"), // targetPose
    ("path_planner/local_target", "obstacle_avoidance/local_target"), // localTargetPose
    ("mission_manager/action_4/is_active", "obstacle_avoidance/enabled"), // obstAvoidEnabled
    ("mapper/change", "frontier_finder/map"),
    ("frontier_finder/goal", "mission_manager/target_1"), // frontiers
    ("camera_interface/image", "image_processor/image"),
    ("image_processor/detections", "feature_seeker/features"), // features
    ("feature_seeker/pantilt_position", "pantilt_controller/position"),
    ("mission_manager/action_5/is_active", "feature_seeker/enabled"), // feature_seekerEnabled
];

/// The figure's link of features to the mission, on which `feature_tracker` stands: it places them on the map.
const FEATURES: [(&str, &str); 4] = [
    ("image_processor/detections", "feature_tracker/features"),
    ("feature_tracker/candidate/is_there", "mission_manager/condition_1/holds"),
    ("feature_tracker/view_pose", "mission_manager/target_2"),
    ("feature_tracker/result", "mission_manager/result_2"),
];

/// Links between the figure's modules that it does not show: results of actions, what an explorer and a camera must know.
const BESIDE: [(&str, &str); 5] = [
    ("frontier_finder/progress/is_done", "mission_manager/result_1/has_succeeded"),
    ("path_planner/status/has_arrived", "mission_manager/result_3/has_succeeded"),
    ("localizer/change/pose", "frontier_finder/pose"),
    ("mission_manager/action_5/arguments/0", "feature_seeker/mode/focus"),
    ("camera_interface/camera_info", "feature_seeker/camera_info"),
];

/// Links that Figure 7 adds (section 4.3).
const FIGURE_7: [(&str, &str); 4] = [
    ("hw_interface/actual_speed", "context_subsystem/actual_speed"),
    ("image_processor/terrain/contrast", "context_subsystem/terrain/roughness"),
    ("context_subsystem/advice/deblur_length", "image_processor/params/deblur_length"),
    ("context_subsystem/advice/max_linear_velocity", "obstacle_avoidance/params/max_linear_velocity"),
];

type Links = BTreeSet<(String, String)>;

fn layers(sets: &[&str]) -> Layers {
    Layers {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: slate_run::EXTRA_TABLES.map(str::to_owned).to_vec(),
        paths: slate_run::PATHS.map(str::to_owned).to_vec(),
        ..Layers::default()
    }
}

fn file(name: &str) -> PathBuf {
    Path::new(EXAMPLE).join(name)
}

fn read(name: &str) -> Configuration {
    Configuration::load(file(name), &layers(&[])).unwrap()
}

/// A field that fills another counts as the whole of both.
fn whole(from: &str, to: &str) -> (String, String) {
    let part = ["/x", "/y"].into_iter().find(|part| from.ends_with(part) && to.ends_with(part));
    let cut = |path: &str| path.strip_suffix(part.unwrap_or_default()).unwrap_or(path).to_owned();
    (cut(from), cut(to))
}

/// Links between modules of the figures, the tracker and the context, without those of devices and files.
fn links(configuration: &Configuration) -> Links {
    let is_shown = |path: &str| {
        let module = path.split('/').next().unwrap_or_default();
        let others = ["feature_tracker", "context_subsystem"];
        AGENT_1.iter().chain(&AGENT_2).chain(&others).any(|name| *name == module)
    };
    let all = configuration.links().iter();
    let all = all.map(|link| whole(&link.from.value.path_in(""), &link.to.value));
    all.filter(|(from, to)| is_shown(from) && is_shown(to)).collect()
}

fn expected(parts: &[&[(&str, &str)]]) -> Links {
    parts.iter().copied().flatten().map(|(from, to)| ((*from).to_owned(), (*to).to_owned())).collect()
}

#[test]
fn rescue_links_are_those_of_the_papers_figures() {
    assert_eq!(links(&read("reactive.toml")), expected(&[&FIGURE_5]));
    // The tracker knows where the camera was.
    let tracker = [
        ("camera_interface/camera_info", "feature_tracker/camera_info"),
        ("localizer/change/pose", "feature_tracker/robot_pose"),
        ("mapper/change", "feature_tracker/map"),
        ("mission_manager/action_2/is_active", "feature_tracker/examine/is_active"),
    ];
    let hybrid = expected(&[&FIGURE_5, &FIGURE_6, &FEATURES, &BESIDE, &tracker]);
    assert_eq!(links(&read("hybrid.toml")), hybrid);
    let context: Links = hybrid.union(&expected(&[&FIGURE_7])).cloned().collect();
    assert_eq!(links(&read("context.toml")), context);
}

#[test]
fn vision_of_the_rescue_robot_is_an_agent_of_its_own() {
    for name in ["agents.toml", "context_agents.toml"] {
        let options = |agent: &str| Layers { agent: Some(agent.into()), ..layers(&[]) };
        let modules = |agent: &str| -> BTreeSet<String> {
            let configuration = Configuration::load(file(name), &options(agent)).unwrap();
            configuration.modules().iter().map(|module| module.name.value.clone()).collect()
        };
        assert_eq!(modules("agent2"), AGENT_2.map(str::to_owned).into());
        let one = modules("agent1");
        assert!(AGENT_1.iter().all(|name| one.contains(*name)), "{one:?}");
        assert!(AGENT_2.iter().all(|name| !one.contains(*name)), "{one:?}");
    }
}

#[test]
fn each_rescue_step_is_the_one_before_and_an_include() {
    for (step, before) in [("hybrid.toml", "reactive.toml"), ("context.toml", "hybrid.toml")] {
        let text = std::fs::read_to_string(file(step)).unwrap();
        let lines: Vec<&str> =
            text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
        let [include] = lines[..] else { panic!("{step} has more than an include: {lines:?}") };
        assert!(include.starts_with(&format!("include = [\"{before}\"")), "{include}");
    }
}

#[test]
fn the_context_changes_no_functional_module() {
    let kinds = |configuration: &Configuration| -> BTreeSet<(String, String)> {
        let modules = configuration.modules().iter();
        modules.map(|module| (module.name.value.clone(), module.kind.value.clone())).collect()
    };
    let (hybrid, context) = (kinds(&read("hybrid.toml")), kinds(&read("context.toml")));
    let added: Vec<_> = context.difference(&hybrid).collect();
    assert!(hybrid.is_subset(&context));
    assert_eq!(added, [&("context_subsystem".to_owned(), "context_subsystem".to_owned())]);
    // What it has to say, it says by links: to itself, or to parameters.
    let text = std::fs::read_to_string(file("modules/adaptation.toml")).unwrap();
    let document: toml_edit::DocumentMut = text.parse().unwrap();
    assert_eq!(document.iter().map(|(key, _)| key).collect::<Vec<_>>(), ["modules", "links"]);
    assert_eq!(document["modules"].as_table().unwrap().len(), 1);
    let of_others = |to: &str| !to.starts_with("context_subsystem/");
    let links = document["links"].as_table().unwrap().iter();
    assert!(links.map(|(to, _)| to).filter(|to| of_others(to)).all(|to| to.contains("/params/")));
}

fn plugins() -> Vec<Plugin> {
    vec![
        slate::sim::plugin(),
        slate_adaptation::plugin(),
        slate_executive::plugin(),
        slate_exploration::plugin(),
        slate_mapping::plugin(),
        slate_navigation::plugin(),
        slate_slam::plugin(),
        slate_vision::plugin(),
        slate_wheeled::plugin(),
    ]
}

/// Runs a step of the example for so many cycles of 20 ms; returns the digest.
fn drive(step: &str, sets: &[&str], cycles: u64, mut look: impl FnMut(&Agent)) -> Option<u64> {
    let database = Database::open(file(step), layers(sets)).unwrap();
    let options = Options { mode: Mode::Staged, rate: Rate::Max, armed: true, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    for _ in 0..cycles {
        assert!(agent.step());
        look(&agent);
    }
    agent.digest()
}

fn number(agent: &Agent, path: &str) -> Option<f64> {
    agent.board().read(path).unwrap().and_then(|(value, _)| value.as_f64())
}

#[test]
fn the_reactive_robot_arrives_at_its_target_and_repeats() {
    let run = || {
        let (mut least, mut left) = (f64::INFINITY, f64::INFINITY);
        let digest = drive("reactive.toml", &["target=ahead"], 600, |agent| {
            let clearance = number(agent, "simulator/scout/clearance/distance");
            least = clearance.map_or(least, |clearance| slate::module::math::min(least, clearance));
            left = number(agent, "obstacle_avoidance/status/distance").unwrap_or(left);
        });
        (digest, least, left)
    };
    let (digest, clearance, left) = run();
    assert!(clearance > 0.0 && left < 0.2 && digest.is_some(), "{clearance} m, {left} m");
    assert_eq!(run().0, digest);
}

#[test]
fn the_hybrid_robot_explores_by_its_mission_and_repeats() {
    // Images cost most of the time of a run, and exploration needs none.
    let blind = ["modules.image_processor.enabled=false"];
    let (mut goals, mut traveled) = (BTreeSet::new(), 0.0);
    drive("hybrid.toml", &blind, 450, |agent| {
        let goal = ["x", "y"].map(|part| number(agent, &format!("mission_manager/target/{part}")));
        if let [Some(x), Some(y)] = goal {
            // To the decimeter.
            goals.insert([(10.0 * x).round() as i64, (10.0 * y).round() as i64]);
        }
        let pose = ["x", "y"].map(|part| number(agent, &format!("localizer/change/pose/{part}")));
        if let [Some(x), Some(y)] = pose {
            traveled = slate::module::math::hypot(x + 4.2, y - 0.6);
        }
    });
    assert!(goals.len() > 1 && traveled > 0.8, "{goals:?}, {traveled} m");
    let digest = || drive("hybrid.toml", &[], 40, |_| ());
    assert!(digest().is_some_and(|first| digest() == Some(first)));
}

//! Of each example, every module alone on a recording of the others: it finds what it found when it was recorded, and so writes
//! what is recorded of it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::json;
use slate::blackboard::Carrier;
use slate::blackboard::interface::{self, Value, View};
use slate::module::Plugin;
use slate::record::Recorder;
use slate::replay::{Comparison, Plan, Player, Recomputation, Verdict};
use slate::runtime::configuration::{Database, Options as Layers};
use slate::runtime::{Agent, Mode, Options, Rate};

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");

/// Settings that get values after a cycle, all at once.
type Changes<'a> = &'a [(u64, &'a [(&'a str, &'a str)])];

fn plugins() -> Vec<Plugin> {
    vec![
        slate::sim::plugin(),
        slate_wheeled::plugin(),
        slate_adaptation::plugin(),
        slate_executive::plugin(),
        slate_localization::plugin(),
        slate_mapping::plugin(),
        slate_exp3::plugin(),
    ]
}

fn options() -> Options {
    Options { mode: Mode::Staged, rate: Rate::Max, armed: true, ..Options::default() }
}

fn layers(sets: &[&str]) -> Layers {
    let tables = ["world", "report", "console"];
    Layers {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: tables.map(str::to_owned).to_vec(),
        ..Layers::default()
    }
}

/// Records so many cycles of an example.
fn record(example: &str, name: &str, sets: &[&str], cycles: u64, changes: Changes<'_>) -> PathBuf {
    record_with(example, name, sets, cycles, |agent, cycle| {
        for (_, changes) in changes.iter().filter(|(after, _)| *after == cycle) {
            agent.database().unwrap().set(changes).unwrap();
        }
    })
}

/// The same; `between` is called before each cycle.
fn record_with(
    example: &str,
    name: &str,
    sets: &[&str],
    cycles: u64,
    between: impl Fn(&Agent, u64),
) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("recompute");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name).with_extension("mcap");
    let file = Path::new(EXAMPLES).join(example).join(example).with_extension("toml");
    let sets = [&["record.enabled=true", "log.targets.console=false", "agent.seed=1"], sets].concat();
    let database = Database::open(&file, layers(&sets)).unwrap();
    let recorder = Recorder::new(database.current().record());
    let recording: Option<Arc<dyn slate::runtime::recording::Recording>> = Some(Arc::new(recorder.clone()));
    let options = Options { recording, log: vec![recorder.log_target()], ..options() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.begin(&agent, &path);
    for cycle in 0..cycles {
        between(&agent, cycle);
        assert!(agent.step());
    }
    assert_eq!(recorder.end(&mut agent).unwrap().dropped, 0);
    path
}

/// What comes of modules that run on a recording.
fn recompute(path: &Path, modules: &[&str]) -> Recomputation {
    let plan = Plan { modules: modules.iter().map(|name| (*name).to_owned()).collect(), ..Plan::default() };
    let mut player = Player::open(path, &plugins(), plan).unwrap();
    assert!(player.misses().is_empty(), "{modules:?}: {:?}", player.misses());
    let options =
        Options { recording: player.recording(None), playback: Some(player.playback()), ..options() };
    let mut agent = Agent::load_with(&player.configuration().unwrap(), &plugins(), options)
        .unwrap_or_else(|error| panic!("{modules:?}: {error:?}"));
    assert!(player.run(&mut agent, &AtomicBool::new(false)).unwrap().is_whole);
    player.outcome().unwrap().unwrap()
}

/// The modules of a recording whose run is made again as a whole; but for the one that sets the time, which the recording does.
fn modules(path: &Path) -> Vec<String> {
    let comparison = Comparison::open(path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options = Options { recording: Some(comparison.recording()), ..options() };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let modules = agent.composer().modules().into_iter().map(|module| module.name);
    let modules = modules.filter(|name| name != "simulator").collect();
    let verdict = comparison.compare(agent).unwrap();
    assert!(matches!(verdict, Verdict::Identical { whole: true, .. }), "{verdict:?}");
    modules
}

fn check(path: &Path) {
    check_but(path, &[]);
}

/// Checks each module by itself but for some.
fn check_but(path: &Path, others: &[&str]) {
    for module in modules(path).into_iter().filter(|module| !others.contains(&module.as_str())) {
        let outcome = recompute(path, &[&module]);
        assert_eq!(outcome.first, None, "{module}");
        assert!(outcome.has_compared(), "{module}: {outcome:?}");
        assert!(outcome.unseen.is_empty() && outcome.unheard.is_empty(), "{module}: {outcome:?}");
    }
}

#[test]
fn every_module_of_exp1_is_the_same() {
    check(&record("exp1", "exp1", &[], 100, &[]));
}

#[test]
fn every_module_of_exp2_is_the_same() {
    check(&record("exp2", "exp2", &[], 100, &[]));
}

/// In the second corner its Plan runs only when others have something new.
#[test]
fn every_module_of_exp3_is_the_same() {
    check(&record("exp3", "exp3", &[], 240, &[]));
}

#[test]
fn every_module_of_a_robot_that_maps_is_the_same() {
    check(&record("mapping", "mapping", &[], 130, &[]));
}

/// A module changes links and parameters of others while they run.
#[test]
fn every_module_of_a_robot_that_adapts_is_the_same() {
    let path = record("adaptation", "adaptation", &[], 180, &[]);
    check(&path);
    // Also when it runs beside those that it changes.
    let outcome =
        recompute(&path, &["r2_manager/execute", "r2_manager/planner", "r2/planner", "r2/range_monitor"]);
    assert_eq!(outcome.first, None);
    let requests = outcome.properties.iter().find(|own| own.url == "/record/change").unwrap();
    assert_eq!((requests.same, requests.is_same()), (1, true));
}

/// What is linked otherwise while the robot runs, switched on, and set.
#[test]
fn relinking_switching_and_setting_leave_every_module_equal() {
    // The RobotModel lists the ring that its readers read.
    let readers =
        ["knowledge", "avoid_obstacle", "avoid_wall"].map(|reader| format!("links.\"r2/{reader}/sonar\""));
    let laser_ring = readers.each_ref().map(|reader| (reader.as_str(), "\"/r2/laser_ring/value\""));
    let sonar = readers.each_ref().map(|reader| (reader.as_str(), "\"/r2/sonar/value\""));
    let changes: Changes<'_> = &[
        (30, &laser_ring),
        (40, &[("modules.\"r2/avoid_wall\".enabled", "true")]),
        (50, &[("modules.\"r2/planner\".params.careful_linear_velocity", "0.15")]),
        (60, &sonar),
        (70, &[("links.\"r2/planner/situation\"", "false"), ("modules.\"r2/execute\".enabled", "false")]),
        (80, &[("modules.\"r2/execute\".enabled", "true")]),
        (85, &[("links.\"r2/planner/situation\"", "\"r2/execute/status\"")]),
    ];
    check(&record("adaptation", "changes", &[], 110, changes));
}

/// Messages belong to their sender: when it runs, its links alone carry them.
#[test]
fn every_module_is_the_same_after_links_of_messages() {
    let changes: Changes<'_> = &[
        (20, &[("links.\"r2/execute/plan\".\"/r2/planner/plan\"", "false")]),
        (30, &[("links.\"r2/execute/plan\".\"/r2/planner/plan\"", "true")]),
        (40, &[("links.\"r2/execute/reflexes\".\"/r2/avoid_obstacle/reflex\"", "false")]),
        (50, &[("links.\"r2/execute/reflexes\".\"/r2/avoid_obstacle/reflex\"", "true")]),
    ];
    check(&record("exp1", "messages", &[], 70, changes));
}

/// A rerun repeats the stops and resets of a gate.
#[test]
fn every_module_is_the_same_after_stops_of_the_actuators() {
    let path = record_with("exp1", "stops", &[], 100, |agent, cycle| match cycle {
        20 | 70 => agent.stop_actuators("a person"),
        30 | 80 => agent.reset(),
        40 => assert!(agent.arm()),
        90 => assert_eq!(agent.composer().arm_one("r2/wheels"), Some(true)),
        _ => {}
    });
    // By itself the Actuator would get the safe command of a stop in the cycle after which the stop came.
    check_but(&path, &["r2/motors"]);
    assert_eq!(recompute(&path, &["r2/execute", "r2/motors"]).first, None);
    let outcome = recompute(&path, &["r2/planner", "r2/execute"]);
    assert_eq!(outcome.first, None);
    let gate = outcome.properties.iter().find(|own| own.url == "/r2/wheels/gate").unwrap();
    assert!(gate.same > 100, "each cycle, and each stop: {gate:?}");
}

/// Orders a mission to do something, as a tool does.
fn order(agent: &Agent, command: &str, element: u32) {
    let (graph, _) = agent.board().find("r2/planner/graph").unwrap();
    let (bytes, items, _) = graph.newest().unwrap().unwrap();
    let graph = serde_json::to_value(View::new(graph.descriptor(), &bytes, items).unwrap()).unwrap();
    let message =
        json!({ "command": command, "outcome": "SUCCESS", "element": element, "graph": graph["id"] });
    let (orders, _) = agent.board().find("r2/planner/orders").unwrap();
    let Carrier::Mailbox(mailbox) = orders.carrier() else { panic!("no inbox") };
    let mut bytes = vec![0; orders.descriptor().size];
    let message: Value = serde_json::from_value(message).unwrap();
    interface::edit(orders.descriptor(), &mut bytes, 0, "", &message).unwrap();
    mailbox.sender().unwrap().send(&bytes, 0, agent.composer().now()).unwrap();
}

/// What a developer orders is recorded as all messages are.
#[test]
fn every_module_of_a_mission_under_orders_is_the_same() {
    // The token continues to the second way, by a forced transition and a step.
    let end_of_first_way = 18;
    let file = format!("robots.r2.modules.planner.params.plan_filename=\"{EXAMPLES}/patrol/patrol.pnml\"");
    let path = record_with("patrol", "patrol", &[&file], 60, |agent, cycle| match cycle {
        10 => order(agent, "PAUSE", 0),
        20 => order(agent, "FORCE", end_of_first_way),
        30 => order(agent, "STEP", 0),
        40 => order(agent, "RESUME", 0),
        _ => {}
    });
    modules(&path);
    let outcome = recompute(&path, &["r2/planner"]);
    assert_eq!(outcome.first, None);
    let count = |name: &str| {
        let own = outcome.properties.iter().find(|own| own.url == format!("/r2/planner/{name}"));
        own.map_or(0, |own| own.same)
    };
    assert!(count("graph") == 1 && count("activity") >= 4, "{outcome:?}");
}

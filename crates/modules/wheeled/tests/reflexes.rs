//! Reflexes of different ranks, and which one acts when several request the robot.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Bumper, Echo, SensorAccuracy, SonarPlacement, SonarScan, WheelSpeeds};
use slate::mapek::{
    ActionKind, Device, ExecuteBlock, MonitorBlock, ReactiveBlock, ReactiveModel, Reflex, SensorBlock,
};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text, math};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate::sim::robot::RobotDescription;
use slate_wheeled::actions::{Release, ReleaseBumper};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::bumper_release::BumperReleaseModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::keep_wall::KeepWallModel;
use slate_wheeled::knowledge::{WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::median_sonar::MedianSonar;
use slate_wheeled::monitors::RangeMonitor;
use slate_wheeled::rules::WheeledRules;

fn pioneer() -> WheeledModel {
    WheeledModel::load("pioneer_p3dx", "vrep").unwrap()
}

/// The default rules.
fn rules() -> WheeledRules {
    WheeledKnowledgeParams::default().rules()
}

/// The wheels of the reflex of the last tick, left and right, if there was one.
fn wheels<R: slate::mapek::ReactiveModel>(
    model: &mut Fixture<ReactiveBlock<R>>,
    kind: &str,
) -> Option<(f64, f64)> {
    model.tick();
    let sent = model.sent::<Reflex>("reflex");
    let action = sent.last()?.action;
    assert_eq!(action.kind.as_str(), kind);
    Some((action.arguments[0], action.arguments[1]))
}

/// What a robot does whose bumpers are pressed like this, one after the other, for a tenth of a second each.
fn release(presses: impl IntoIterator<Item = (bool, bool)>) -> Vec<Option<(f64, f64)>> {
    let mut model = Fixture::<ReactiveBlock<BumperReleaseModel>>::new();
    model.set("robot", pioneer());
    model.set("rules", rules());
    let react = |(front, back): (bool, bool)| {
        model.advance(100_000_000);
        model.set("bumper", Bumper { front: front.into(), back: back.into() });
        wheels(&mut model, "ReleaseBumper")
    };
    presses.into_iter().map(react).collect()
}

#[test]
fn pressed_robot_backs_away_from_contact() {
    let front = release([(true, false)])[0].unwrap();
    assert!(front.0 < 0.0 && front.0 == front.1, "{front:?}");
    let back = release([(false, true)])[0].unwrap();
    assert!(back.0 > 0.0 && back.0 == back.1, "{back:?}");
    assert_eq!(release([(true, true)]), [Some((0.0, 0.0))], "there is no way out");
    assert_eq!(release([(true, false), (false, false)])[1], None, "the reflex has no memory of the contact");
}

#[test]
fn a_reflex_without_a_robot_model_stops_the_robot() {
    fn stops<M: ReactiveModel>() {
        let mut model = Fixture::<ReactiveBlock<M>>::new();
        model.tick();
        model.set("rules", rules());
        model.tick();
        let sent = model.sent::<Reflex>("reflex");
        assert!(!sent.is_empty(), "{}", M::NAME);
        assert!(sent.iter().all(|sent| sent.action.arguments[..2] == [0.0, 0.0]), "{}: {sent:?}", M::NAME);
    }
    stops::<AvoidObstacleModel>();
    stops::<AvoidWallModel>();
    stops::<BumperReleaseModel>();
    stops::<GiveWayModel>();
    stops::<KeepWallModel>();
}

/// The wheels after each tenth of a second of an action that the reflex renews as long as it is pressed.
fn released(presses: impl IntoIterator<Item = bool>) -> Vec<f64> {
    let mut execute = Fixture::<ExecuteBlock<DifferentialActions>>::new();
    let one = |pressed: bool| {
        execute.advance(100_000_000);
        execute.set("robot", pioneer());
        if pressed {
            let release = Release { left: -1.5, right: -1.5, duration: 0.8, time_limit: 3.0 };
            execute.push("reflexes", Reflex { action: ReleaseBumper::request(release), rank: 2 });
        }
        execute.tick();
        execute.output::<WheelSpeeds>("wheels").map_or(0.0, |wheels| wheels.left)
    };
    presses.into_iter().map(one).collect()
}

#[test]
fn the_action_drives_on_after_the_release_and_stands_when_stuck() {
    let after = released(std::iter::once(true).chain([false; 7]));
    assert!(after.iter().all(|left| *left == -1.5), "0.12 m at 0.15 m/s take 0.8 s: {after:?}");
    let stuck = released([true; 50]);
    let tried = stuck.iter().take_while(|left| **left == -1.5).count();
    assert!((29..=32).contains(&tried), "three seconds, not {tried} tenths");
    assert!(stuck[tried..].iter().all(|left| *left == 0.0), "it stands: {stuck:?}");
}

#[test]
fn silent_bumpers_release_no_robot() {
    let mut model = Fixture::<ReactiveBlock<BumperReleaseModel>>::new();
    model.set("robot", pioneer());
    model.set("rules", rules());
    model.set("bumper", Bumper { front: true.into(), back: false.into() });
    model.advance(300_000_000);
    assert_eq!(wheels(&mut model, "ReleaseBumper"), None);
}

/// The Pioneer's sonars in a room that is nothing but walls: lines with a normal that points to the robot's side, all in the frame
/// of the robot's middle: `x * normal.0 + y * normal.1 = distance`.
fn scan(walls: &[((f64, f64), f64)]) -> SonarScan {
    let robot = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    let placements = robot.sonar["vrep"].placements.iter();
    let placements: Vec<_> = placements
        .map(|[x, y, degrees]| SonarPlacement { x: *x, y: *y, theta: degrees.to_radians() })
        .collect();
    let echo = |placement: &SonarPlacement| {
        let ranges = walls.iter().filter_map(|((across, towards), distance)| {
            let aside = math::angle_between(placement.theta, math::atan2(*towards, *across)).abs();
            let range = distance - placement.x * across - placement.y * towards;
            (aside < 0.35).then_some(range)
        });
        let range = ranges.fold(1.0, math::min);
        Echo { range, heard: Bool::from(range < 1.0) }
    };
    let echoes: Vec<_> = placements.iter().map(echo).collect();
    SonarScan {
        field_of_view: std::f64::consts::FRAC_PI_6,
        range_min: 0.0,
        range_max: 1.0,
        placements: Sequence::new(&placements),
        echoes: Sequence::new(&echoes),
    }
}

/// A robot that keeps a wall so far to its left.
fn along(distance: f64) -> Fixture<ReactiveBlock<KeepWallModel>> {
    let mut model = Fixture::new();
    let mut rules = rules();
    rules.keep_wall.wall_distance = distance;
    model.set("rules", rules);
    model.set("robot", pioneer());
    model
}

/// How fast the robot goes, and how fast it turns to the left, in the wheels' radians per second.
fn motion(model: &mut Fixture<ReactiveBlock<KeepWallModel>>, scan: SonarScan) -> Option<(f64, f64)> {
    model.set("sonar", scan);
    wheels(model, "KeepWall").map(|(left, right)| ((left + right) / 2.0, right - left))
}

const LEFT: (f64, f64) = (0.0, 1.0);
const RIGHT: (f64, f64) = (0.0, -1.0);
const AHEAD: (f64, f64) = (1.0, 0.0);

#[test]
fn a_wall_is_kept_at_its_distance_on_either_side() {
    for (wall, distance, turn) in [(LEFT, 0.5, 1.0), (RIGHT, -0.5, -1.0)] {
        let mut model = along(distance);
        let (speed, straight) = motion(&mut model, scan(&[(wall, 0.5)])).unwrap();
        assert!(speed > 1.0 && straight.abs() < 1e-9, "{speed} {straight}");
        let (_, nearer) = motion(&mut model, scan(&[(wall, 0.7)])).unwrap();
        assert!(nearer * turn > 0.5, "{nearer}");
        let (_, farther) = motion(&mut model, scan(&[(wall, 0.35)])).unwrap();
        assert!(farther * turn < -0.5, "{farther}");
        // A robot that looks 0.2 rad towards its wall turns back, at the right distance from it.
        let askew = (math::sin(0.2), turn * math::cos(0.2));
        let (_, back) = motion(&mut model, scan(&[(askew, 0.5)])).unwrap();
        assert!(back * turn < -0.5, "{back}");
        // What stands ahead it turns away from, and then goes along that.
        let (slower, away) = motion(&mut model, scan(&[(wall, 0.5), (AHEAD, 0.6)])).unwrap();
        assert!(slower < speed && away * turn < -1.0, "{slower} {away}");
    }
}

#[test]
fn robot_drives_an_arc_around_end_of_wall() {
    let mut model = along(0.5);
    assert_eq!(motion(&mut model, scan(&[])), None, "no wall");
    // The wall is beside the hindmost sonar only.
    let mut ending = scan(&[(LEFT, 0.5)]);
    let mut echoes: Vec<_> = ending.echoes.iter().copied().collect();
    echoes[0] = Echo { range: 1.0, heard: false.into() };
    ending.echoes = Sequence::new(&echoes);
    let (speed, turn) = motion(&mut model, ending).unwrap();
    // The circle round the end has the distance as its radius: v = w * r.
    let chassis = pioneer().chassis;
    let (linear, angular) = (speed * chassis.wheel_radius, turn * chassis.wheel_radius / chassis.track);
    assert!((0.45..0.62).contains(&(linear / angular)), "{linear} {angular}");
    let duration = model.sent::<Reflex>("reflex").last().unwrap().action.arguments[2];
    assert_eq!(duration, 4.0, "the action lasts beyond the wall");
    assert_eq!(motion(&mut model, scan(&[])), None, "the reflex has no memory of the wall");
    echoes[3].range = f64::NAN;
    ending.echoes = Sequence::new(&echoes);
    assert_eq!(motion(&mut model, ending), Some((0.0, 0.0)), "sonars that fail stop the robot");
}

#[test]
fn a_silent_sensor_stops_every_reflex_that_reads_it() {
    let rules = rules();
    macro_rules! stops {
        ($model:ty, $kind:literal) => {
            let mut model = Fixture::<ReactiveBlock<$model>>::new();
            model.set("robot", pioneer());
            model.set("rules", rules);
            model.set("sonar", scan(&[]));
            assert_eq!(wheels(&mut model, $kind), None, "{}: nothing is near", $kind);
            model.advance(300_000_000);
            let stopped = wheels(&mut model, $kind).map(|(left, right)| (left + 0.0, right + 0.0));
            assert_eq!(stopped, Some((0.0, 0.0)), "{}: it stands", stringify!($model));
        };
    }
    stops!(AvoidWallModel, "AvoidObstacle");
    stops!(KeepWallModel, "KeepWall");
    // These wheels follow an angle.
    let mut give_way = Fixture::<ReactiveBlock<GiveWayModel>>::new();
    give_way.set("robot", pioneer());
    give_way.set("rules", rules);
    give_way.tick();
    let stop = give_way.sent::<Reflex>("reflex").last().unwrap().action;
    assert_eq!(&stop.arguments[..3], [0.0, 0.0, 0.0], "sonars that have not measured yet are as bad");
}

#[test]
fn reflexes_without_rules_stop_the_robot() {
    macro_rules! stops {
        ($model:ty, $wheels:expr, $sensor:literal, $value:expr) => {
            let mut model = Fixture::<ReactiveBlock<$model>>::new();
            model.set("robot", pioneer());
            model.set($sensor, $value);
            model.tick();
            let sent = model.sent::<Reflex>("reflex");
            let wheels = sent.last().map(|reflex| $wheels.map(|at: usize| reflex.action.arguments[at] + 0.0));
            assert_eq!(wheels, Some([0.0, 0.0]), "{}", stringify!($model));
        };
    }
    stops!(KeepWallModel, [0, 1], "sonar", scan(&[(LEFT, 0.5)]));
    stops!(GiveWayModel, [1, 2], "sonar", scan(&[]));
    stops!(BumperReleaseModel, [0, 1], "bumper", Bumper { front: true.into(), back: false.into() });
}

/// The wheels of a robot with these rules whose front bumper is pressed.
fn released_by(rules: WheeledRules) -> (f64, f64) {
    let mut model = Fixture::<ReactiveBlock<BumperReleaseModel>>::new();
    model.set("robot", pioneer());
    model.set("rules", rules);
    model.set("bumper", Bumper { front: true.into(), back: false.into() });
    wheels(&mut model, "ReleaseBumper").unwrap()
}

#[test]
fn every_reflex_follows_its_rules_in_knowledge() {
    let params = WheeledKnowledgeParams {
        wall_distance: -0.5,
        wall_velocity: 0.1,
        max_wall_range: 0.6,
        release_velocity: 0.3,
        ..WheeledKnowledgeParams::default()
    };
    let changed = params.rules();
    let (before, after) = (released_by(rules()), released_by(changed));
    assert!((after.0 - 2.0 * before.0).abs() < 1e-9, "twice as fast: {before:?} {after:?}");
    let mut model = Fixture::<ReactiveBlock<KeepWallModel>>::new();
    model.set("robot", pioneer());
    model.set("rules", changed);
    assert_eq!(motion(&mut model, scan(&[(LEFT, 0.5)])), None, "it is on the other side");
    let (speed, turn) = motion(&mut model, scan(&[(RIGHT, 0.5)])).unwrap();
    let chassis = pioneer().chassis;
    assert!((speed * chassis.wheel_radius - 0.1).abs() < 1e-9 && turn.abs() < 1e-9, "{speed} {turn}");
    assert_eq!(motion(&mut model, scan(&[(RIGHT, 0.85)])), None, "too far away by the rule");
    model.set("rules", rules());
    assert!(motion(&mut model, scan(&[(LEFT, 0.5)])).is_some(), "rules hold from the next tick on");
}

#[test]
fn a_scan_of_nan_passes_no_monitor_and_stops_the_authors_law() {
    let mut invalid = scan(&[(AHEAD, 0.2)]);
    let echoes = [Echo { range: f64::NAN, heard: true.into() }; 16];
    invalid.echoes = Sequence::new(&echoes);
    let mut monitor = Fixture::<MonitorBlock<RangeMonitor>>::new();
    monitor.set("sonar", invalid);
    monitor.tick();
    assert!(!monitor.wrote("percept"));
    monitor.set("sonar", scan(&[(AHEAD, 0.2)]));
    monitor.tick();
    assert!(monitor.wrote("percept"));
    let mut law = Fixture::<ReactiveBlock<AvoidWallModel>>::new();
    law.set("robot", pioneer());
    law.set("sonar", invalid);
    law.tick();
    let stop = law.sent::<Reflex>("reflex").last().unwrap().action;
    assert_eq!(&stop.arguments[..3], [0.0, 0.0, 0.0]);
}

#[test]
fn a_monitor_takes_sonar_limits_and_mounts_from_the_robot_model() {
    let mut robot = pioneer();
    let sonar = Device { minimum: 0.1, maximum: 1.0, name: Text::new("sonar"), ..Device::default() };
    robot.robot.sensors = Sequence::new(&[sonar]);
    let mut monitor = Fixture::<MonitorBlock<RangeMonitor>>::new();
    let mut echo = |robot: Option<WheeledModel>, range: f64| {
        if let Some(robot) = robot {
            monitor.set("robot", robot);
        }
        let echoes = Sequence::new(&[Echo { range, heard: true.into() }; 16]);
        let measured = SonarScan { placements: Sequence::default(), echoes, ..scan(&[]) };
        monitor.set("sonar", measured);
        monitor.tick();
        let percept = monitor.wrote("percept").then(|| monitor.output::<SonarScan>("percept").unwrap());
        percept.map(|scan| (scan.placements, scan.echoes[3].range, scan.echoes[3].heard.get()))
    };
    assert_eq!(
        echo(None, 0.5),
        None,
        "sonars without mounts measure nothing, while the robot model is unknown"
    );
    let mounts = robot.sonars;
    assert_eq!(mounts.len(), 16);
    assert_eq!(echo(Some(robot), 0.5), Some((mounts, 0.5, true)));
    assert_eq!(echo(None, 1.2), Some((mounts, 1.0, false)), "no echo comes from beyond the maximum range");
    assert_eq!(echo(None, 0.04), Some((mounts, 0.1, true)), "what is nearer than the minimum range is there");
}

#[test]
fn a_median_over_time_drops_single_echoes_of_sonars_that_err() {
    let mut sonar = Fixture::<SensorBlock<MedianSonar>>::new();
    let mut measure = |accuracy: Option<f64>, range: f64| {
        if let Some(sonar_outliers) = accuracy {
            sonar.set("accuracy", SensorAccuracy { sonar_outliers, ..SensorAccuracy::default() });
        }
        sonar.set("source", scan(&[(AHEAD, range)]));
        sonar.tick();
        sonar.output::<SonarScan>("value").unwrap().echoes[3]
    };
    let near = measure(None, 0.4);
    assert!(near.heard.get(), "exact sonars pass as they are");
    for _ in 0..5 {
        assert!(near.range >= measure(Some(0.01), 0.4).range);
    }
    let crosstalk = measure(None, 0.1);
    assert_eq!(crosstalk.range, near.range, "one echo does not count");
    measure(None, 0.1);
    assert!(measure(None, 0.1).range < near.range, "three of five do");
}

/// `examples/reflexes`, one run.
fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../examples/reflexes/reflexes.toml");
    let configuration = Configuration::load(file, &options).unwrap();
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin()];
    Agent::load(&configuration, &plugins, Options { rate: Rate::Max, armed: true, ..Options::default() })
        .unwrap()
}

fn value(agent: &Agent, path: &str) -> Option<Value> {
    agent.board().read(path).unwrap().map(|(value, _)| value)
}

fn text(agent: &Agent, path: &str) -> String {
    value(agent, path).as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
}

fn number(agent: &Agent, path: &str) -> f64 {
    value(agent, path).and_then(|value| value.as_f64()).unwrap_or_default()
}

/// A cycle in which another action runs than in the one before.
#[derive(Debug)]
struct Change {
    from: String,
    to: String,
    /// How many actions were cancelled in it.
    cancelled: f64,
}

#[test]
fn a_higher_rank_preempts_a_lower_one_which_then_continues() {
    // R1 is careless, and comes from behind.
    let mut agent = agent(&["agent.seed=2", "world.robots.r1.script.clearance=0.02"]);
    let rank = |action: &str| match action {
        "ReleaseBumper" => 3,
        "AvoidObstacle" => 2,
        "KeepWall" => 1,
        _ => 0,
    };
    let (mut changes, mut pressed, mut waited) = (Vec::<Change>::new(), 0, 0);
    let (mut last, mut cancelled) = (String::new(), 0.0);
    loop {
        // What presses at the end of a cycle is felt in the next one.
        let presses = ["front", "back"].map(|side| {
            value(&agent, &format!("simulator/r2/bumper/{side}"))
                .and_then(|value| value.as_bool())
                .unwrap_or(false)
        });
        agent.step();
        let running = text(&agent, "r2/execute/status/running");
        let now = number(&agent, "r2/execute/status/cancelled");
        if running != last {
            changes.push(Change { from: last.clone(), to: running.clone(), cancelled: now - cancelled });
        }
        if running == "ReleaseBumper" {
            // Others want the robot all the while, and wait.
            waited += usize::from(number(&agent, "r2/execute/status/high") >= 1.0);
            let command = number(&agent, "r2/wheels/command/left");
            let into = match presses {
                [true, false] => command > 0.0,
                [false, true] => command < 0.0,
                _ => false,
            };
            assert!(!into, "it goes on into what presses: {command}");
        }
        if presses != [false, false] {
            pressed += 1;
            assert_eq!(running, "ReleaseBumper", "it is pressed at {} s", agent.now() as f64 * 1e-9);
        }
        (last, cancelled) = (running, now);
        match text(&agent, "referee/verdict/state").as_str() {
            "" | "RUNNING" => {}
            state => break assert_eq!(state, "SUCCEEDED", "the round is finished"),
        }
    }
    let between =
        |from: &str, to: &str| changes.iter().filter(|change| change.from == from && change.to == to).count();
    assert!(pressed > 5 && waited > 5, "{pressed} {waited}");
    // Upwards, the one that runs is cancelled at once.
    assert!(between("KeepWall", "AvoidObstacle") > 0, "{changes:?}");
    assert!(
        between("AvoidObstacle", "ReleaseBumper") + between("KeepWall", "ReleaseBumper") > 0,
        "{changes:?}"
    );
    for change in
        changes.iter().filter(|change| !change.from.is_empty() && rank(&change.to) > rank(&change.from))
    {
        assert!(change.cancelled >= 1.0, "{change:?}");
    }
    // Downwards, the lower one that waited continues.
    assert!(between("AvoidObstacle", "KeepWall") > 0, "{changes:?}");
    let released = changes.iter().filter(|change| change.from == "ReleaseBumper");
    assert!(released.map(|change| rank(&change.to)).all(|rank| (1..3).contains(&rank)), "{changes:?}");
}

/// In how many cycles of a round obstacles are avoided while another reflex waits.
fn waits_for_avoidance(sets: &[&str]) -> usize {
    let mut agent = agent(sets);
    let waits = (0..3200).filter(|_| {
        agent.step();
        let avoids = text(&agent, "r2/execute/status/running") == "AvoidObstacle";
        avoids && number(&agent, "r2/execute/status/high") >= 1.0
    });
    waits.count()
}

/// Mean distance from the walls of the room in four seconds, twelve seconds after a wall distance was set.
fn kept_distance(set: Option<f64>) -> f64 {
    let mut agent = agent(&["agent.seed=0"]);
    for _ in 0..100 {
        agent.step();
    }
    if let Some(distance) = set {
        agent.board().write("r2/knowledge/params/wall_distance", &Value::Float(distance), 0).unwrap();
    }
    for _ in 0..600 {
        agent.step();
    }
    let distance = |_| {
        agent.step();
        let [x, y] = ["x", "y"].map(|axis| number(&agent, &format!("simulator/r2/truth/{axis}")).abs());
        2.5 - math::max(x, y)
    };
    (0..200).map(distance).sum::<f64>() / 200.0
}

#[test]
fn the_wall_distance_changes_while_the_robot_drives() {
    let (usual, farther) = (kept_distance(None), kept_distance(Some(0.7)));
    assert!(farther > usual + 0.1, "{usual} {farther}");
}

#[test]
fn ranks_can_be_turned_round_by_configuration() {
    assert!(waits_for_avoidance(&["agent.seed=0"]) > 100);
    // Above avoidance, the wall is kept whatever stands in the way.
    let turned = "robots.r2.modules.keep_wall.inputs.rank={ rank = 1 }";
    assert_eq!(waits_for_avoidance(&["agent.seed=0", turned]), 0);
}

//! Reflexes of different ranks: what each does, and who has the robot when several want it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Bumper, Echo, Orientation, Point2, Position, SonarPlacement, SonarScan};
use slate::mapek::{ReactiveBlock, Reflex};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, math};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate::sim::robot::RobotDescription;
use slate_wheeled::bumper_release::BumperReleaseModel;
use slate_wheeled::keep_wall::{KeepWallModel, KeepWallParams};
use slate_wheeled::knowledge::WheeledModel;

fn pioneer() -> WheeledModel {
    WheeledModel::load("pioneer_p3dx", "vrep").unwrap()
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
    let react = |(front, back): (bool, bool)| {
        model.advance(100_000_000);
        model.set("bumper", Bumper { front: front.into(), back: back.into() });
        wheels(&mut model, "ReleaseBumper")
    };
    presses.into_iter().map(react).collect()
}

#[test]
fn who_is_pressed_backs_away_from_there_and_a_bit_farther() {
    let front = release([(true, false)])[0].unwrap();
    assert!(front.0 < 0.0 && front.0 == front.1, "{front:?}");
    let back = release([(false, true)])[0].unwrap();
    assert!(back.0 > 0.0 && back.0 == back.1, "{back:?}");
    assert_eq!(release([(true, true)]), [Some((0.0, 0.0))], "there is no way out");
    assert_eq!(release([(false, false)]), [None]);
    // 0.12 m at 0.15 m/s take 0.8 s.
    let after = release([(true, false)].into_iter().chain([(false, false); 12]));
    let away = after.iter().take_while(|wheels| **wheels == Some(front)).count();
    assert!((8..=9).contains(&away), "{after:?}");
    assert!(after[away..].iter().all(Option::is_none), "{after:?}");
}

#[test]
fn a_release_that_does_not_help_ends_until_nothing_presses() {
    let stuck = release([(true, false); 50]);
    let tried = stuck.iter().take_while(|wheels| wheels.is_some()).count();
    assert!((30..=32).contains(&tried), "three seconds, not {tried} tenths");
    assert!(stuck[tried..].iter().all(Option::is_none));
    let again = [(true, false); 50].into_iter().chain([(false, false); 12]).chain([(true, false)]);
    assert!(release(again).last().unwrap().is_some(), "free meanwhile, it is a new beginning");
}

#[test]
fn bumpers_that_say_nothing_release_nobody() {
    let mut model = Fixture::<ReactiveBlock<BumperReleaseModel>>::new();
    model.set("robot", pioneer());
    model.set("bumper", Bumper { front: true.into(), back: false.into() });
    model.expire("bumper");
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

/// A robot at (1, 2) that looks north and keeps a wall so far to its left.
fn along(distance: f64) -> Fixture<ReactiveBlock<KeepWallModel>> {
    let params = KeepWallParams { wall_distance: distance, ..KeepWallParams::default() };
    let mut model = Fixture::with(params).unwrap();
    model.set("robot", pioneer());
    model.set("position", Position { x: 1.0, y: 2.0, z: 0.0 });
    model.set("orientation", Orientation { theta: std::f64::consts::FRAC_PI_2 });
    model.set("goal", Point2 { x: 7.0, y: 8.0 });
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
        let heading = model.output::<Point2>("local_goal").unwrap();
        assert!((heading.x - 1.0).abs() < 1e-9 && heading.y > 2.1, "ahead, along the wall: {heading:?}");
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
fn where_the_wall_ends_it_goes_round_the_end_and_then_gives_up() {
    let mut model = along(0.5);
    let nothing = scan(&[]);
    assert_eq!(motion(&mut model, nothing), None, "there was none");
    let heading = model.output::<Point2>("local_goal").unwrap();
    assert_eq!((heading.x, heading.y), (7.0, 8.0), "without a wall it heads for its goal");
    assert!(motion(&mut model, scan(&[(LEFT, 0.5)])).is_some());
    let (speed, turn) = motion(&mut model, nothing).unwrap();
    // The circle round the end has the distance as its radius: v = w * r.
    let chassis = pioneer().chassis;
    let (linear, angular) = (speed * chassis.wheel_radius, turn * chassis.wheel_radius / chassis.track);
    assert!((0.45..0.62).contains(&(linear / angular)), "{linear} {angular}");
    model.advance(5_000_000_000);
    model.set("position", Position { x: 1.0, y: 2.0, z: 0.0 });
    model.set("orientation", Orientation { theta: 0.0 });
    assert_eq!(motion(&mut model, nothing), None);
    let numbers = scan(&[(LEFT, f64::NAN)]);
    assert_eq!(motion(&mut model, numbers), None, "no number is no wall");
}

/// `examples/reflexes`, one run.
fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report", "controller", "pace", "planner"].map(Into::into).to_vec(),
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
    // Downwards, the lower one that waited goes on.
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

#[test]
fn ranks_can_be_turned_round_by_configuration() {
    assert!(waits_for_avoidance(&["agent.seed=0"]) > 100);
    // Above avoidance, the wall is kept whatever stands in the way.
    let turned = "robots.r2.modules.keep_wall.inputs.rank={ rank = 1 }";
    assert_eq!(waits_for_avoidance(&["agent.seed=0", turned]), 0);
}

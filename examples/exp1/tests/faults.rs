//! What EXP1's robot does when its sensors lie, stop, hang or crash, and when its own blocks do: the wheels stand
//! still or go on safely, and the robot comes back and reaches its goal.
#![allow(clippy::panic, clippy::unwrap_used, clippy::nonminimal_bool, reason = "a test that fails panics")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use slate::blackboard::Board;
use slate::blackboard::interface::Value;
use slate::interfaces::{Echo, Orientation, Position, SonarScan};
use slate::module::Plugin;
use slate::prelude::*;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Control, Cycle, End, Mode, Options, Rate};
use slate_wheeled::avoid_obstacle::{AvoidObstacleModel, AvoidObstacleSensors};
use slate_wheeled::go_to_origin::{GoToOriginPlanner, GoToOriginPorts};

/// What stands between the simulator and the robot.
#[ports]
struct TroubleIo {
    position_in: Input<Position>,
    orientation_in: Input<Orientation>,
    sonar_in: Input<SonarScan>,
    position: Output<Position>,
    orientation: Output<Orientation>,
    sonar: Output<SonarScan>,
}

/// What goes wrong, and when.
#[params]
struct TroubleParams {
    #[param(default = 0, doc = "what goes wrong: see `Trouble`")]
    kind: u64,
    #[param(default = 2.0, unit = "s", doc = "when it begins")]
    from: f64,
    #[param(default = 4.0, unit = "s", doc = "when it ends")]
    until: f64,
}

const NAN_POSITION: u64 = 1;
const NAN_ORIENTATION: u64 = 2;
const NAN_SONAR: u64 = 3;
const SILENT: u64 = 4;
const PANICKING: u64 = 5;
const HANGING: u64 = 6;
const SILENT_SONAR: u64 = 7;
const SILENT_POSITION: u64 = 8;
const SILENT_ORIENTATION: u64 = 9;

/// Passes on what the sensors say, until something goes wrong.
struct Trouble;

#[module(stage = SensorAcquire)]
impl Module for Trouble {
    type Io = TroubleIo;
    type Params = TroubleParams;
    type State = bool;

    fn tick(happened: &mut bool, io: &TroubleIo, params: &TroubleParams, now: &Tick) -> Outcome {
        let (mut position, mut orientation, mut scan) = (
            io.position_in.get().copied().unwrap_or_default(),
            io.orientation_in.get().copied().unwrap_or_default(),
            io.sonar_in.get().copied().unwrap_or_default(),
        );
        let kind = if (params.from..params.until).contains(&now.seconds()) { params.kind } else { 0 };
        match kind {
            NAN_POSITION => position.x = f64::NAN,
            NAN_ORIENTATION => orientation.theta = f64::NAN,
            NAN_SONAR => {
                let echo = Echo { range: f64::NAN, heard: true.into() };
                scan.echoes = Sequence::new(&[echo; 16]);
            }
            SILENT => return Outcome::Ok,
            PANICKING if now.number().is_multiple_of(40) => panic!("as the test wants"),
            PANICKING => return Outcome::Ok,
            HANGING if !std::mem::replace(happened, true) => std::thread::sleep(Duration::from_millis(600)),
            _ => {}
        }
        if kind != SILENT_POSITION {
            io.position.set(position);
        }
        if kind != SILENT_ORIENTATION {
            io.orientation.set(orientation);
        }
        if kind != SILENT_SONAR {
            io.sonar.set(scan);
        }
        Outcome::Ok
    }
}

/// When a block of the robot goes wrong.
#[params]
struct CrashParams {
    #[param(default = 0, doc = "panics in that run of the block; 0 for never")]
    panic_at: u64,
    #[param(default = 0, doc = "panics when a plan is needed after so many changes of route; 0 for never")]
    panic_when_needed: u64,
    #[param(default = 0, doc = "hangs in that run of the block; 0 for never")]
    hang_at: u64,
}

impl CrashParams {
    fn strike(&self, now: &Tick) {
        assert!(now.number() != self.panic_at, "as the test wants");
        if now.number() == self.hang_at {
            std::thread::sleep(Duration::from_millis(600));
        }
    }
}

/// Whether the planner has crashed when it was needed; it does so once.
static CRASHED: AtomicBool = AtomicBool::new(false);

/// EXP1's planner, which crashes.
struct CrashingPlanner;

impl Plan for CrashingPlanner {
    const NAME: &'static str = "crashing_planner";
    type Noticed = GoToOriginPorts;
    type Params = CrashParams;
    type State = <GoToOriginPlanner as Plan>::State;

    fn run(
        memory: &mut Self::State,
        noticed: &GoToOriginPorts,
        situation: &Situation<'_>,
        params: &CrashParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        params.strike(now);
        // Its memory is lost in the moment in which it is needed.
        let after = params.panic_when_needed;
        let needed = after > 0 && situation.route_switches == after && situation.needs_plan();
        assert!(!(needed && !CRASHED.swap(true, Ordering::Relaxed)), "as the test wants");
        GoToOriginPlanner::run(memory, noticed, situation, &Default::default(), now, plan);
    }
}

/// EXP1's reflex, which crashes.
struct CrashingReflex;

impl ReactiveModel for CrashingReflex {
    const NAME: &'static str = "crashing_reflex";
    type Sensors = AvoidObstacleSensors;
    type Params = CrashParams;
    type State = <AvoidObstacleModel as ReactiveModel>::State;

    fn run(
        avoider: &mut Self::State,
        sensors: &AvoidObstacleSensors,
        params: &CrashParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        params.strike(now);
        AvoidObstacleModel::run(avoider, sensors, &Default::default(), now)
    }
}

/// EXP1 with the troublemaker between simulator and robot.
fn agent(sets: &[&str]) -> Agent {
    agent_in(STAGED, sets)
}

fn agent_in((mode, rate): (Mode, Rate), sets: &[&str]) -> Agent {
    let mut links = String::new();
    for sensor in ["position", "orientation", "sonar"] {
        links += &format!(
            "\"trouble/{sensor}_in\" = \"simulator/r2/{sensor}\"\n\"r2/{sensor}/source\" = \"trouble/{sensor}\"\n"
        );
    }
    let text =
        slate_exp1::CONFIGURATION.replacen("[links]\n", &format!("[modules.trouble]\n[links]\n{links}"), 1);
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("exp1.toml", &text, &options).unwrap();
    let plugins = [
        slate::sim::plugin(),
        slate_wheeled::plugin(),
        Plugin::linked::<Trouble>(),
        slate::mapek::plan::<CrashingPlanner>().into(),
        slate::mapek::reactive::<CrashingReflex>().into(),
        slate::mapek::actuator::<FailingWheels>().into(),
    ];
    let options = Options { mode, rate, armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins, options).unwrap()
}

fn number(board: &Board, path: &str) -> f64 {
    board.read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap()
}

fn wheels(board: &Board) -> [f64; 2] {
    ["left", "right"].map(|side| number(board, &format!("r2/wheels/command/{side}")))
}

/// The judge's verdict.
fn verdict(board: &Board) -> String {
    let state = board.read("referee/verdict/state").unwrap().map(|(value, _)| value);
    state.as_ref().and_then(Value::as_str).unwrap_or("RUNNING").to_owned()
}

/// Runs to the verdict; every command on the way is finite.
fn finish(agent: &mut Agent) {
    while verdict(agent.board()) == "RUNNING" {
        agent.step();
        assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
    }
    assert_eq!(verdict(agent.board()), "SUCCEEDED", "at {} s", agent.now() as f64 * 1e-9);
    assert_eq!(number(agent.board(), "referee/metrics/collisions_caused"), 0.0);
}

/// The robot stands from half a second after the beginning of what goes wrong to its end, and then reaches its goal. By sonars that
/// are right it may still avoid what is near.
fn stands_and_comes_back(kind: u64) {
    for seed in 0..5 {
        let mut agent =
            agent(&[&format!("modules.trouble.params.kind={kind}"), &format!("agent.seed={seed}")]);
        let mut moved = false;
        while agent.now() < 3_980_000_000 {
            agent.step();
            let (now, wheels) = (agent.now(), wheels(agent.board()));
            assert!(wheels.iter().all(|speed| speed.is_finite()), "{wheels:?} at {now}");
            moved |= wheels != [0.0; 2];
            if now > 2_500_000_000 {
                let avoids = matches!(kind, NAN_POSITION | NAN_ORIENTATION)
                    && tree(&agent).starts_with("AvoidObstacle");
                assert!(avoids || wheels == [0.0; 2], "{wheels:?}, kind {kind}, seed {seed}, at {now} ns");
            }
        }
        assert!(moved, "it drove before");
        finish(&mut agent);
    }
}

#[test]
fn without_trouble_the_detour_changes_nothing() {
    finish(&mut agent(&[]));
}

#[test]
fn a_position_that_is_not_a_number_stops_the_wheels() {
    stands_and_comes_back(NAN_POSITION);
}

#[test]
fn an_orientation_that_is_not_a_number_stops_the_wheels() {
    stands_and_comes_back(NAN_ORIENTATION);
}

#[test]
fn sensors_that_stop_stop_the_wheels() {
    stands_and_comes_back(SILENT);
}

#[test]
fn sonars_that_stop_stop_the_wheels() {
    stands_and_comes_back(SILENT_SONAR);
}

/// What Execute runs.
fn tree(agent: &Agent) -> String {
    let tree = agent.board().read("r2/execute/status/tree").unwrap().map(|(value, _)| value);
    tree.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// When the first turn of a reflex begins that takes longer than a second, seconds.
fn first_long_turn(seed: u64) -> Option<f64> {
    let mut agent = agent(&[&format!("agent.seed={seed}")]);
    let mut since = None;
    while verdict(agent.board()) == "RUNNING" {
        agent.step();
        let now = agent.now() as f64 * 1e-9;
        let start = if tree(&agent) == "AvoidObstacle > TurnAngle" { since.or(Some(now)) } else { None };
        since = start;
        if start.is_some_and(|start| now - start > 1.0) {
            return start;
        }
    }
    None
}

#[test]
fn a_reflex_turns_while_position_or_orientation_is_silent() {
    let turns: Vec<_> = (0..20).filter_map(|seed| Some((seed, first_long_turn(seed)?))).take(3).collect();
    assert_eq!(turns.len(), 3, "{turns:?}");
    for (kind, (seed, start)) in [SILENT_POSITION, SILENT_ORIENTATION]
        .into_iter()
        .flat_map(|kind| turns.iter().map(move |turn| (kind, *turn)))
    {
        let mut agent = agent(&[
            &format!("modules.trouble.params.kind={kind}"),
            &format!("modules.trouble.params.from={:.2}", start - 0.1),
            &format!("modules.trouble.params.until={:.2}", start + 3.0),
            &format!("agent.seed={seed}"),
        ]);
        // The pose is unknown 0.2 s after the last measurement, and the last one counts for 0.1 s more.
        while agent.now() < ((start + 0.3) * 1e9) as u64 {
            agent.step();
        }
        let [left, right] = wheels(agent.board());
        let runs = tree(&agent);
        let says = format!("kind {kind}, seed {seed}: {runs}, {left} and {right} rad/s");
        assert!(runs == "AvoidObstacle > TurnAngle" && left == -right && left != 0.0, "{says}");
        while tree(&agent) == "AvoidObstacle > TurnAngle" {
            agent.step();
        }
        assert_eq!(tree(&agent), "AvoidObstacle > SetWheelSpeed", "{says}");
        finish(&mut agent);
    }
}

/// A fault of R2 that lasts from 2.5 s on.
fn fault(sensor: &str, kind: &str) -> String {
    format!("world.faults.f={{ robot = \"r2\", sensor = {sensor:?}, kind = {kind:?}, from = 2.5 }}")
}

#[test]
fn encoders_that_stop_stop_the_wheels_of_every_controller() {
    for variant in ["controller=slate", "controller=rocs-fixed", "planner=local"] {
        let mut agent = agent(&[&fault("odometry", "silent"), variant, "agent.seed=1"]);
        let mut moved = false;
        while agent.now() < 8_000_000_000 {
            agent.step();
            let (now, wheels) = (agent.now(), wheels(agent.board()));
            moved |= wheels != [0.0; 2];
            // A reflex of the authors' law still turns away from what is near.
            let avoids = tree(&agent).starts_with("AvoidObstacle") && variant == "controller=rocs-fixed";
            assert!(
                now < 3_500_000_000 || avoids || wheels == [0.0; 2],
                "{wheels:?}, {variant}, at {now} ns"
            );
        }
        assert!(moved, "it drove before");
    }
}

/// With these settings, R2 stands after 12 s and has touched nothing.
fn stands(sets: &[&str]) {
    let mut agent = agent(sets);
    while agent.now() < 12_000_000_000 {
        agent.step();
    }
    assert_eq!(verdict(agent.board()), "RUNNING", "{sets:?}");
    assert_eq!(wheels(agent.board()), [0.0; 2], "{sets:?}");
    assert_eq!(number(agent.board(), "referee/metrics/collisions_caused"), 0.0, "{sets:?}");
}

#[test]
fn frozen_sonars_stop_the_wheels() {
    for seed in 0..8 {
        stands(&[&fault("sonar", "frozen"), &format!("agent.seed={seed}")]);
    }
}

#[test]
fn a_frozen_position_compass_or_odometry_stops_the_wheels() {
    for sensor in ["position", "orientation", "odometry"] {
        stands(&[&fault(sensor, "frozen"), "agent.seed=1"]);
    }
}

#[test]
fn sonars_and_odometry_that_freeze_together_stop_the_wheels() {
    let odometry = fault("odometry", "frozen").replace("faults.f", "faults.g");
    for seed in 0..3 {
        stands(&[&fault("sonar", "frozen"), &odometry, &format!("agent.seed={seed}")]);
    }
}

#[test]
fn a_monitor_and_the_robot_model_tell_of_a_stopped_sensor() {
    let kind = format!("modules.trouble.params.kind={SILENT_SONAR}");
    let mut agent = agent(&[&kind, "agent.seed=1"]);
    let text = |agent: &Agent, path: &str| {
        agent.board().read(path).unwrap().and_then(|(value, _)| value.as_str().map(str::to_owned)).unwrap()
    };
    let sonar = |agent: &Agent| {
        let (sensors, _) = agent.board().read("r2/knowledge/robot/robot/sensors").unwrap().unwrap();
        let Value::List(sensors) = sensors else { panic!("a list of sensors") };
        let of = |sensor: &Value, field: &str| sensor.get(field).and_then(Value::as_str).map(str::to_owned);
        let sonar = sensors.iter().find(|sensor| of(sensor, "name").as_deref() == Some("sonar"));
        of(sonar.unwrap(), "health").unwrap()
    };
    let condition = |agent: &Agent| text(agent, "r2/range_monitor/state/condition");
    for (until, expected) in [
        (1.9, ("FRESH", "WORKING")),
        (2.5, ("LATE", "WORKING")),
        (3.5, ("SILENT", "DEGRADED")),
        (4.5, ("FRESH", "WORKING")),
    ] {
        while agent.now() < (until * 1e9) as u64 {
            agent.step();
        }
        assert_eq!((&*sonar(&agent), &*condition(&agent)), expected, "at {until} s");
    }
}

/// Wheels of the simulator that fail for a time.
struct FailingWheels;

#[ports]
struct FailingPorts {
    #[safe(WheelSpeeds::ZERO)]
    wheels: Output<WheelSpeeds>,
}

#[params]
struct FailingParams {
    #[param(default = false, doc = "panics instead")]
    panics: Bool,
}

impl Actuator for FailingWheels {
    const NAME: &'static str = "failing_wheels";
    type Io = FailingPorts;
    type Params = FailingParams;
    type State = ();
    type Command = WheelSpeeds;
    const SAFE: WheelSpeeds = WheelSpeeds::ZERO;

    fn apply(
        (): &mut (),
        command: &WheelSpeeds,
        io: &FailingPorts,
        params: &FailingParams,
        now: &Tick,
    ) -> Outcome {
        let fails = (2.0..3.0).contains(&now.seconds());
        assert!(!(fails && params.panics.get()), "as the test wants");
        io.wheels.set(*command);
        if fails { Outcome::Degraded } else { Outcome::Ok }
    }
}

/// Steps to a time in seconds; what the RobotModel says of the wheels then.
fn health_of_wheels(agent: &mut Agent, until: f64) -> String {
    while agent.now() < (until * 1e9) as u64 {
        agent.step();
    }
    let (actuators, _) = agent.board().read("r2/knowledge/robot/robot/actuators").unwrap().unwrap();
    let Value::List(actuators) = actuators else { panic!("a list of actuators") };
    let [wheels] = &actuators[..] else { panic!("{actuators:?}") };
    assert_eq!(wheels.get("name").and_then(Value::as_str), Some("wheels"));
    wheels.get("health").and_then(Value::as_str).unwrap().to_owned()
}

#[test]
fn the_robot_model_tells_of_wheels_that_fail() {
    for panics in [false, true] {
        let kind = "robots.r2.modules.motors.kind=failing_wheels";
        let fails = format!("robots.r2.modules.motors.params.panics={panics}");
        let mut agent = agent(&[kind, &fails, "agent.seed=1"]);
        // A block that panics again and again is given up.
        let last = if panics { "FAILED" } else { "READY" };
        for (until, expected) in [(1.9, "READY"), (2.5, "FAILED"), (3.5, last)] {
            assert_eq!(health_of_wheels(&mut agent, until), expected, "{panics}, at {until} s");
        }
    }
}

#[test]
fn the_robot_model_tells_of_a_gate_that_stops() {
    let mut agent = agent(&["agent.seed=1"]);
    assert_eq!(health_of_wheels(&mut agent, 1.0), "READY");
    agent.stop_actuators("the test");
    assert_eq!(health_of_wheels(&mut agent, 1.2), "STOPPED");
    agent.reset();
    assert_eq!(health_of_wheels(&mut agent, 1.4), "DISARMED");
    assert!(agent.arm());
    assert_eq!(health_of_wheels(&mut agent, 1.6), "READY");
    finish(&mut agent);
}

#[test]
fn wheels_without_a_command_are_safe() {
    let mut agent = agent(&["robots.r2.modules.execute.enabled=false"]);
    assert_eq!(health_of_wheels(&mut agent, 1.0), "SAFE");
}

#[test]
fn sensors_that_crash_stop_the_wheels() {
    stands_and_comes_back(PANICKING);
}

#[test]
fn sonars_that_lie_send_no_command_that_is_not_a_number() {
    for kind in [NAN_SONAR, SILENT_SONAR] {
        for seed in 0..5 {
            let sets = [&*format!("modules.trouble.params.kind={kind}"), &*format!("agent.seed={seed}")];
            let mut agent = agent(&sets);
            while verdict(agent.board()) == "RUNNING" {
                agent.step();
                assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
            }
            assert_eq!(verdict(agent.board()), "SUCCEEDED", "kind {kind}, seed {seed}");
        }
    }
}

#[test]
fn trouble_at_any_time_is_survived() {
    for kind in [NAN_POSITION, NAN_ORIENTATION, SILENT, PANICKING] {
        for step in 0..12 {
            let from = f64::from(step) * 0.73;
            let sets = [
                format!("modules.trouble.params.kind={kind}"),
                format!("modules.trouble.params.from={from:.2}"),
                format!("modules.trouble.params.until={:.2}", from + 0.7),
                "agent.seed=1".into(),
            ];
            let mut agent = agent(&sets.each_ref().map(String::as_str));
            while verdict(agent.board()) == "RUNNING" {
                agent.step();
                assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
            }
            assert_eq!(verdict(agent.board()), "SUCCEEDED", "kind {kind} from {from:.2} s");
        }
    }
}

/// Runs under the watchdog, ten times as fast as the wall clock when it has threads; in how many cycles the wheels
/// stood, and how the run ended.
fn run(agent: &mut Agent) -> (u64, End) {
    let stood = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&stood);
    let observer = move |cycle: &Cycle<'_>| {
        let has_command = cycle.board.read("r2/wheels/command/left").unwrap().is_some();
        if has_command && wheels(cycle.board) == [0.0; 2] {
            counter.fetch_add(1, Ordering::Relaxed);
        }
        if verdict(cycle.board) == "RUNNING" { Control::Continue } else { Control::Stop }
    };
    let end = agent.run(Box::new(observer)).unwrap();
    (stood.load(Ordering::Relaxed), end)
}

const STAGED: (Mode, Rate) = (Mode::Staged, Rate::Max);
const THREADED: (Mode, Rate) = (Mode::Threaded, Rate::Times(10.0));

/// Each block that hangs, the settings that make it, and the actuator's command when it hangs.
fn hanging() -> [(&'static str, [String; 2]); 3] {
    let block = |block: &str, plugin: &str, strike: &str| {
        let of = format!("robots.r2.modules.{block}");
        [format!("{of}.kind={plugin}"), format!("{of}.params.{strike}")]
    };
    [
        ("trouble", [format!("modules.trouble.params.kind={HANGING}"), "agent.seed=0".into()]),
        ("r2/planner", block("planner", "crashing_planner", "hang_at=5")),
        ("r2/avoid_obstacle", block("avoid_obstacle", "crashing_reflex", "hang_at=40")),
    ]
}

#[test]
fn who_hangs_in_lockstep_ends_the_run_by_name() {
    for (module, [first, second]) in hanging() {
        let mut agent = agent_in(STAGED, &[&first, &second, "loop.hang=100ms"]);
        let (_, end) = run(&mut agent);
        assert_eq!(end, End::Hung { module: module.into() });
        assert_eq!(verdict(agent.board()), "RUNNING", "no verdict is made up");
    }
}

#[test]
fn who_hangs_on_threads_returns_and_the_goal_is_reached() {
    for (module, [first, second]) in hanging() {
        let mut agent = agent_in(THREADED, &[&first, &second, "loop.hang=100ms"]);
        let (stood, end) = run(&mut agent);
        assert_eq!(end, End::Stopped, "{module}");
        let reached = agent.board().read("referee/metrics/goals_reached").unwrap();
        // While its reflex sleeps, the robot may touch something.
        assert_eq!(reached.and_then(|(value, _)| value.as_f64()), Some(1.0), "{module}");
        assert!(agent.counts(module).unwrap().0 > 60 || module == "r2/planner", "{module} works again");
        // It sleeps for 6 s of the agent's time, 300 cycles.
        assert!(stood > 150 || module != "trouble", "without sensors it stood in {stood} cycles");
    }
}

#[test]
fn a_planner_that_crashes_begins_anew() {
    for crash in ["panic_at=2", "panic_at=20", "panic_when_needed=1"] {
        for seed in 0..4 {
            let setting = format!("robots.r2.modules.planner.params.{crash}");
            let seed = format!("agent.seed={seed}");
            let plugin = "robots.r2.modules.planner.kind=crashing_planner";
            let mut agent = agent(&[plugin, &setting, &seed]);
            CRASHED.store(false, Ordering::Relaxed);
            finish(&mut agent);
            assert!(agent.counts("r2/planner").unwrap().2 > 0, "{crash}, {seed}: it did not panic");
        }
    }
}

#[test]
fn a_reflex_that_crashes_begins_anew() {
    let plugin = "robots.r2.modules.avoid_obstacle.kind=crashing_reflex";
    for seed in 0..4 {
        let seed = format!("agent.seed={seed}");
        let mut agent = agent(&[plugin, "robots.r2.modules.avoid_obstacle.params.panic_at=40", &seed]);
        while verdict(agent.board()) == "RUNNING" {
            agent.step();
        }
        assert_eq!(verdict(agent.board()), "SUCCEEDED");
        let (ticks, _, panics) = agent.counts("r2/avoid_obstacle").unwrap();
        assert!(ticks > 100 && panics == 1, "{ticks} ticks, {panics} panics");
        assert!(number(agent.board(), "r2/execute/status/reflexes") > 0.0);
    }
}

#[test]
fn without_reflexes_the_robot_drives_into_the_box() {
    let mut hits = 0;
    for seed in 0..10 {
        let sets = ["robots.r2.modules.avoid_obstacle.enabled=false", &*format!("agent.seed={seed}")];
        let mut agent = agent(&sets);
        while verdict(agent.board()) == "RUNNING" && agent.now() < 20_000_000_000 {
            agent.step();
        }
        assert_eq!(number(agent.board(), "r2/execute/status/reflexes"), 0.0);
        hits += u64::from(number(agent.board(), "referee/metrics/collisions_caused") > 0.0);
    }
    assert!(hits >= 5, "{hits} of 10 met the box beside the straight way");
}

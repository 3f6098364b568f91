//! An agent that runs, as a node of ROS.
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

use std::process::Command;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_interfaces::{Image, LaserScan, Odometry, Pose2, Position, Quaternion, Transform, Twist2};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_ros2::{RosBridge, RosSettings};
use slate_runtime::configuration::{Configuration, Database, Options as Sources};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Composer, Control, Options, Rate, RecordedTimes, Stopper, TimeSource};

/// The longest that a test waits for something.
const TIMEOUT: Duration = Duration::from_secs(40);

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    pub value: f64,
}

#[ports]
pub struct SensorIo {
    odometry: Output<Odometry>,
    count: Output<Number>,
    #[capacity(8)]
    scan: Output<LaserScan>,
}

/// Counts, and is somewhere.
pub struct Sensor;

#[module(stage = SensorAcquire)]
impl Module for Sensor {
    type Io = SensorIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &SensorIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        io.count.set(Number { value: *state });
        io.odometry.set(Odometry {
            pose: Pose2 { x: *state, y: -2.5, theta: std::f64::consts::FRAC_PI_2 },
            twist: Twist2 { linear: 0.5, angular: -0.25 },
        });
        io.scan.write(3, |scan| {
            (scan.angle_min, scan.angle_increment) = (-0.5, 0.5);
            (scan.range_min, scan.range_max) = (0.1, 10.0);
            scan.ranges.copy_from_slice(&[1.0, f32::INFINITY, 2.5]);
        });
        Outcome::Ok
    }
}

#[ports]
pub struct DriverIo {
    #[capacity(4)]
    scan: Input<LaserScan>,
    command: Input<Twist2>,
    number: Input<Number>,
    linked: Input<Number>,
    seen: Output<Number>,
    wheels: Output<Twist2>,
}

/// Adds up all that it reads, and passes the command on.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        if let Some(scan) = io.scan.fresh() {
            *state += scan
                .ranges
                .iter()
                .filter(|range| range.is_finite())
                .map(|range| f64::from(*range))
                .sum::<f64>();
        }
        *state += io.command.fresh().map_or(0.0, |command| command.linear);
        *state += io.number.fresh().map_or(0.0, |number| number.value);
        io.seen.set(Number { value: *state });
        let _ = io.linked.get();
        io.wheels.set(io.command.get().copied().unwrap_or(Twist2::ZERO));
        Outcome::Ok
    }
}

#[ports]
pub struct EyeIo {
    #[capacity(1_048_576)]
    image: Input<Image>,
}

/// Looks at nothing.
pub struct Eye;

#[module(stage = SensorProcess)]
impl Module for Eye {
    type Io = EyeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &EyeIo, _: &(), _: &Tick) -> Outcome {
        let _ = io.image.get();
        Outcome::Ok
    }
}

/// Whether a lamp is lit.
#[interface]
#[derive(PartialEq)]
pub struct Switch {
    pub on: Bool,
}

#[params]
pub struct LampParams {
    /// Refuses to be lit.
    #[param(default = false)]
    pub locked: Bool,
    /// Brightness.
    #[param(default = 0.5, range = 0.0..=1.0)]
    pub brightness: f64,
}

#[ports]
pub struct LampIo {
    switches: Inbox<Switch>,
    lit: Output<Switch>,
    count: Output<Number>,
}

/// Is lit on request.
pub struct Lamp;

#[module(stage = Act)]
impl Module for Lamp {
    type Io = LampIo;
    type Params = LampParams;
    type State = f64;

    fn tick(state: &mut f64, io: &LampIo, params: &LampParams, _: &Tick) -> Outcome {
        for request in io.switches.iter() {
            if params.locked.get() && request.on.get() {
                request.refuse(7);
            } else {
                *state += 1.0;
                io.lit.set(*request);
            }
        }
        io.count.set(Number { value: *state });
        Outcome::Ok
    }
}

/// Response of a service.
#[interface]
#[derive(PartialEq)]
pub struct Reply {
    pub success: Bool,
    pub message: Text<64>,
}

#[params]
pub struct AskerParams {
    /// Tells how its messages fare.
    #[param(default = true)]
    pub tells: Bool,
}

#[ports]
pub struct AskerIo {
    wish: Input<Switch>,
    reply: Input<Reply>,
    requests: Outbox<Switch>,
    delivery: Output<Number>,
    replies: Output<Number>,
}

/// Asks for what it is wished, and counts the replies.
pub struct Asker;

#[module(stage = Act)]
impl Module for Asker {
    type Io = AskerIo;
    type Params = AskerParams;
    type State = (u64, f64);

    fn tick(state: &mut (u64, f64), io: &AskerIo, params: &AskerParams, _: &Tick) -> Outcome {
        if let Some(wish) = io.wish.updated() {
            state.0 = io.requests.post(*wish).unwrap_or(0);
        }
        if params.tells.get() {
            io.delivery.set(Number { value: io.requests.delivery(state.0).code().into() });
        }
        if let Some(reply) = io.reply.updated() {
            state.1 += if reply.success.get() { 1.0 } else { 100.0 };
        }
        io.replies.set(Number { value: state.1 });
        Outcome::Ok
    }
}

#[ports]
pub struct MastIo {
    mount: Output<Transform>,
}

/// Stands on the robot.
pub struct Mast;

#[module(stage = SensorAcquire)]
impl Module for Mast {
    type Io = MastIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &MastIo, _: &(), _: &Tick) -> Outcome {
        io.mount.set(Transform {
            parent: Text::from("base_link"),
            child: Text::from("mast"),
            translation: Position { x: 0.0, y: 0.0, z: 1.25 },
            rotation: Quaternion::IDENTITY,
            fixed: true.into(),
            ..Transform::default()
        });
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Sensor>(),
        Plugin::linked::<Driver>(),
        Plugin::linked::<Eye>(),
        Plugin::linked::<Lamp>(),
        Plugin::linked::<Asker>(),
        Plugin::linked::<Mast>(),
        Plugin::linked::<slate_mapping::ExternalFrame>(),
    ]
}

pub fn configuration(name: &str, ros2: &str) -> String {
    format!(
        "[agent]\nname = \"{name}\"\n[loop]\nperiod = \"10ms\"\n[modules.sensor]\n[modules.driver]\n[modules.eye]\n[links]\n\
         \"driver/linked\" = \"sensor/count\"\n[ros2]\n{ros2}\n"
    )
}

pub fn database(name: &str, ros2: &str) -> Database {
    database_of(&configuration(name, ros2))
}

pub fn database_of(text: &str) -> Database {
    let sources = Sources { extra_tables: vec![slate_ros2::TABLE.into()], ..Sources::default() };
    Database::from_text("test.toml", text, sources).unwrap()
}

/// An agent that runs until this is dropped.
pub struct Running {
    pub bridge: Option<RosBridge>,
    pub composer: Composer,
    pub configuration: Arc<Configuration>,
    pub log: MemoryTarget,
    surface: Arc<ControlSurface>,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// An agent of a name with a table `[ros2]`.
    pub fn start(name: &str, ros2: &str) -> Self {
        Self::load(name, ros2).connected()
    }

    /// An agent of a configuration with a table `[ros2]`.
    pub fn of(text: &str) -> Self {
        Self::load_text(text).connected()
    }

    fn connected(self) -> Self {
        let mut running = self;
        let settings = RosSettings::of(&running.configuration).unwrap().unwrap();
        let mut bridge = RosBridge::open(&running.surface, &settings).unwrap();
        bridge.start().unwrap();
        running.bridge = Some(bridge);
        running
    }

    /// An agent that is no node yet.
    pub fn load(name: &str, ros2: &str) -> Self {
        Self::load_text(&configuration(name, ros2))
    }

    /// The same of a configuration.
    pub fn load_text(text: &str) -> Self {
        Self::load_with(text, Options::default())
    }

    /// An agent in lockstep, in real time.
    pub fn lockstep(text: &str) -> Self {
        let times = (0..100_000_u64).map(|cycle| cycle * 10_000_000).collect();
        let time_source: Box<dyn TimeSource> = Box::new(RecordedTimes::new(times));
        let options = Options { time_source: Some(time_source), rate: Rate::REALTIME, ..Options::default() };
        Self::load_with(text, options).connected()
    }

    fn load_with(text: &str, options: Options) -> Self {
        Self::load_database(&database_of(text), &plugins(), options)
    }

    /// An agent of a database with a table `[ros2]`.
    pub fn of_database(database: &Database, plugins: &[Plugin], options: Options) -> Self {
        Self::load_database(database, plugins, options).connected()
    }

    /// Stops all actuators.
    pub fn stop_actuators(&self, reason: &str) {
        self.surface.agent.stop(reason);
    }

    fn load_database(database: &Database, plugins: &[Plugin], options: Options) -> Self {
        let log = MemoryTarget::default();
        let options = Options { log: vec![Box::new(log.clone())], ..options };
        let mut agent = Agent::load_with(database, plugins, options).unwrap();
        let surface = Arc::new(ControlSurface::new(&agent).unwrap());
        let (composer, stopper) = (agent.composer(), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        let configuration = database.current();
        Self { bridge: None, composer, configuration, log, surface, stopper, thread: Some(thread) }
    }

    pub fn bridge(&self) -> &RosBridge {
        self.bridge.as_ref().unwrap()
    }

    /// A number on the board; NaN if it is missing.
    pub fn number(&self, path: &str) -> f64 {
        let found = self.composer.board().read(path).unwrap();
        found.and_then(|(value, _): (Value, _)| value.as_f64()).unwrap_or(f64::NAN)
    }

    pub fn has_logged(&self, words: &str) -> bool {
        self.log.lines().iter().any(|line| line.to_string().contains(words))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.bridge = None;
        self.stopper.stop();
        let ended = self.thread.take().map(JoinHandle::join);
        if std::thread::panicking() {
            self.log.lines().iter().for_each(|line| eprintln!("{line}"));
        }
        assert!(std::thread::panicking() || ended.is_none_or(|ended| ended.is_ok()));
    }
}

/// Waits until something holds.
pub fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < TIMEOUT, "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Set in the namespace of a test.
const INSIDE: &str = "SLATE_TEST_NAMESPACE";

/// Runs a test of that path in a network namespace of its own, where domains of others are not seen; where the kernel lets
/// nobody make one, in a domain that hardly anybody has.
pub fn alone(test: &str, body: impl FnOnce(u16)) {
    if std::env::var_os(INSIDE).is_some() {
        return body(7);
    }
    const LOOPBACK: &str =
        "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\"";
    let can =
        Command::new("unshare").args(["-n", "ip", "link"]).output().is_ok_and(|done| done.status.success());
    if !can {
        return body(40 + (std::process::id() % 60) as u16);
    }
    // Once, and not in each namespace, which has no network.
    super::peer::python();
    super::peer::cyclone_python();
    let done = Command::new("unshare")
        .args(["-n", "bash", "-c", LOOPBACK, "test"])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--nocapture", "--test-threads=1"])
        .env(INSIDE, "1")
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && output.contains("1 passed"), "{output}");
}

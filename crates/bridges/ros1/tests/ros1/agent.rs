//! An agent that runs, as a node of ROS 1.
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_interfaces::{LaserScan, Odometry, Pose2, Position, Quaternion, Transform, Twist2};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_ros1::{Ros1Bridge, Ros1Settings};
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
pub struct BaseIo {
    #[capacity(4)]
    scan: Input<LaserScan>,
    command: Input<Twist2>,
    sum: Output<Number>,
    odometry: Output<Odometry>,
}

/// Adds up all that it reads, and is somewhere.
pub struct Base;

#[module(stage = Act)]
impl Module for Base {
    type Io = BaseIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &BaseIo, _: &(), _: &Tick) -> Outcome {
        if let Some(scan) = io.scan.fresh() {
            let heard = scan.ranges.iter().filter(|range| range.is_finite());
            *state += heard.map(|range| f64::from(*range)).sum::<f64>();
        }
        *state += io.command.fresh().map_or(0.0, |command| command.linear);
        io.sum.set(Number { value: *state });
        io.odometry.set(Odometry {
            pose: Pose2 { x: *state, y: -2.5, theta: 0.0 },
            twist: io.command.get().copied().unwrap_or(Twist2::ZERO),
        });
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
        Plugin::linked::<Base>(),
        Plugin::linked::<Lamp>(),
        Plugin::linked::<Asker>(),
        Plugin::linked::<Mast>(),
        Plugin::linked::<slate_mapping::ExternalFrame>(),
    ]
}

/// An agent with links to a master.
pub fn linked(master: &str, links: &str) -> String {
    format!("[modules.base]\n[ros1]\nmaster = \"{master}\"\n[links]\n{links}")
}

/// An agent of modules and a table `[ros1]`.
pub fn database(text: &str) -> Database {
    let text = format!("agent.name = \"r2-d2\"\nloop.period = \"10ms\"\n{text}");
    let sources = Sources { extra_tables: vec![slate_ros1::SCHEME.into()], ..Sources::default() };
    Database::from_text("test.toml", &text, sources).unwrap()
}

/// An agent that runs until this is dropped.
pub struct Running {
    pub bridge: Option<Ros1Bridge>,
    pub composer: Composer,
    pub configuration: Arc<Configuration>,
    pub log: MemoryTarget,
    pub surface: Arc<ControlSurface>,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// An agent with links to a master.
    pub fn start(master: &str, links: &str) -> Self {
        Self::of(&linked(master, links))
    }

    /// An agent of modules and a table `[ros1]`.
    pub fn of(text: &str) -> Self {
        Self::load(text, Options::default()).connected()
    }

    /// The same in lockstep, in real time.
    pub fn lockstep(text: &str) -> Self {
        let times = (0..100_000_u64).map(|cycle| cycle * 10_000_000).collect();
        let time_source: Box<dyn TimeSource> = Box::new(RecordedTimes::new(times));
        let options = Options { time_source: Some(time_source), rate: Rate::REALTIME, ..Options::default() };
        Self::load(text, options).connected()
    }

    /// An agent that is no node yet.
    pub fn load(text: &str, options: Options) -> Self {
        let database = database(text);
        let log = MemoryTarget::default();
        let options = Options { log: vec![Box::new(log.clone())], ..options };
        let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
        let surface = Arc::new(ControlSurface::new(&agent).unwrap());
        let (composer, stopper) = (agent.composer(), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        let configuration = database.current();
        Self { bridge: None, composer, configuration, log, surface, stopper, thread: Some(thread) }
    }

    fn connected(self) -> Self {
        let mut running = self;
        let settings = Ros1Settings::of(&running.configuration).unwrap().unwrap();
        let mut bridge = Ros1Bridge::open(&running.surface, &settings).unwrap();
        bridge.start().unwrap();
        running.bridge = Some(bridge);
        running
    }

    pub fn bridge(&self) -> &Ros1Bridge {
        self.bridge.as_ref().unwrap()
    }

    /// A number on the board; NaN if it is missing.
    pub fn number(&self, path: &str) -> f64 {
        let found = self.composer.board().read(path).unwrap();
        found.and_then(|(value, _): (Value, _)| value.as_f64()).unwrap_or(f64::NAN)
    }

    pub fn value(&self, path: &str) -> Option<Value> {
        self.composer.board().read(path).unwrap().map(|(value, _)| value)
    }

    /// Sets a field, as a person does.
    pub fn set(&self, path: &str, field: &str, value: Value) {
        let (property, _) = self.composer.board().get(path).unwrap();
        property.set(field, &value, self.composer.now()).unwrap();
    }

    pub fn logged(&self, words: &str) -> usize {
        self.log.lines().iter().filter(|line| line.to_string().contains(words)).count()
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

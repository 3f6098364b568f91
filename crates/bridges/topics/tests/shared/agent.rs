//! Agents and recordings for the tests of bridges to ROS, which are the same but for the bridge.
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_interfaces::{Position, Quaternion, Transform};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_replay::{Comparison, Verdict};
use slate_runtime::configuration::{Configuration, Database, Options as Sources, Record};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{
    Agent, Composer, Control, ExternalContent, ExternalPorts, ExternalValue, Options, Rate, RecordedTimes,
    Stopper,
};

/// Longest wait of a test.
const TIMEOUT: Duration = Duration::from_secs(40);

/// A bridge under test.
pub trait TestBridge: Sized + Send + Sync + 'static {
    /// Name of its table.
    const TABLE: &'static str;

    /// Opens it with the settings of a configuration, and panics when that fails.
    fn opened(surface: &Arc<ControlSurface>, configuration: &Configuration) -> Self;

    /// Starts it, and panics when that fails.
    fn started(&mut self);
}

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    pub value: f64,
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

/// Calls a service for each request, and counts the replies.
pub struct Asker;

#[module(stage = Act)]
impl Module for Asker {
    type Io = AskerIo;
    type Params = AskerParams;
    type State = (u64, f64);

    fn tick(state: &mut (u64, f64), io: &AskerIo, params: &AskerParams, _: &Tick) -> Outcome {
        if let Some(wish) = io.wish.updated() {
            state.0 = io.requests.send_tracked(*wish).unwrap_or(0);
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

/// A force and a torque.
#[interface]
#[derive(PartialEq)]
pub struct Wrench {
    pub force: Position,
    pub torque: Position,
}

/// The load of a wrist.
#[interface]
#[derive(PartialEq)]
pub struct Load {
    pub wrench: Wrench,
}

#[ports]
pub struct WristIo {
    load: Input<Load>,
    felt: Output<Load>,
}

/// Passes its load on.
pub struct Wrist;

#[module(stage = Act)]
impl Module for Wrist {
    type Io = WristIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &WristIo, _: &(), _: &Tick) -> Outcome {
        if let Some(load) = io.load.updated() {
            io.felt.set(*load);
        }
        Outcome::Ok
    }
}

/// Plugins of the modules here.
pub fn shared_plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Lamp>(),
        Plugin::linked::<Asker>(),
        Plugin::linked::<Mast>(),
        Plugin::linked::<Wrist>(),
        Plugin::linked::<slate_mapping::ExternalFrame>(),
    ]
}

/// A database of a text with the table of a bridge.
pub fn database_of<B: TestBridge>(text: &str) -> Database {
    let sources = Sources { extra_tables: vec![B::TABLE.into()], ..Sources::default() };
    Database::from_text("test.toml", text, sources).unwrap()
}

/// Times of cycles of a simulation, 10 ms each.
fn times() -> Box<RecordedTimes> {
    Box::new(RecordedTimes::new((0..100_000_u64).map(|cycle| cycle * 10_000_000).collect()))
}

/// Options of an agent in lockstep, in real time.
pub fn lockstep() -> Options {
    Options { time_source: Some(times()), rate: Rate::REALTIME, ..Options::default() }
}

/// An agent that runs until this is dropped.
pub struct Running<B: TestBridge> {
    pub bridge: Option<B>,
    pub composer: Composer,
    pub configuration: Arc<Configuration>,
    pub log: MemoryTarget,
    pub surface: Arc<ControlSurface>,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl<B: TestBridge> Running<B> {
    /// An agent that is not a node yet.
    pub fn load_database(database: &Database, plugins: &[Plugin], options: Options) -> Self {
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

    /// The same as a node.
    pub fn connected(self) -> Self {
        let mut running = self;
        let mut bridge = B::opened(&running.surface, &running.configuration);
        bridge.started();
        running.bridge = Some(bridge);
        running
    }

    pub fn bridge(&self) -> &B {
        self.bridge.as_ref().unwrap()
    }

    /// A number on the board; NaN if it is missing.
    pub fn number(&self, path: &str) -> f64 {
        self.value(path).and_then(|value| value.as_f64()).unwrap_or(f64::NAN)
    }

    pub fn value(&self, path: &str) -> Option<Value> {
        self.composer.board().read(path).unwrap().map(|(value, _)| value)
    }

    /// How many lines of the log have these words.
    pub fn logged(&self, words: &str) -> usize {
        self.log.lines().iter().filter(|line| line.to_string().contains(words)).count()
    }
}

impl<B: TestBridge> Drop for Running<B> {
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

/// Stops an agent at the end, also that of a panic.
struct StopAtEnd(Stopper);

impl Drop for StopAtEnd {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// Records a run in lockstep, in real time, while `peers` makes things happen. Inputs at the paths `external` are set by the test.
pub fn record<B: TestBridge>(
    path: &Path,
    (database, plugins): (&Database, &[Plugin]),
    external: &[&str],
    peers: impl FnOnce(&B, &Composer) + Send,
) {
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options { recording: Some(Arc::new(recorder.clone())), ..lockstep() };
    let mut agent = Agent::load_with(database, plugins, options).unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = B::opened(&surface, &database.current());
    for input in external {
        agent.composer().external_input(input).unwrap().0.set_external("test:/");
    }
    recorder.begin(&agent, path);
    bridge.started();
    std::thread::scope(|scope| {
        let (stop, composer, bridge) = (StopAtEnd(agent.stopper()), agent.composer(), &bridge);
        let peers = scope.spawn(move || {
            let _stop = stop;
            peers(bridge, &composer);
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        peers.join().unwrap();
    });
    drop(bridge);
    recorder.end(&mut agent).unwrap();
}

/// Runs a recording again without ROS, and panics unless it is identical with at least so many values.
#[track_caller]
pub fn assert_repeated(path: &Path, plugins: &[Plugin], values: usize) {
    let comparison = Comparison::open(path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options =
        Options { time_source: Some(times()), recording: Some(comparison.recording()), ..Options::default() };
    let agent = Agent::load_with(&database, plugins, options).unwrap();
    match comparison.compare(agent).unwrap() {
        Verdict::Identical { values: found, whole: true, .. } if found as usize >= values => {}
        verdict => panic!("{verdict:?}"),
    }
}

/// Has the lamp's service called, and the asker's wish set to the same, 30 times; each is answered.
pub fn exchange_requests(composer: &Composer, mut call: impl FnMut(bool)) {
    let replies = || composer.board().read("asker/replies/value").unwrap().and_then(|(own, _)| own.as_f64());
    for number in 1..=30 {
        call(number % 3 == 0);
        let content = ExternalContent::Bytes(vec![u8::from(number % 2 == 0)]);
        assert!(
            composer.set_external(vec![ExternalValue { input: "asker/wish".into(), content }])[0].is_ok()
        );
        eventually("an answer", || replies() == Some(f64::from(number)));
    }
}

//! An agent that runs, as a node of ROS 1.
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_interfaces::{LaserScan, Odometry, Pose2, Twist2};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_ros1::{Ros1Bridge, Ros1Settings};
use slate_runtime::configuration::{Database, Options as Sources};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Composer, Control, Options, Stopper};

/// The longest that a test waits for something.
const PATIENCE: Duration = Duration::from_secs(40);

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

pub fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Base>()]
}

/// An agent with links to a master.
pub fn database(master: &str, links: &str) -> Database {
    let text = format!(
        "[agent]\nname = \"r2-d2\"\n[loop]\nperiod = \"10ms\"\n[modules.base]\n[ros1]\nmaster = \"{master}\"\ntrusted = true\n\
         [links]\n{links}"
    );
    let sources = Sources { extra_tables: vec![slate_ros1::SCHEME.into()], ..Sources::default() };
    Database::from_text("test.toml", &text, sources).unwrap()
}

/// An agent that runs until this is dropped.
pub struct Running {
    pub bridge: Option<Ros1Bridge>,
    pub composer: Composer,
    pub log: MemoryTarget,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    pub fn start(master: &str, links: &str) -> Self {
        let database = database(master, links);
        let log = MemoryTarget::default();
        let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
        let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
        let (composer, stopper) = (agent.composer(), agent.stopper());
        let settings = Ros1Settings::of(&database.current()).unwrap().unwrap();
        let mut bridge = Ros1Bridge::open(&composer, &settings).unwrap();
        bridge.start().unwrap();
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        Self { bridge: Some(bridge), composer, log, stopper, thread: Some(thread) }
    }

    pub fn bridge(&self) -> &Ros1Bridge {
        self.bridge.as_ref().unwrap()
    }

    /// A number on the board; NaN when there is none.
    pub fn number(&self, path: &str) -> f64 {
        let found = self.composer.board().read(path).unwrap();
        found.and_then(|(value, _): (Value, _)| value.as_f64()).unwrap_or(f64::NAN)
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
        assert!(start.elapsed() < PATIENCE, "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

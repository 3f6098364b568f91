//! Modules that do in a tick what a test says, and agents that a test steps.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and threads are a matter of the wall clock"
)]
#![allow(dead_code, reason = "each test uses a part of it")]

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::aspect::{Aspect, Logger, Plugins, Synchronization, Threads};
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Options, Rate};

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// The number.
    pub value: u64,
}

/// Another interface.
#[interface]
pub struct Other {
    /// A number.
    pub value: u64,
}

#[ports]
pub struct ScriptedIo {
    pub threads: Aspect<Threads>,
    pub plugins: Aspect<Plugins>,
    pub synchronization: Aspect<Synchronization>,
    pub logger: Aspect<Logger>,
    pub number: Output<Number>,
}

type Script = Box<dyn FnMut(&ScriptedIo, &Tick) -> Outcome + Send>;

static SCRIPTS: Mutex<BTreeMap<String, Arc<Mutex<Script>>>> = Mutex::new(BTreeMap::new());

/// What a module of that name does from now on.
pub fn script(module: &str, tick: impl FnMut(&ScriptedIo, &Tick) -> Outcome + Send + 'static) {
    let script: Script = Box::new(tick);
    let mut scripts = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner);
    scripts.insert(module.into(), Arc::new(Mutex::new(script)));
}

fn run(module: &str, io: &ScriptedIo, now: &Tick) -> Outcome {
    let script = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner).get(module).cloned();
    match script {
        Some(script) => script.lock().unwrap_or_else(PoisonError::into_inner)(io, now),
        None => Outcome::Ok,
    }
}

/// Does what the test says; each test has modules of its own names.
pub struct Scripted;

#[module(stage = Think)]
impl Module for Scripted {
    type Io = ScriptedIo;
    type Params = ();
    type State = String;

    fn create(setup: &Setup<'_>, (): &()) -> Result<String, Refusal> {
        Ok(setup.name.into())
    }

    fn tick(name: &mut String, io: &ScriptedIo, _: &(), now: &Tick) -> Outcome {
        run(name, io, now)
    }
}

/// The same as a plugin of its own.
pub struct Extra;

#[module(stage = Act)]
impl Module for Extra {
    type Io = ScriptedIo;
    type Params = ();
    type State = String;

    fn create(setup: &Setup<'_>, (): &()) -> Result<String, Refusal> {
        Ok(setup.name.into())
    }

    fn tick(name: &mut String, io: &ScriptedIo, _: &(), now: &Tick) -> Outcome {
        run(name, io, now)
    }
}

#[ports]
pub struct BeatIo {
    count: Output<Number>,
}

/// Counts cycles, and is the clock in lockstep.
pub struct Beat;

#[module(stage = PreLoop)]
impl Module for Beat {
    type Io = BeatIo;
    type Params = ();
    type State = u64;

    fn tick(state: &mut u64, io: &BeatIo, _: &(), _: &Tick) -> Outcome {
        *state += 1;
        io.count.set(Number { value: *state });
        Outcome::Ok
    }
}

/// An agent, and what it logs.
pub struct Stage {
    pub agent: Agent,
    log: MemoryTarget,
}

pub fn configuration(text: &str) -> Configuration {
    Configuration::from_text("test.toml", text, &configuration::Options::default()).unwrap()
}

/// How long a thread may take to stop in tests.
pub const HANG: Duration = Duration::from_millis(300);

/// How long a test waits for what must come.
const TIMEOUT: Duration = Duration::from_secs(20);

impl Stage {
    /// In lockstep, with scripted modules of those names.
    pub fn new(modules: &[&str]) -> Self {
        let modules: String =
            modules.iter().map(|name| format!("[modules.{name}]\nkind = \"scripted\"\n")).collect();
        Self::load(&modules)
    }

    /// In lockstep, with that configuration.
    pub fn load(modules: &str) -> Self {
        let text = format!("time.source = \"beat\"\n[loop]\nhang = \"300ms\"\n[modules.beat]\n{modules}");
        let options = Options { rate: Rate::Max, ..Options::default() };
        Self::with(&text, options)
    }

    /// On the wall clock, with scripted modules of those names.
    pub fn on_the_wall_clock(modules: &[&str]) -> Self {
        let modules: String =
            modules.iter().map(|name| format!("[modules.{name}]\nkind = \"scripted\"\n")).collect();
        Self::on_the_wall_clock_with(&modules)
    }

    /// On the wall clock, with that configuration.
    pub fn on_the_wall_clock_with(modules: &str) -> Self {
        Self::with(&format!("[loop]\nhang = \"300ms\"\nperiod = \"1ms\"\n{modules}"), Options::default())
    }

    /// As [`on_the_wall_clock_with`](Stage::on_the_wall_clock_with), and modules with a period have threads of their
    /// own.
    pub fn threaded(modules: &str) -> Self {
        let options = Options { mode: slate_runtime::Mode::Threaded, ..Options::default() };
        Self::with(&format!("[loop]\nhang = \"300ms\"\nperiod = \"1ms\"\n{modules}"), options)
    }

    fn with(text: &str, mut options: Options) -> Self {
        let log = MemoryTarget::default();
        options.log = vec![Box::new(log.clone())];
        let plugins = [Plugin::linked::<Beat>(), Plugin::linked::<Scripted>(), Plugin::linked::<Extra>()];
        Self { agent: Agent::load(&configuration(text), &plugins, options).unwrap(), log }
    }

    pub fn step(&mut self) {
        assert!(self.agent.step());
    }

    /// Steps until the number of a module is that one.
    pub fn until(&mut self, module: &str, value: u64) {
        self.until_true(&format!("{module} writes {value}"), |stage| stage.number(module) == Some(value));
    }

    /// Steps until it is true.
    pub fn until_true(&mut self, what: &str, mut is: impl FnMut(&mut Self) -> bool) {
        let start = Instant::now();
        while !is(self) {
            assert!(start.elapsed() < TIMEOUT, "never: {what}; the log: {:#?}", self.lines());
            self.step();
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    /// The number that a module wrote last.
    pub fn number(&self, module: &str) -> Option<u64> {
        let (value, _) = self.agent.board().read(&format!("{module}/number/value")).unwrap()?;
        value.as_f64().map(|value| value as u64)
    }

    pub fn lines(&self) -> Vec<String> {
        self.agent.logger().flush(Duration::from_secs(5));
        lines(&self.log)
    }

    pub fn log(&self) -> MemoryTarget {
        self.log.clone()
    }
}

/// What was logged.
pub fn lines(log: &MemoryTarget) -> Vec<String> {
    log.lines().iter().map(|record| format!("{:?} {} {}", record.level, record.module, record.text)).collect()
}

/// Waits for what must come.
pub fn eventually(what: &str, mut is: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is() {
        assert!(start.elapsed() < TIMEOUT, "never: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

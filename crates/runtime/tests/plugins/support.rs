//! Modules that are linked in, and agents that run beside a test.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::Board;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Composer, Control, End, Mode, Options, Rate, StartError, Stopper};

use crate::fixtures::libraries;

/// As the counter's plugin declares it.
#[interface]
#[derive(PartialEq)]
pub struct Count {
    /// Ticks made.
    #[unit("ticks")]
    pub value: u64,
    /// Which code made the last one.
    pub version: u64,
}

#[ports]
pub struct BeatIo {
    count: Output<Count>,
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
        io.count.set(Count { value: *state, version: 0 });
        Outcome::Ok
    }
}

/// What a reader saw.
#[interface]
pub struct Seen {
    /// The value.
    pub value: u64,
    /// Which code wrote it.
    pub version: u64,
    /// Which of the property's writers wrote it.
    pub generation: u64,
    /// How many values were never seen.
    pub missed: u64,
    /// Whether it is stale.
    pub stale: u64,
    /// Whether there is a writer.
    pub alive: u64,
}

#[ports]
pub struct ReaderIo {
    #[stale(after = "10s")]
    input: Input<Count>,
    seen: Output<Seen>,
}

/// Shows what a reader sees.
pub struct Reader;

#[module(stage = Think)]
impl Module for Reader {
    type Io = ReaderIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ReaderIo, _: &(), _: &Tick) -> Outcome {
        let input = io.input.get().copied().unwrap_or_default();
        io.seen.set(Seen {
            value: input.value,
            version: input.version,
            generation: io.input.stamp().generation,
            missed: io.input.missed(),
            stale: io.input.is_stale().into(),
            alive: io.input.has_writer().into(),
        });
        Outcome::Ok
    }
}

pub fn linked() -> Vec<Plugin> {
    vec![Plugin::linked::<Beat>(), Plugin::linked::<Reader>()]
}

pub fn configuration(text: &str) -> Configuration {
    Configuration::from_text("test.toml", text, &configuration::Options::default()).unwrap()
}

/// The beginning of a configuration: the clock, and the counter with a reader.
pub fn robot(counter: &Path) -> String {
    format!(
        "{}\n[modules.counter]\n[modules.reader]\n[links]\n\"reader/input\" = \"counter/count\"\n",
        library("counter", counter)
    )
}

/// The entry of a library.
pub fn library(name: &str, file: &Path) -> String {
    format!("[plugins.{name}]\nfile = \"{}\"\n", file.display())
}

/// The same, known but not loaded.
pub fn dormant(name: &str, file: &Path) -> String {
    library(name, file) + "load = false\n"
}

/// An agent whose clock is the module `beat`, as fast as it goes.
pub fn lockstep(text: &str) -> Agent {
    try_lockstep(text).unwrap()
}

pub fn try_lockstep(text: &str) -> Result<Agent, StartError> {
    try_lockstep_with(text, Options::default())
}

/// As [`lockstep`], with what the log says.
pub fn logged_lockstep(text: &str) -> (Agent, MemoryTarget) {
    let log = MemoryTarget::default();
    let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
    (try_lockstep_with(text, options).unwrap(), log)
}

pub fn try_lockstep_with(text: &str, options: Options) -> Result<Agent, StartError> {
    let text = format!("time.source = \"beat\"\n{text}\n[modules.beat]\n");
    let options = Options { rate: Rate::Max, armed: true, ..options };
    Agent::load(&configuration(&text), &linked(), options)
}

/// What a refusal says, with its help.
pub fn complaint(error: &impl miette::Diagnostic) -> String {
    let mut text = error.to_string();
    if let Some(help) = error.help() {
        text = format!("{text}; {help}");
    }
    for more in error.related().into_iter().flatten() {
        text = format!("{text}\n{more}");
        if let Some(help) = more.help() {
            text = format!("{text}; {help}");
        }
    }
    text
}

/// That a text says all of it.
#[track_caller]
pub fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not said by: {text}");
    }
}

pub fn plain() -> std::path::PathBuf {
    libraries().counter("plain")
}

pub fn step(agent: &mut Agent, cycles: u64) {
    (0..cycles).for_each(|_| assert!(agent.step()));
}

/// A number on the blackboard; nothing when it was never written or is not there.
pub fn value(board: &Board, path: &str) -> Option<u64> {
    let value = board.read(path).ok()??.0.as_f64()?;
    Some(value as u64)
}

#[track_caller]
pub fn number(agent: &Agent, path: &str) -> u64 {
    value(agent.board(), path).unwrap_or_else(|| panic!("/{path} has no value"))
}

/// Waits for something that comes soon.
#[track_caller]
pub fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(30), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// An agent on the wall clock, which runs in a thread.
pub struct Running {
    pub board: Arc<Board>,
    pub composer: Composer,
    pub log: MemoryTarget,
    stopper: Stopper,
    samples: Arc<Mutex<Vec<Vec<u64>>>>,
    thread: JoinHandle<(Agent, End)>,
}

impl Running {
    /// Starts it; at the end of each cycle the properties of those paths are noted (0 for what is not there).
    pub fn start(text: &str, mode: Mode, paths: &'static [&'static str]) -> Self {
        let log = MemoryTarget::default();
        let options = Options { mode, armed: true, log: vec![Box::new(log.clone())], ..Options::default() };
        let text = format!("{text}\n[modules.beat]\n");
        let mut agent = Agent::load(&configuration(&text), &linked(), options).unwrap();
        let (board, composer, stopper) = (Arc::clone(agent.board()), agent.composer(), agent.stopper());
        let samples = Arc::new(Mutex::new(Vec::new()));
        let noted = Arc::clone(&samples);
        let thread = std::thread::spawn(move || {
            let end = agent.run(Box::new(move |cycle| {
                let row = paths.iter().map(|path| value(cycle.board, path).unwrap_or(0)).collect();
                noted.lock().unwrap().push(row);
                Control::Continue
            }));
            (agent, end.unwrap())
        });
        let running = Self { board, composer, log, stopper, samples, thread };
        running.cycles(3);
        running
    }

    pub fn value(&self, path: &str) -> u64 {
        value(&self.board, path).unwrap_or(0)
    }

    /// Waits for so many cycles.
    #[track_caller]
    pub fn cycles(&self, count: usize) {
        let now = || self.samples.lock().unwrap().len();
        let begin = now();
        until("cycles", || now() >= begin + count);
    }

    /// Ends it; what was noted, and why it ended.
    pub fn stop(self) -> (Agent, End, Vec<Vec<u64>>) {
        self.stopper.stop();
        let (agent, end) = self.thread.join().unwrap();
        let samples = self.samples.lock().unwrap().clone();
        (agent, end, samples)
    }
}

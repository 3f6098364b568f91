//! A value from one module to another one in the same process: from before it is handed over, when it is whole, until the other
//! one looks at it. In turns, one thread does both; else each has a thread of its own, and that of the reader sleeps.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::{Agent, Control, Mode, Options};

use super::agents;
use super::process::Blob;
use super::scripts::{ALL, Script, script};
use crate::machine::now;
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

const WORK: &str = "modules of one process";

const SIZES: [usize; 2] = [64, 1 << 20];

/// Bytes of the values of this line.
static SIZE: AtomicUsize = AtomicUsize::new(0);

/// How long values took.
static TIMES: Mutex<Vec<u64>> = Mutex::new(Vec::new());

/// Peers that are no crates, in turns and in threads.
static SCRIPTS: [Script; 2] = [
    script("roscpp, shared pointers", Role::Peer, &["roscpp", "turns"], ALL),
    script("roscpp, shared pointers", Role::Peer, &["roscpp", "threads"], ALL),
];

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    let count = effort.count(500);
    for (mode, how, peer) in [
        (Mode::Staged, "in turns, one thread", &SCRIPTS[0]),
        (Mode::Threaded, "each with a thread of its own", &SCRIPTS[1]),
    ] {
        for size in SIZES {
            let mut contest = Contest::new(WORK, format!("{size} B, {how}"));
            contest.with("Slate", Role::Slate, move |samples| slate(mode, size, count, samples));
            peer.join(&mut contest, WORK, size, effort, table);
            contest.run(effort, table);
        }
    }
}

/// The ports of a source.
#[ports]
pub struct SourceIo {
    #[capacity(1048568)]
    blob: Output<Blob>,
}

/// Writes a value with its time.
pub struct Source;

#[module(stage = SensorAcquire)]
impl Module for Source {
    type Io = SourceIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SourceIo, _: &(), _: &Tick) -> Outcome {
        io.blob.write(SIZE.load(Ordering::Relaxed) - size_of::<u64>(), |blob| blob.time = now());
        Outcome::Ok
    }
}

/// The ports of a sink.
#[ports]
pub struct SinkIo {
    blob: Input<Blob>,
}

/// Notes how long ago its input was written.
pub struct Sink;

#[module(stage = Act, on = blob)]
impl Module for Sink {
    type Io = SinkIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SinkIo, _: &(), _: &Tick) -> Outcome {
        let took = now().saturating_sub(io.blob.time);
        if let Ok(mut times) = TIMES.lock() {
            times.push(took);
        }
        Outcome::Ok
    }
}

fn slate(mode: Mode, size: usize, count: usize, samples: &mut Samples) {
    SIZE.store(size, Ordering::Relaxed);
    let text = "loop.period = \"1ms\"\n[log.targets]\nconsole = false\n[modules.source]\n[modules.sink]\n\
                [links]\n\"sink/blob\" = \"source/blob\"\n";
    let plugins = [Plugin::linked::<Source>(), Plugin::linked::<Sink>()];
    let agent = Agent::load_with(&agents::database(text), &plugins, Options { mode, ..Options::default() });
    let mut agent = agent.expect("the modules of a bench fit");
    begin(count);
    let end_of_run = agent.run(Box::new(move |_| {
        let enough = TIMES.lock().is_ok_and(|times| times.len() >= count);
        if enough { Control::Stop } else { Control::Continue }
    }));
    end_of_run.expect("the system has threads");
    end(samples);
}

fn begin(count: usize) {
    if let Ok(mut times) = TIMES.lock() {
        times.clear();
        times.reserve(2 * count);
    }
}

fn end(samples: &mut Samples) {
    if let Ok(times) = TIMES.lock() {
        times.iter().for_each(|took| samples.add(*took));
    }
}

//! Value from one module to another one in the same process.
//! The time goes from the whole value, before it is handed over, until the other module reads it. In turns, one thread
//! does both; else each module has a thread, and that of the reader sleeps.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::{Agent, Control, Mode, Options};
use zenoh::Wait;
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;

use super::agents;
use super::process::Blob;
use super::scripts::{ALL, Script, script};
use super::sessions::session;
use crate::machine::now;
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

const WORK: &str = "modules of one process";

const SIZES: [usize; 2] = [64, 1 << 20];

/// From one value to the next, as long as a cycle of Slate.
const PAUSE: Duration = Duration::from_millis(1);

/// Bytes of the values of this line.
static SIZE: AtomicUsize = AtomicUsize::new(0);

/// Latencies of the values, ns.
static TIMES: Mutex<Vec<u64>> = Mutex::new(Vec::new());

const ZENOH: &str = "zenoh in one session, by its queue";

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
            if mode == Mode::Staged {
                contest.with(ZENOH, Role::Peer, move |samples| zenoh_in_turns(size, count, samples));
                contest.with("zenoh in one session, in its callback", Role::Lesser, move |samples| {
                    zenoh_in_callback(size, count, samples);
                });
            } else {
                contest.with(ZENOH, Role::Peer, move |samples| zenoh_in_threads(size, count, samples));
            }
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
    blob: Required<Blob>,
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

/// Notes how long ago a value was handed over.
fn note(sample: &Sample) {
    let bytes = sample.payload().to_bytes();
    let sent = bytes.first_chunk().map_or(0, |first| u64::from_ne_bytes(*first));
    let took = now().saturating_sub(sent);
    if let Ok(mut times) = TIMES.lock() {
        times.push(took);
    }
}

/// Writes one value each millisecond into a session, with a callback after each.
fn zenoh_writes(session: &zenoh::Session, size: usize, count: usize, mut then: impl FnMut()) {
    let publisher = session.declare_publisher("value").congestion_control(CongestionControl::Block);
    let publisher = publisher.express(true).wait().expect("the key is right");
    for _ in 0..count {
        thread::sleep(PAUSE);
        // Zenoh takes the memory as it is, and hands it to the readers.
        let mut bytes = vec![7; size];
        bytes[..8].copy_from_slice(&now().to_ne_bytes());
        publisher.put(bytes).wait().expect("the session is open");
        then();
    }
}

fn zenoh_in_turns(size: usize, count: usize, samples: &mut Samples) {
    begin(count);
    let session = session(None);
    let values = session.declare_subscriber("value").wait().expect("the key is right");
    zenoh_writes(&session, size, count, || values.try_iter().for_each(|sample| note(&sample)));
    end(samples);
}

fn zenoh_in_callback(size: usize, count: usize, samples: &mut Samples) {
    begin(count);
    let session = session(None);
    let values = session.declare_subscriber("value").callback(|sample| note(&sample));
    let _values = values.wait().expect("the key is right");
    zenoh_writes(&session, size, count, || ());
    end(samples);
}

fn zenoh_in_threads(size: usize, count: usize, samples: &mut Samples) {
    begin(count);
    let session = session(None);
    let values = session.declare_subscriber("value").wait().expect("the key is right");
    thread::scope(|scope| {
        scope.spawn(|| values.iter().take(count).for_each(|sample| note(&sample)));
        zenoh_writes(&session, size, count, || ());
    });
    end(samples);
}

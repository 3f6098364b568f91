//! Property of an agent to a Zenoh program in another process, beside Zenoh alone.
//! The time goes from before the value is handed over until a thread of the other program has it, and each value waits
//! for the one before. Also the cost of a stalled program to the cycles of an agent.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use slate_control::ControlSurface;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_network::{AgentNetwork, NetworkSettings};
use slate_runtime::configuration::Database;
use slate_runtime::{Agent, Options, Rate, RecordedTimes};
use zenoh::Wait;

use super::agents;
use super::caterpillar::{MODULES, PACES, steps};
use super::process::{Blob, LOST, Pair, Reader, Sender, Zenoh, add, port, say};
use super::sessions::session;
use crate::machine::{pin, unpin};
use crate::measure::{Contest, Effort};
use crate::table::{Role, Table};

/// Argument of the process that reads an agent.
/// After it come the key and the bytes in front of the value.
pub const AGENT: &str = "zenoh-agent";
/// The key of the property.
pub const AGENT_KEY: &str = "slate/bench/sender/blob";
/// Argument of the process that reads an agent and stalls at the first value.
pub const STALLED: &str = "zenoh-stalled";
/// All keys of an agent.
const AGENT_KEYS: &str = "slate/bench/**";
/// Bytes of the header of CDR.
pub const CDR_HEADER: usize = 4;

const WORK: &str = "an agent to a program of Zenoh";

const SIZES: [usize; 2] = [64, 1 << 20];

/// The time of the next value, and its bytes.
static TIME: AtomicU64 = AtomicU64::new(0);
static SIZE: AtomicUsize = AtomicUsize::new(0);

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    for size in SIZES {
        let mut contest = Contest::new(WORK, format!("{size} B"));
        add(&mut contest, "Slate", Role::Slate, size, effort, AgentSender::start(size));
        let zenoh = Zenoh::start("zenoh-thread", size);
        add(&mut contest, "zenoh, to a thread of the application", Role::Peer, size, effort, zenoh);
        contest.run(effort, table);
    }
    stalled(effort, table);
}

/// Measures cycles of an agent without readers and with a stalled one.
fn stalled(effort: Effort, table: &mut Table) {
    for (pace, pause) in PACES {
        // Threads of the network run anywhere.
        unpin();
        let row = format!("agent.name = \"bench\"\n{}", agents::row(MODULES));
        let mut alone = agents::lockstep(&row, None);
        let mut read = StalledAgent::start(&row);
        pin(0);
        let mut contest = Contest::new("a cycle beside a network", format!("{MODULES} modules, {pace}"));
        contest.with("Slate, on no network", Role::Slate, move |samples| {
            steps(effort, pause, samples, || assert!(alone.step()));
        });
        contest.with("Slate, all values to a program that has stalled", Role::Slate, move |samples| {
            steps(effort, pause, samples, || assert!(read.agent.step()));
        });
        contest.run(effort, table);
    }
}

/// An agent that a program reads which has stalled.
struct StalledAgent {
    /// Goes before the agent.
    _network: AgentNetwork,
    agent: Agent,
    _reader: Reader,
}

impl StalledAgent {
    fn start(row: &str) -> Self {
        let port = port();
        let text = format!("{row}[network]\nlisten = [\"tcp/127.0.0.1:{port}\"]\n");
        let mut agent = agents::lockstep(&text, None);
        let network = connect(&agent, &agents::database(&text));
        let reader = Reader::start(STALLED, &port.to_string(), 0);
        let begin = Instant::now();
        // It says so when it has a value.
        while !reader.has_come() {
            assert!(agent.step(), "its times have not ended");
            thread::sleep(Duration::from_millis(1));
            assert!(begin.elapsed() < LOST, "the subscriber is found");
        }
        Self { _network: network, agent, _reader: reader }
    }
}

/// Reads an agent until the first value comes, and takes no other.
pub fn read_stalled(place: &str) {
    let session = session(Some(("connect", place)));
    let callback = |_| {
        say(0);
        loop {
            thread::park();
        }
    };
    let _subscriber = session.declare_subscriber(AGENT_KEYS).callback(callback).wait().expect("it is a key");
    say(0);
    loop {
        thread::park();
    }
}

/// Connects an agent with a table `[network]`.
fn connect(agent: &Agent, database: &Database) -> AgentNetwork {
    let surface = Arc::new(ControlSurface::new(agent).expect("the agent can be reached"));
    let settings = NetworkSettings::of(&database.current()).ok().flatten().expect("it is right");
    AgentNetwork::start(&surface, &settings).expect("it can listen")
}

/// The ports of a sender.
#[ports]
pub struct SenderIo {
    #[capacity(4194296)]
    blob: Output<Blob>,
}

/// Writes a value in each cycle.
pub struct SenderModule;

#[module(name = "sender", stage = Act)]
impl Module for SenderModule {
    type Io = SenderIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SenderIo, _: &(), _: &Tick) -> Outcome {
        let items = SIZE.load(Ordering::Relaxed).saturating_sub(size_of::<u64>());
        io.blob.write(items, |blob| blob.time = TIME.load(Ordering::Relaxed));
        Outcome::Ok
    }
}

/// An agent on a network.
pub struct AgentSender {
    /// Goes before the agent.
    _network: AgentNetwork,
    agent: Agent,
    size: usize,
}

impl AgentSender {
    /// Begins, and waits for the program that reads it.
    pub fn start(size: usize) -> Pair {
        let port = port();
        let text = format!(
            "agent.name = \"bench\"\n[log.targets]\nconsole = false\n[modules.sender]\n[network]\n\
             listen = [\"tcp/127.0.0.1:{port}\"]\npublish = [\"sender/blob\"]\n"
        );
        let database = agents::database(&text);
        let times = (0..1_u64 << 20).map(|cycle| cycle * 1_000_000);
        let options = Options {
            time_source: Some(Box::new(RecordedTimes::new(times.collect()))),
            rate: Rate::Max,
            ..Options::default()
        };
        let agent = Agent::load_with(&database, &[Plugin::linked::<SenderModule>()], options);
        let agent = agent.expect("it is right");
        let network = connect(&agent, &database);
        let reader = Reader::start(AGENT, &port.to_string(), size);
        let mut sender = Self { _network: network, agent, size };
        // The first value that comes says that the reader was found.
        let begin = Instant::now();
        loop {
            sender.send(&crate::machine::now().to_ne_bytes());
            thread::sleep(Duration::from_millis(50));
            if reader.has_come() {
                break;
            }
            assert!(begin.elapsed() < LOST, "the subscriber is found");
        }
        thread::sleep(Duration::from_millis(300));
        while reader.has_come() {}
        (Box::new(sender), reader)
    }
}

impl Sender for AgentSender {
    fn send(&mut self, bytes: &[u8]) {
        SIZE.store(self.size, Ordering::Relaxed);
        let time = bytes.first_chunk().map_or(0, |first| u64::from_ne_bytes(*first));
        TIME.store(time, Ordering::Relaxed);
        assert!(self.agent.step(), "its times have not ended");
    }
}

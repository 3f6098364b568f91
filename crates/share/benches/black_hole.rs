//! Benchmark of an agent that stops reading: its cost for the other agents.
//! A writer at 1 kHz has three readers in processes of their own, one of which is stopped every other time. Prints the
//! duration of a write and the gaps in the answers of the healthy readers.
//!
//! `cargo bench -p slate-share --bench black_hole [-- ENDPOINT]`; without one it goes over the machine's own sockets.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

#[path = "../tests/agents/mod.rs"]
mod agents;

use std::process::Command;
use std::time::{Duration, Instant};

use agents::process::Process;
use agents::{Agent, Blob, Folder, add, output, setup, wait_for, write};
use rustix::process::Signal;
use slate_blackboard::channel::{Latest, Writer};
use slate_blackboard::interface::Interface;
use slate_share::peers::WantedProperty;
use slate_share::session::Options;

const PERIOD: Duration = Duration::from_millis(1);
const PHASE: Duration = Duration::from_secs(4);
const ROUNDS: usize = 3;
/// Bytes of a value: many, so that what is between two agents is full at once.
const SIZE: usize = 16 << 10;
const READERS: [&str; 3] = ["one", "two", "three"];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match &arguments[..] {
        [reader, name, endpoint] if reader == "reader" => read(name, endpoint),
        [endpoint] => measure(endpoint),
        _ => {
            let folder = Folder::new();
            measure(&folder.endpoint("hub"));
        }
    }
}

/// An agent that says which value it has seen last.
fn read(name: &str, endpoint: &str) {
    let agent = Agent::start(setup(name));
    let mut seen = output(&agent.board, "out/seen", 1);
    agent.peers.connect("hub", endpoint).unwrap();
    let want = WantedProperty::new("out/blob", Options::default()).expect(Blob::DESCRIPTOR, SIZE);
    agent.peers.subscribe("hub", want).unwrap();
    let (mirror, _) = agent.board.find("agents/hub/out/blob").unwrap();
    let mut reader = mirror.channel().unwrap().latest().unwrap();
    while rustix::process::getppid().is_some_and(|parent| parent.as_raw_nonzero().get() != 1) {
        if reader.refresh() {
            write(&mut seen, number(&reader));
        }
        std::thread::sleep(PERIOD / 4);
    }
}

fn number(reader: &Latest) -> u64 {
    reader.value().map_or(0, |value| u64::from_ne_bytes(value.bytes()[..8].try_into().unwrap()))
}

fn measure(endpoint: &str) {
    let hub = Agent::start(setup("hub").listen(endpoint));
    let property = add(&hub.board, "out/blob", Blob::DESCRIPTOR, SIZE, 1);
    let mut writer = property.channel().unwrap().writer().unwrap();
    let mut readers: Vec<Reader> =
        READERS.into_iter().map(|name| Reader::start(&hub, name, endpoint)).collect();
    let (mut well, mut ill) = (Phase::default(), Phase::default());
    for _ in 0..ROUNDS {
        well.run(&hub, &mut writer, &mut readers);
        readers[2].process.signal(Signal::STOP);
        ill.run(&hub, &mut writer, &mut readers);
        readers[2].process.signal(Signal::CONT);
        wait_for("the stopped reader", || hub.peers.is_connected(READERS[2]));
    }
    println!("{:<34}{:>10}{:>10}{:>10}{:>22}", "over", "p50", "p99.9", "most", "worst gap of others");
    well.report("three healthy readers");
    ill.report("one of them stopped");
}

struct Reader {
    process: Process,
    seen: Latest,
    last_received: Instant,
}

impl Reader {
    fn start(hub: &Agent, name: &str, endpoint: &str) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        let process = Process::start(command.args(["reader", name, endpoint]));
        wait_for("a reader", || hub.peers.is_connected(name));
        hub.peers
            .subscribe(
                name,
                WantedProperty::new("out/seen", Options::default()).expect(agents::Number::DESCRIPTOR, 0),
            )
            .unwrap();
        let (mirror, _) = hub.board.find(&format!("agents/{name}/out/seen")).unwrap();
        Self { process, seen: mirror.channel().unwrap().latest().unwrap(), last_received: Instant::now() }
    }
}

/// Measurements with all readers healthy, or with one stopped.
#[derive(Default)]
struct Phase {
    /// Nanoseconds that each write took, with what wakes the threads that send.
    writes: Vec<u64>,
    gap: Duration,
}

impl Phase {
    fn run(&mut self, hub: &Agent, writer: &mut Writer, readers: &mut [Reader]) {
        let value = vec![7; SIZE + 16];
        let notifier = hub.peers.notifier();
        let begin = Instant::now();
        for reader in readers.iter_mut() {
            reader.last_received = begin;
        }
        let mut due = begin;
        let mut bytes = value;
        while begin.elapsed() < PHASE {
            let number = writer.last().sequence + 1;
            bytes[..8].copy_from_slice(&number.to_ne_bytes());
            let start = Instant::now();
            writer.write(&bytes, SIZE, agents::clock()()).unwrap();
            notifier.notify();
            self.writes.push(start.elapsed().as_nanos() as u64);
            for reader in &mut readers[..2] {
                // Also of those that are not heard of again.
                self.gap = self.gap.max(reader.last_received.elapsed());
                if reader.seen.refresh() {
                    reader.last_received = Instant::now();
                }
            }
            due += PERIOD;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    }

    fn report(&mut self, name: &str) {
        self.writes.sort_unstable();
        let at = |share: f64| self.writes[((self.writes.len() - 1) as f64 * share) as usize] as f64 / 1000.0;
        let gap = self.gap.as_secs_f64() * 1e3;
        println!("{name:<34}{:>7.1} us{:>7.1} us{:>7.1} us{gap:>19.1} ms", at(0.5), at(0.999), at(1.0));
    }
}

//! An agent in this process, and others in processes of their own that dial it.

use std::time::{Duration, Instant};

use slate_blackboard::channel::{Policy, QueueReader, Start, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_module::interface;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session::Options;

use crate::agents::process::Process;
use crate::agents::{Agent, Number, add, clock, output, wait_for, write};

/// What 999 of 1000 writes may take longer on a busy machine.
const USUAL: Duration = Duration::from_millis(50);

/// From one value to the next.
const PERIOD: Duration = Duration::from_millis(1);

/// What an agent has got of the hub's queue.
#[interface]
pub struct Tally {
    /// How many values came.
    pub came: u64,
    /// How many were missed.
    pub missed: u64,
    /// The first one.
    pub first: u64,
    /// The last one.
    pub last: u64,
}

/// An agent that dials `hub`, reads its queue, and counts: its own values, and what it has read.
pub fn be_an_agent(setup: Setup, endpoint: &str) {
    let agent = Agent::start(setup);
    // More than are written while a network is ill.
    let mut counts = output(&agent.board, "out/count", 1 << 14);
    let mut newest = output(&agent.board, "out/newest", 1);
    let mut read = output(&agent.board, "out/read", 1);
    let tallies = add(&agent.board, "out/tally", Tally::DESCRIPTOR, 0, 1);
    let mut tallies = tallies.channel().unwrap().writer().unwrap();
    let want = WantedProperty::new("out/count", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
    agent.peers.connect("hub", endpoint).unwrap();
    agent.peers.subscribe("hub", want).unwrap();
    let mut reader = queue(&agent, "agents/hub/out/count");
    let (mut number, mut tally) = (0, Tally::default());
    loop {
        number += 1;
        write(&mut counts, number);
        write(&mut newest, number);
        drain(&mut reader, |number| {
            if tally.came == 0 {
                tally.first = number;
            }
            (tally.came, tally.last) = (tally.came + 1, number);
        });
        tally.missed = reader.skipped();
        write(&mut read, tally.last);
        tallies.write(View::of(&mut tally).bytes(), 0, clock()()).unwrap();
        std::thread::sleep(PERIOD);
        // The parent process has ended.
        if rustix::process::getppid().is_none_or(|parent| parent.as_raw_nonzero().get() == 1) {
            return;
        }
    }
}

fn queue(agent: &Agent, path: &str) -> QueueReader {
    agent.board.find(path).unwrap().0.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap()
}

/// Takes what came; the last of it.
fn drain(reader: &mut QueueReader, mut each: impl FnMut(u64)) -> Option<u64> {
    let mut last = None;
    while reader.pull().unwrap() > 0 {
        for loan in reader.window() {
            let number = u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap());
            each(number);
            last = Some(number);
        }
    }
    last
}

/// What an agent that is ill may cost the others.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// The longest that a healthy agent was not heard of.
    gap: Duration,
    /// The longest that a write took.
    longest: Duration,
    /// The longest that 999 of 1000 writes took.
    usual: Duration,
}

impl Cost {
    /// It is no more than it was before, but for what threads of a busy machine wait for each other: `slack` now and then.
    pub fn check(self, before: Self, slack: Duration) {
        println!("with an ill agent {self:.1?}, before {before:.1?}");
        assert!(self.gap < before.gap + slack, "the healthy agents wait for the one that is ill");
        assert!(self.longest < before.longest + slack, "a write waits for the one that is ill");
        assert!(self.usual < before.usual + USUAL, "writes take longer with one that is ill");
    }
}

/// An agent in this process, and others that dial it; it reads their counts.
pub struct Hub {
    pub agent: Agent,
    readers: Vec<(String, QueueReader)>,
}

impl Hub {
    pub fn start(setup: Setup, names: &[&str], launch: impl Fn(&str) -> Process) -> (Self, Vec<Process>) {
        let agent = Agent::start(setup);
        let processes: Vec<_> = names.iter().map(|name| launch(name)).collect();
        let mut readers = Vec::new();
        for name in names {
            wait_for("an agent", || agent.peers.is_connected(name));
            let count =
                WantedProperty::new("out/count", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
            agent.peers.subscribe(name, count).unwrap();
            for path in ["out/read", "out/tally"] {
                agent.peers.subscribe(name, WantedProperty::new(path, Options::default())).unwrap();
            }
            readers.push(((*name).to_owned(), queue(&agent, &format!("agents/{name}/out/count"))));
        }
        (Self { agent, readers }, processes)
    }

    /// Runs for a while, writing a value each period.
    pub fn run(&mut self, time: Duration, writer: &mut Writer, ill: &str) -> Cost {
        let start = Instant::now();
        let mut heard: Vec<_> = self.readers.iter().map(|_| Instant::now()).collect();
        let (mut gap, mut writes) = (Duration::ZERO, Vec::new());
        let mut number = writer.last().sequence;
        while start.elapsed() < time {
            number += 1;
            let begin = Instant::now();
            write(writer, number);
            writes.push(begin.elapsed());
            for ((name, reader), heard) in self.readers.iter_mut().zip(&mut heard) {
                let mut before = None;
                let came = drain(reader, |number| {
                    assert!(before.is_none_or(|before| number > before), "{name}: {number} after {before:?}");
                    before = Some(number);
                });
                if name != ill {
                    gap = gap.max(heard.elapsed());
                }
                if came.is_some() {
                    *heard = Instant::now();
                }
            }
            std::thread::sleep(PERIOD);
        }
        writes.sort_unstable();
        let longest_of = |share: usize| writes[(writes.len() - 1) * share / 1000];
        Cost { gap, longest: longest_of(1000), usual: longest_of(999) }
    }

    /// A number among the states of its peers.
    pub fn state(&self, path: &str) -> Option<i128> {
        self.agent.board.read(path).ok().flatten()?.0.as_integer()
    }
}

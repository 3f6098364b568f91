//! An agent in this process, and others in processes of their own that dial it.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use slate_blackboard::channel::{Policy, QueueReader, Start, Writer};
use slate_blackboard::interface::Interface;
use slate_share::peers::{Setup, Want};
use slate_share::session::Options;

use crate::agents::{Agent, Number, output, wait_for, write};

/// From one value to the next.
const PERIOD: Duration = Duration::from_millis(1);

/// An agent that dials `hub`, reads its queue, and counts: its own values, and what it has read.
pub fn be_an_agent(setup: Setup, endpoint: &str) {
    let agent = Agent::start(setup);
    let mut counts = output(&agent.board, "out/count", 1024);
    let mut newest = output(&agent.board, "out/newest", 1);
    let mut read = output(&agent.board, "out/read", 1);
    let want = Want::new("out/count", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
    agent.peers.connect("hub", endpoint).unwrap();
    agent.peers.subscribe("hub", want).unwrap();
    let mut reader = queue(&agent, "agents/hub/out/count");
    let (mut number, mut seen) = (0, 0);
    loop {
        number += 1;
        write(&mut counts, number);
        write(&mut newest, number);
        let last = drain(&mut reader, |_| {});
        if let Some(last) = last {
            seen = last;
        }
        write(&mut read, seen);
        std::thread::sleep(PERIOD);
        // Whoever started this is gone.
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

/// A process, which ends with this.
pub struct Process(Child);

impl Process {
    pub fn start(command: &mut Command) -> Self {
        Self(command.stdin(Stdio::null()).spawn().unwrap())
    }

    #[allow(dead_code, reason = "not all tests do")]
    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
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
            let count = Want::new("out/count", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
            agent.peers.subscribe(name, count).unwrap();
            agent.peers.subscribe(name, Want::new("out/read", Options::default())).unwrap();
            readers.push(((*name).to_owned(), queue(&agent, &format!("agents/{name}/out/count"))));
        }
        (Self { agent, readers }, processes)
    }

    /// Runs for a while, writing a value each period; the longest a healthy agent was not heard of, and the longest
    /// that a write took.
    pub fn run(&mut self, time: Duration, writer: &mut Writer, ill: &str) -> (Duration, Duration) {
        let start = Instant::now();
        let mut heard: Vec<_> = self.readers.iter().map(|_| Instant::now()).collect();
        let (mut gap, mut longest) = (Duration::ZERO, Duration::ZERO);
        let mut number = writer.last().sequence;
        while start.elapsed() < time {
            number += 1;
            let begin = Instant::now();
            write(writer, number);
            longest = longest.max(begin.elapsed());
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
        (gap, longest)
    }

    /// A number among the states of its peers.
    pub fn state(&self, path: &str) -> Option<i128> {
        self.agent.board.read(path).ok().flatten()?.0.as_integer()
    }
}

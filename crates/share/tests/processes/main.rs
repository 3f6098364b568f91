//! Agents in processes of their own, of which some are killed, started again, or stopped for a while.
#![allow(clippy::unwrap_used, reason = "a test ends at the first surprise")]
#![allow(clippy::disallowed_methods, reason = "what real processes do takes real time")]

#[path = "../agents/mod.rs"]
mod agents;

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use agents::{Agent, Blob, Folder, Number, add, output, setup, wait_for, write};
use rustix::process::{Pid, Signal, kill_process};
use slate_blackboard::channel::{Latest, Policy, QueueReader, Start};
use slate_blackboard::interface::{Interface, Value};
use slate_share::peers::Want;
use slate_share::session::Options;

/// From one value to the next.
const PERIOD: Duration = Duration::from_millis(1);

/// A test of agents that reach each other in that way.
type Test = fn(&'static str);

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let ways = if cfg!(feature = "zenoh") { &["local", "tcp", "udp"][..] } else { &["local"] };
    if let [_, agent, name, endpoint] = &arguments[..]
        && agent == "agent"
    {
        return agent_main(name, endpoint);
    }
    if let [_, blobs, name, endpoint] = &arguments[..]
        && blobs == "blobs"
    {
        return blobs_main(name, endpoint);
    }
    let tests: [(&str, Test); 4] = [
        ("a_killed_agent_disturbs_nobody_and_is_seen_again", killed),
        ("a_stopped_agent_disturbs_nobody_and_catches_up", stopped),
        ("a_killed_agent_leaves_nothing_behind", left_behind),
        ("a_large_value_of_a_killed_agent_stays_right", large),
    ];
    let filter = arguments.get(1).filter(|argument| !argument.starts_with('-'));
    for (name, test) in tests {
        for way in ways {
            let name = format!("{way}::{name}");
            if filter.is_none_or(|filter| name.contains(filter.as_str())) {
                test(way);
                println!("test {name} ... ok");
            }
        }
    }
}

/// An agent that dials `hub`, reads its queue, and counts: its own values, and what it has read.
fn agent_main(name: &str, endpoint: &str) {
    let agent = Agent::start(setup(name));
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

/// Bytes of a large value.
const LARGE: usize = 1 << 20;

/// An agent that dials `hub`, and writes large values until whoever started this is gone.
fn blobs_main(name: &str, endpoint: &str) {
    let agent = Agent::start(setup(name));
    let property = add(&agent.board, "out/blob", Blob::DESCRIPTOR, LARGE, 1);
    let mut writer = property.channel().unwrap().writer().unwrap();
    agent.peers.connect("hub", endpoint).unwrap();
    for number in 1.. {
        let mut bytes = vec![number as u8; 8 + LARGE];
        bytes[..8].copy_from_slice(&u64::to_ne_bytes(number));
        writer.write(&bytes, LARGE, 0).unwrap();
        agent.peers.notifier().notify();
        std::thread::sleep(PERIOD);
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

struct Process(Child);

impl Process {
    fn start(name: &str, endpoint: &str) -> Self {
        Self::start_as("agent", name, endpoint)
    }

    fn start_as(role: &str, name: &str, endpoint: &str) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        Self(command.args([role, name, endpoint]).stdin(Stdio::null()).spawn().unwrap())
    }

    fn signal(&self, signal: Signal) {
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
struct Hub {
    agent: Agent,
    endpoint: String,
    readers: Vec<(String, QueueReader)>,
    _folder: Folder,
}

impl Hub {
    fn new(way: &'static str, names: &[&str]) -> (Self, Vec<Process>) {
        let folder = match way {
            #[cfg(feature = "zenoh")]
            "tcp" | "udp" => Folder::over(way),
            _ => Folder::new(),
        };
        let agent = Agent::listening("hub", &folder);
        let endpoint = folder.endpoint("hub");
        let processes: Vec<_> = names.iter().map(|name| Process::start(name, &endpoint)).collect();
        let mut readers = Vec::new();
        for name in names {
            wait_for("an agent", || agent.peers.is_connected(name));
            let count = Want::new("out/count", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
            agent.peers.subscribe(name, count).unwrap();
            agent.peers.subscribe(name, Want::new("out/read", Options::default())).unwrap();
            readers.push(((*name).to_owned(), queue(&agent, &format!("agents/{name}/out/count"))));
        }
        (Self { agent, endpoint, readers, _folder: folder }, processes)
    }

    /// Runs for a while, writing a value each period; the longest a healthy agent was not heard of, and the longest
    /// that a write took.
    fn run(
        &mut self,
        time: Duration,
        writer: &mut slate_blackboard::channel::Writer,
        ill: &str,
    ) -> (Duration, Duration) {
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

    fn state(&self, path: &str) -> Option<i128> {
        self.agent.board.read(path).ok().flatten()?.0.as_integer()
    }
}

/// How much longer than before a healthy agent may not be heard of: threads of a busy machine wait for each other for
/// longer than what an agent that hangs may cost.
const SLACK: Duration = Duration::from_millis(400);

fn report(what: &str, before: (Duration, Duration), during: (Duration, Duration)) {
    println!(
        "{what}: worst gap of healthy agents {:.1?}, before {:.1?}; longest write {:.1?}, before {:.1?}",
        during.0, before.0, during.1, before.1
    );
    assert!(during.0 < before.0 + SLACK, "the healthy agents wait for the one that is ill");
}

fn killed(way: &'static str) {
    let (mut hub, mut processes) = Hub::new(way, &["one", "two", "three"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    let before = hub.run(Duration::from_millis(800), &mut writer, "");
    processes[1].signal(Signal::KILL);
    let during = hub.run(Duration::from_millis(800), &mut writer, "two");
    report("killed", before, during);
    wait_for("its end to be seen", || !hub.agent.peers.is_connected("two"));
    wait_for("the state", || {
        let connected = hub.agent.board.read("peers/two/link/connected").unwrap().unwrap().0;
        connected == Value::Bool(false)
    });
    let (mirror, _) = hub.agent.board.find("agents/two/out/count").unwrap();
    assert!(!mirror.has_writer(), "readers see that its writer is gone");
    processes[1] = Process::start("two", &hub.endpoint);
    wait_for("the agent to be back", || hub.agent.peers.is_connected("two"));
    wait_for("its values", || mirror.has_writer());
    let sequence = writer.last().sequence;
    wait_for("it to have read what is new", || hub.agent.number("agents/two/out/read") >= Some(sequence));
    wait_for("the others to have read it", || hub.agent.number("agents/one/out/read") >= Some(sequence));
    wait_for("the second connection to be counted", || hub.state("peers/two/link/connections") == Some(2));
}

fn stopped(way: &'static str) {
    let (mut hub, processes) = Hub::new(way, &["one", "two"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    let before = hub.run(Duration::from_millis(800), &mut writer, "");
    processes[1].signal(Signal::STOP);
    // Longer than it takes until it is held to be gone.
    let during = hub.run(Duration::from_millis(3000), &mut writer, "two");
    processes[1].signal(Signal::CONT);
    report("stopped", before, during);
    wait_for("the agent to be back", || hub.agent.peers.is_connected("two"));
    hub.run(Duration::from_millis(100), &mut writer, "two");
    let sequence = writer.last().sequence;
    wait_for("it to have read what is new", || hub.agent.number("agents/two/out/read") >= Some(sequence));
    wait_for("the other one to have lost nothing", || {
        hub.agent.number("agents/one/out/read") == Some(sequence)
            && hub.state("peers/one/reads/out/count/lost") == Some(0)
    });
}

fn left_behind(way: &'static str) {
    let count = |folder: &str| std::fs::read_dir(folder).unwrap().count();
    let (mut hub, mut processes) = Hub::new(way, &["one"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    hub.run(Duration::from_millis(100), &mut writer, "one");
    let files = count("/proc/self/fd");
    let threads = count("/proc/self/task");
    for _ in 0..10 {
        processes[0].signal(Signal::KILL);
        wait_for("its end", || !hub.agent.peers.is_connected("one"));
        processes[0] = Process::start("one", &hub.endpoint);
        wait_for("the next one", || hub.agent.peers.is_connected("one"));
    }
    wait_for("as many files and threads as before", || {
        count("/proc/self/fd") <= files && count("/proc/self/task") <= threads
    });
}

fn large(way: &'static str) {
    let (hub, _) = Hub::new(way, &[]);
    let mut process = Process::start_as("blobs", "one", &hub.endpoint);
    wait_for("an agent", || hub.agent.peers.is_connected("one"));
    let want = Want::new("out/blob", Options::default()).expect(Blob::DESCRIPTOR, LARGE);
    hub.agent.peers.subscribe("one", want).unwrap();
    let (mirror, _) = hub.agent.board.find("agents/one/out/blob").unwrap();
    let channel = mirror.channel().unwrap();
    let check = |reader: &Latest| {
        let loan = reader.value().unwrap();
        let number = loan.bytes()[..8].try_into().map(u64::from_ne_bytes).unwrap();
        assert!(loan.bytes()[8..].iter().all(|byte| *byte == number as u8), "value {number} is torn");
        number
    };
    let mut readers = [(); 3].map(|()| channel.latest().unwrap());
    for round in 0..3 {
        // The first one holds a value for ever, others follow the newest.
        for _ in 0..100 {
            let newest = readers[1].cursor();
            wait_for("a value", || channel.published() > newest);
            readers[1].refresh();
            check(&readers[1]);
            if readers[0].value().is_none() {
                readers[0].refresh();
            }
        }
        process.signal(Signal::KILL);
        wait_for("its end", || !hub.agent.peers.is_connected("one") && !mirror.has_writer());
        readers[2].refresh();
        let _ = readers.each_ref().map(check);
        process = Process::start_as("blobs", "one", &hub.endpoint);
        let last = channel.published();
        wait_for("it to be back", || channel.published() > last);
        let numbers = readers.each_ref().map(check);
        assert!(numbers[0] <= numbers[2] || round > 0, "{numbers:?}");
    }
}

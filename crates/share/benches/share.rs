//! Benchmark of sharing: latency of a value from one process to another.
//! For comparison, the same run measures the time that the system needs to wake a thread and to carry a packet. Also
//! checks for lost values at 10 kHz.
//!
//! Each value holds the time at which it was published, as a module that writes in place does. The other process looks at the clock when its own thread has the
//! value, so a wake-up of that thread is part of the time.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]
#![allow(unsafe_code, reason = "a value is written in place, as modules do")]

#[path = "../tests/agents/mod.rs"]
mod agents;

use std::io::{BufRead, BufReader, Read};
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use agents::{Agent, Blob, Folder, Number, add, output, setup, wait_for, write};
use rustix::time::{ClockId, clock_gettime};
use slate_blackboard::channel::{Policy, Start};
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session::{Compression, Options};

const SAMPLES: usize = 1000;
const PAUSE: Duration = Duration::from_millis(2);

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, mode, endpoint, path] = &arguments[..] {
        match mode.as_str() {
            "latency" => return read_latency(endpoint, path),
            "rate" => return read_rate(endpoint, path.parse().unwrap()),
            _ => {}
        }
    }
    println!("{:<56}{:>10}{:>10}{:>10}", "one way, microseconds", "p50", "p99", "most");
    let wake = bare_wake();
    let packet = bare_socket();
    let small = latency(0);
    let medium = latency(64 << 10);
    let big = latency(1 << 20);
    println!("64 B beside a wake-up: {:.2}; beside a packet: {:.2}", small / wake, small / packet);
    println!("64 B beside two wake-ups and a packet: {:.2}", small / (2.0 * wake + packet));
    println!("64 KiB beside 64 B: {:.2}; 1 MiB beside 64 B: {:.2}", medium / small, big / small);
    rate("100 properties at 100 Hz each", 100, 100, true);
    rate("100 subscriptions of a property at 10 kHz", 100, 10_000, false);
}

/// Nanoseconds of a clock that all processes see.
fn now() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

fn report(name: &str, times: &mut [u64]) -> f64 {
    times.sort_unstable();
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize] as f64 / 1000.0;
    println!("{name:<56}{:>10.1}{:>10.1}{:>10.1}", at(0.5), at(0.99), at(1.0));
    at(0.5)
}

/// A thread wakes another one that sleeps.
fn bare_wake() -> f64 {
    let wake = Arc::new(Wake::new());
    let sent = Arc::new(AtomicU64::new(0));
    let sleeper = {
        let (wake, sent) = (Arc::clone(&wake), Arc::clone(&sent));
        thread::spawn(move || {
            // Two that follow each other closely wake it once, so it does not count them; 2 ends it.
            let mut times = Vec::new();
            while wake.wait() == 1 {
                times.push(now() - sent.load(Ordering::Acquire));
            }
            times
        })
    };
    for _ in 0..SAMPLES {
        thread::sleep(PAUSE);
        sent.store(now(), Ordering::Release);
        wake.notify(1);
    }
    thread::sleep(PAUSE);
    wake.notify(2);
    report("a bare wake-up", &mut sleeper.join().unwrap())
}

/// A thread sends a packet of 64 bytes to another one that waits for it.
fn bare_socket() -> f64 {
    let (sender, receiver) = UnixDatagram::pair().unwrap();
    let reader = thread::spawn(move || {
        let mut packet = [0; 64];
        let measure = |_| {
            receiver.recv(&mut packet).unwrap();
            now() - u64::from_ne_bytes(packet[..8].try_into().unwrap())
        };
        (0..SAMPLES).map(measure).collect::<Vec<_>>()
    });
    for _ in 0..SAMPLES {
        thread::sleep(PAUSE);
        let mut packet = [0; 64];
        packet[..8].copy_from_slice(&now().to_ne_bytes());
        sender.send(&packet).unwrap();
    }
    report("a bare packet of 64 B over a Unix socket", &mut reader.join().unwrap())
}

fn start(mode: &str, endpoint: &str, argument: &str) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([mode, endpoint, argument]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap()
}

/// The numbers that a process prints at its end.
fn numbers(child: &mut Child) -> Vec<u64> {
    let output = BufReader::new(child.stdout.take().unwrap());
    let numbers = output.lines().map(|line| line.unwrap().parse().unwrap()).collect();
    child.wait().unwrap();
    numbers
}

/// A value of an agent until another process has it.
fn latency(size: usize) -> f64 {
    let folder = Folder::new();
    let base = Agent::start(Setup { poll: None, ..setup("base") }.listen(&folder.endpoint("base")));
    let property = add(&base.board, "out/blob", Blob::DESCRIPTOR, size.max(56), 1);
    let mut writer = property.channel().unwrap().writer().unwrap();
    let mut child = start("latency", &folder.endpoint("base"), "out/blob");
    wait_for("a reader", || property.readers() == 1);
    thread::sleep(Duration::from_millis(300));
    let notifier = base.peers.notifier();
    let bytes = size.max(56);
    for _ in 0..SAMPLES {
        thread::sleep(PAUSE);
        let draft = writer.draft().as_mut_ptr();
        // SAFETY: the draft has room for the head and that many bytes, and is aligned for the head.
        unsafe {
            draft.add(8).write_bytes(7, bytes);
            draft.cast::<u64>().write(now());
        }
        writer.publish(bytes, 0).unwrap();
        // As the main loop does after a tick; the value is in the board by now.
        notifier.notify();
    }
    thread::sleep(Duration::from_millis(200));
    drop(child.stdin.take());
    let mut times = numbers(&mut child);
    assert!(times.len() > SAMPLES / 2, "{} values came", times.len());
    report(&format!("a property of {} B to another process", size.max(64)), &mut times)
}

fn ended() -> Arc<AtomicU64> {
    let ended = Arc::new(AtomicU64::new(0));
    let told = Arc::clone(&ended);
    thread::spawn(move || {
        let _ = std::io::stdin().read(&mut [0]);
        told.store(1, Ordering::Release);
    });
    ended
}

fn read_latency(endpoint: &str, path: &str) {
    let updated = Arc::new(Wake::new());
    let agent = Agent::start(Setup { updated: Some(Arc::clone(&updated)), ..setup("reader") });
    agent.peers.connect("base", endpoint).unwrap();
    let want = WantedProperty::new(path, Options::default().compression(Compression::None));
    agent.peers.subscribe("base", want.expect(Blob::DESCRIPTOR, 1 << 20)).unwrap();
    let (mirror, _) = agent.board.find(&format!("agents/base/{path}")).unwrap();
    let mut reader = mirror.channel().unwrap().latest().unwrap();
    let (ended, mut times) = (ended(), Vec::new());
    while ended.load(Ordering::Acquire) == 0 {
        updated.wait_timeout(Duration::from_millis(100));
        if reader.refresh() {
            let written = u64::from_ne_bytes(reader.value().unwrap().bytes()[..8].try_into().unwrap());
            times.push(now() - written);
        }
    }
    times.iter().for_each(|time| println!("{time}"));
}

/// Writes for two seconds, and says what has come and what was lost.
fn rate(name: &str, count: usize, hertz: u64, apart: bool) {
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    let properties = if apart { count } else { 1 };
    let store = slate_blackboard::Store {
        capacity: 0,
        depth: 8192,
        budget: slate_blackboard::channel::Budget { latest: 1, queues: 128, window: 64 },
    };
    let mut writers: Vec<_> = (0..properties)
        .map(|i| {
            let path = format!("out/p{i}");
            let access = slate_blackboard::Access::Output;
            let property =
                base.board.add_channel(&path, "A count.", Number::DESCRIPTOR, store, access).unwrap();
            property.channel().unwrap().writer().unwrap()
        })
        .collect();
    for i in properties..count {
        base.board.add_alias(&format!("out/p{i}"), "out/p0").unwrap();
    }
    let mut child = start("rate", &folder.endpoint("base"), &count.to_string());
    wait_for("all subscriptions", || {
        let readers = |i| base.board.find(&format!("out/p{i}")).unwrap().0.readers();
        if apart { (0..count).all(|i| readers(i) == 1) } else { readers(0) == count }
    });
    let (begin, seconds) = (Instant::now(), 2);
    let mut late = 0;
    for tick in 0..hertz * seconds {
        let due = Duration::from_nanos(1_000_000_000 / hertz * tick);
        match due.checked_sub(begin.elapsed()) {
            Some(left) => thread::sleep(left),
            None => late += 1,
        }
        writers.iter_mut().for_each(|writer| write(writer, tick + 1));
    }
    let took = begin.elapsed();
    thread::sleep(Duration::from_secs(3));
    drop(child.stdin.take());
    let result = numbers(&mut child);
    let written = hertz * seconds * count as u64;
    println!(
        "{name}: {written} values in {:.2} s ({late} ticks late), {} came, {} counted as lost",
        took.as_secs_f64(),
        result[0],
        result[1]
    );
    assert_eq!(result[0] + result[1], written, "what did not come is counted");
}

fn read_rate(endpoint: &str, count: usize) {
    let agent = Agent::start(setup("reader"));
    agent.peers.connect("base", endpoint).unwrap();
    for i in 0..count {
        let want = WantedProperty::new(&format!("out/p{i}"), Options::queue())
            .expect(Number::DESCRIPTOR, 0)
            .depth(16);
        agent.peers.subscribe("base", want).unwrap();
    }
    // The order of what came is tested elsewhere; here it is counted.
    let queue = agent.board.find("agents/base/out/p0").unwrap().0;
    let _reader = queue.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    let ended = ended();
    while ended.load(Ordering::Acquire) == 0 {
        thread::sleep(Duration::from_millis(20));
    }
    thread::sleep(Duration::from_millis(300));
    let sum = |what: &str| -> i128 {
        let read = |i| agent.board.read(&format!("peers/base/reads/out/p{i}/{what}")).unwrap().unwrap().0;
        (0..count).map(|i| read(i).as_integer().unwrap()).sum()
    };
    println!("{}\n{}", sum("received"), sum("lost"));
    let _ = output;
}

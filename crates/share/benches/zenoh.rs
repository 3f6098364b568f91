//! How long a value of 64 bytes is on its way to another process over TCP on this machine, beside what Zenoh alone needs,
//! from its `put` to its callback and the thread that this wakes, and beside a wake-up. The three take turns.
//!
//! `cargo bench -p slate-share --features comparison --bench zenoh`
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

#[path = "../tests/agents/mod.rs"]
mod agents;

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use agents::{Agent, Blob, Folder, add, setup, wait_for};
use bare_zenoh::qos::CongestionControl;
use bare_zenoh::{Config, Session, Wait};
use rustix::time::{ClockId, clock_gettime};
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_share::peers::{Setup, Want};
use slate_share::session::{Compression, Options};

const ROUNDS: usize = 3000;
const PAUSE: Duration = Duration::from_millis(1);

/// Bytes of a value: its number, the count of its items, and the items.
const BYTES: usize = 64;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    match &arguments[..] {
        [_, mode, endpoint] if mode == "ours" => read_ours(endpoint),
        [_, mode, port] if mode == "bare" => read_bare(port),
        _ => compare(),
    }
}

fn compare() {
    let folder = Folder::over("tcp");
    let base = Agent::start(Setup { poll: None, ..folder.setup("base") }.listen(&folder.endpoint("base")));
    let property = add(&base.board, "out/blob", Blob::DESCRIPTOR, BYTES, 4);
    let mut writer = property.channel().unwrap().writer().unwrap();
    let mut ours = start("ours", &folder.endpoint("base"));
    wait_for("the reader", || property.readers() == 1);

    let port = agents::net::port().to_string();
    let session = session("listen", &port);
    let publisher = session
        .declare_publisher("value")
        .congestion_control(CongestionControl::Drop)
        .express(true)
        .wait()
        .unwrap();
    let mut bare = start("bare", &port);
    wait_for("the subscriber", || publisher.matching_status().wait().unwrap().matching());

    let wake = Arc::new(Wake::new());
    let sent = Arc::new(AtomicU64::new(0));
    let sleeper = {
        let (wake, sent) = (Arc::clone(&wake), Arc::clone(&sent));
        thread::spawn(move || {
            let mut times = Vec::new();
            while wake.wait() == 1 {
                times.push(now() - sent.load(Ordering::Acquire));
            }
            times
        })
    };
    thread::sleep(Duration::from_millis(500));

    let notifier = base.peers.notifier();
    let mut bytes = [7; BYTES];
    for _ in 0..ROUNDS {
        thread::sleep(PAUSE);
        bytes[..8].copy_from_slice(&now().to_ne_bytes());
        writer.write(&bytes, BYTES - 8, 0).unwrap();
        notifier.notify();
        thread::sleep(PAUSE);
        bytes[..8].copy_from_slice(&now().to_ne_bytes());
        publisher.put(bytes.to_vec()).wait().unwrap();
        thread::sleep(PAUSE);
        sent.store(now(), Ordering::Release);
        wake.notify(1);
    }
    thread::sleep(Duration::from_millis(200));
    wake.notify(2);
    println!("{:<40}{:>10}{:>10}{:>10}", "one way, microseconds", "p50", "p99", "most");
    let wake = report("a wake-up", &mut sleeper.join().unwrap());
    let bare = report("64 B over bare Zenoh", &mut numbers(&mut bare));
    let ours = report("64 B as a property", &mut numbers(&mut ours));
    println!("beside bare Zenoh: {:+.2} wake-ups", (ours - bare) / wake);
}

fn session(which: &str, port: &str) -> Session {
    let mut config = Config::default();
    config.insert_json5("mode", "\"peer\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("scouting/gossip/enabled", "false").unwrap();
    config.insert_json5("listen/endpoints", "[]").unwrap();
    let endpoint = format!("[\"tcp/127.0.0.1:{port}\"]");
    config.insert_json5(&format!("{which}/endpoints"), &endpoint).unwrap();
    bare_zenoh::open(config).wait().unwrap()
}

/// Nanoseconds of a clock that all processes see.
fn now() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

fn report(name: &str, times: &mut [u64]) -> f64 {
    assert!(times.len() > ROUNDS / 2, "{name}: {} came", times.len());
    times.sort_unstable();
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize] as f64 / 1000.0;
    println!("{name:<40}{:>10.1}{:>10.1}{:>10.1}", at(0.5), at(0.99), at(1.0));
    at(0.5)
}

fn start(mode: &str, place: &str) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([mode, place]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap()
}

/// Ends a process, which says then what it has measured.
fn numbers(child: &mut Child) -> Vec<u64> {
    drop(child.stdin.take());
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let numbers = lines.map(|line| line.unwrap().parse().unwrap()).collect();
    child.wait().unwrap();
    numbers
}

/// Is 1 when the process that started this one wants it to end.
fn ended() -> Arc<AtomicU64> {
    let ended = Arc::new(AtomicU64::new(0));
    let told = Arc::clone(&ended);
    thread::spawn(move || {
        let _ = std::io::stdin().read(&mut [0]);
        told.store(1, Ordering::Release);
    });
    ended
}

fn read_ours(endpoint: &str) {
    let updated = Arc::new(Wake::new());
    let agent = Agent::start(Setup { updated: Some(Arc::clone(&updated)), ..setup("reader") });
    agent.peers.connect("base", endpoint).unwrap();
    let want = Want::new("out/blob", Options::default().compression(Compression::None));
    agent.peers.subscribe("base", want.expect(Blob::DESCRIPTOR, BYTES)).unwrap();
    let (mirror, _) = agent.board.find("agents/base/out/blob").unwrap();
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

fn read_bare(port: &str) {
    let wake = Arc::new(Wake::new());
    let newest = Arc::new(AtomicU64::new(0));
    let session = session("connect", port);
    let callback = {
        let (wake, newest) = (Arc::clone(&wake), Arc::clone(&newest));
        move |sample: bare_zenoh::sample::Sample| {
            let bytes = sample.payload().to_bytes();
            newest.store(u64::from_ne_bytes(bytes[..8].try_into().unwrap()), Ordering::Release);
            wake.notify(1);
        }
    };
    let _subscriber = session.declare_subscriber("value").callback(callback).wait().unwrap();
    let (ended, mut times, mut seen) = (ended(), Vec::new(), 0);
    while ended.load(Ordering::Acquire) == 0 {
        wake.wait_timeout(Duration::from_millis(100));
        let written = newest.load(Ordering::Acquire);
        if written != seen {
            seen = written;
            times.push(now() - written);
        }
    }
    times.iter().for_each(|time| println!("{time}"));
}

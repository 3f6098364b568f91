//! Agents in processes of their own, which are killed and start again; by hand more often:
//! `cargo test -p slate-network --features zenoh --test processes -- killed 1000`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]
#![allow(clippy::disallowed_methods, reason = "what real processes do takes real time")]

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../network/agent/mod.rs"]
mod agent;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../network/certificates.rs"]
mod certificates;

use std::io::Read;
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use agent::{Running, eventually};
use certificates::{Authority, Certificate};

/// How often the other agent is killed, unless the second argument says it.
const RESTARTS: u32 = 20;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, role, name, table] = &arguments[..]
        && role == "agent"
    {
        return be_an_agent(name, table);
    }
    let restarts = arguments.get(2).and_then(|count| count.parse().ok()).unwrap_or(RESTARTS);
    let tests: [(&str, &dyn Fn()); 3] = [
        ("a_killed_agent_comes_back_over_quic_and_leaves_nothing_behind", &|| killed(restarts)),
        ("a_stopped_agent_delays_no_other_over_quic", &stopped),
        ("ten_thousand_mutated_packets_disturb_nobody", &mutated),
    ];
    let filter = arguments.get(1).filter(|argument| !argument.starts_with('-'));
    for (name, test) in tests {
        if filter.is_none_or(|filter| name.contains(filter.as_str())) {
            test();
            println!("test {name} ... ok");
        }
    }
}

/// An agent, until its input is closed.
fn be_an_agent(name: &str, table: &str) {
    let agent = Running::start(name, table);
    let _ = std::io::stdin().read(&mut [0]);
    drop(agent);
}

/// A table `[network]` at an endpoint, for one other agent.
fn table(endpoint: &str, entries: &str, certificate: &Certificate, other: &str) -> String {
    let rights = format!("[network.security.allow.{other}]\nread = [\"sensor/**\"]");
    format!("{endpoint}\n{entries}\n{}\n{rights}", certificate.table())
}

fn start(name: &str, table: &str) -> Child {
    let own = std::env::current_exe().unwrap();
    Command::new(own).args(["agent", name, table]).stdin(Stdio::piped()).spawn().unwrap()
}

/// Files and threads of this process.
fn resources() -> [usize; 2] {
    ["fd", "task"].map(|kind| std::fs::read_dir(format!("/proc/self/{kind}")).unwrap().count())
}

/// One agent reads the other one, which is killed, and listens and dials by turns.
fn killed(restarts: u32) {
    let authority = Authority::new();
    let (own, other) = (authority.sign("base"), authority.sign("arm"));
    let ports = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let [listened, dialled] = ports.map(|socket| socket.local_addr().unwrap().port());
    let read = format!(
        "connect = [\"quic/127.0.0.1:{dialled}\"]\nread.\"driver/ambient\" = \"slate://arm/sensor/count\""
    );
    let base = table(&format!("listen = [\"quic/127.0.0.1:{listened}\"]"), &read, &own, "arm");
    let base = Running::start("base", &base);
    let (mut before, mut longest) = (None, Duration::ZERO);
    for restart in 0..restarts {
        let endpoint = match restart % 2 {
            0 => format!("connect = [\"quic/127.0.0.1:{listened}\"]"),
            _ => format!("listen = [\"quic/127.0.0.1:{dialled}\"]"),
        };
        let since = Instant::now();
        let mut arm = start("arm", &table(&endpoint, "", &other, "base"));
        let received = base.network().readings()[0].received;
        eventually("values", || base.network().readings()[0].received > received + 10);
        longest = longest.max(since.elapsed());
        arm.kill().unwrap();
        arm.wait().unwrap();
        let now = resources();
        // Zenoh starts its threads as it needs them.
        let (limit, memory_before) = *before.get_or_insert((now, memory()));
        assert!(
            restart < 4 || now.iter().zip(limit).all(|(now, limit)| *now <= limit + 16),
            "{now:?}, {limit:?}"
        );
        let grown = memory().saturating_sub(memory_before) >> 20;
        assert!(grown < 64, "{grown} MiB after {restart} restarts");
        if restart % 100 == 99 || restart + 1 == restarts {
            let [files, threads] = now;
            println!(
                "{} restarts: values at the latest after {} ms; {files} files, {threads} threads, {grown} MiB more",
                restart + 1,
                longest.as_millis()
            );
        }
    }
    eventually("its end", || base.network().agents() == ["base"]);
    assert_eq!(base.network().readings()[0].refused, 0);
}

/// Sends a signal to a process.
fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

/// One agent reads two, of which one is stopped while it reads the first, too.
fn stopped() {
    let authority = Authority::new();
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let read = "read.\"driver/ambient\" = \"slate://arm/sensor/count\"\nread.\"driver/goal\" = \"slate://leg/sensor/pose\"";
    let rights = "[network.security.allow.leg]\nread = [\"sensor/**\"]";
    let base = table(&format!("listen = [\"quic/127.0.0.1:{port}\"]"), read, &authority.sign("base"), "arm");
    let base = Running::start("base", &format!("{base}\n{rights}"));
    let connect = format!("connect = [\"quic/127.0.0.1:{port}\"]");
    let reads_base = "read.\"driver/ambient\" = \"slate://base/sensor/count\"";
    let [arm, leg] =
        ["arm", "leg"].map(|name| start(name, &table(&connect, reads_base, &authority.sign(name), "base")));
    let received = |input: usize| base.network().readings()[input].received;
    eventually("values of both", || received(0) > 10 && received(1) > 10);
    signal(&leg, "-STOP");
    let (start, mut longest) = (Instant::now(), Duration::ZERO);
    while start.elapsed() < Duration::from_secs(6) {
        let (before, since) = (received(0), Instant::now());
        eventually("values of the other one", || received(0) > before);
        longest = longest.max(since.elapsed());
    }
    assert!(longest < Duration::from_secs(2), "{longest:?} without a value");
    println!("longest time without a value: {} ms", longest.as_millis());
    eventually("its end", || base.network().agents() == ["arm", "base"]);
    signal(&leg, "-CONT");
    let before = received(1);
    eventually("values again", || received(1) > before + 10);
    for mut child in [arm, leg] {
        drop(child.stdin.take());
        assert!(child.wait().unwrap().success());
    }
}

/// Memory of this process, bytes.
fn memory() -> usize {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
    pages.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() * 4096
}

/// The first packet of a true handshake is changed in a few bytes, and sent again and again.
fn mutated() {
    let authority = Authority::new();
    let sockets = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let [port, trap_port] = sockets.each_ref().map(|socket| socket.local_addr().unwrap().port());
    let [socket, trap] = sockets;
    drop(socket);
    let read = "read.\"driver/ambient\" = \"slate://arm/sensor/count\"";
    let base = table(&format!("listen = [\"quic/127.0.0.1:{port}\"]"), read, &authority.sign("base"), "arm");
    let base = Running::start("base", &base);
    let connect = |port: u16| format!("connect = [\"quic/127.0.0.1:{port}\"]");
    let mut arm = start("arm", &table(&connect(port), "", &authority.sign("arm"), "base"));
    let received = || base.network().readings()[0].received;
    eventually("values", || received() > 10);
    let mut lab = start("lab", &table(&connect(trap_port), "", &authority.sign("lab"), "base"));
    let mut packet = [0; 2048];
    let length = trap.recv(&mut packet).unwrap();
    lab.kill().unwrap();
    lab.wait().unwrap();
    let before = memory();
    let mut random = 1_u64;
    let mut next = |limit: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % limit
    };
    for number in 0..10_000 {
        let mut bytes = packet[..length].to_vec();
        for _ in 0..=next(4) {
            // The header of the packet takes half of the changes.
            let place = next(if number % 2 == 0 { 64 } else { length });
            bytes[place] = next(256) as u8;
        }
        bytes.truncate(if number % 5 == 0 { next(length) } else { length });
        trap.send_to(&bytes, ("127.0.0.1", port)).unwrap();
        if number % 100 == 0 {
            let count = received();
            eventually("values meanwhile", || received() > count);
        }
    }
    let grown = memory().saturating_sub(before) >> 20;
    println!("memory has grown by {grown} MiB");
    assert!(grown < 64, "{grown} MiB");
    drop(arm.stdin.take());
    assert!(arm.wait().unwrap().success());
}

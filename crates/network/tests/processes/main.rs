//! Agents in processes of their own, which are killed and start again.
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

use agent::{Running, eventually};
use certificates::{Authority, Certificate};

/// How often the other agent is killed.
const RESTARTS: u32 = 20;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    match &arguments[..] {
        [_, role, table] if role == "agent" => be_an_agent(table),
        [_, filter, ..] if !filter.starts_with('-') && !NAME.contains(filter.as_str()) => {}
        _ => {
            killed();
            println!("test {NAME} ... ok");
        }
    }
}

const NAME: &str = "a_killed_agent_comes_back_over_quic_and_leaves_nothing_behind";

/// Agent `arm`, until nobody holds its input any more.
fn be_an_agent(table: &str) {
    let arm = Running::start("arm", table);
    let _ = std::io::stdin().read(&mut [0]);
    drop(arm);
}

/// A table `[network]` at an endpoint, for one other agent.
fn table(endpoint: &str, entries: &str, certificate: &Certificate, other: &str) -> String {
    let rights = format!("[network.security.allow.{other}]\nread = [\"sensor/**\"]");
    format!("{endpoint}\n{entries}\n{}\n{rights}", certificate.table())
}

fn start(table: &str) -> Child {
    let own = std::env::current_exe().unwrap();
    Command::new(own).args(["agent", table]).stdin(Stdio::piped()).spawn().unwrap()
}

/// Files and threads of this process.
fn resources() -> [usize; 2] {
    ["fd", "task"].map(|kind| std::fs::read_dir(format!("/proc/self/{kind}")).unwrap().count())
}

/// One agent reads the other one, which is killed, and listens and dials by turns.
fn killed() {
    let authority = Authority::new();
    let (own, other) = (authority.sign("base"), authority.sign("arm"));
    let ports = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let [listened, dialled] = ports.map(|socket| socket.local_addr().unwrap().port());
    let read = format!(
        "connect = [\"quic/127.0.0.1:{dialled}\"]\nread.\"driver/ambient\" = \"slate://arm/sensor/count\""
    );
    let base = table(&format!("listen = [\"quic/127.0.0.1:{listened}\"]"), &read, &own, "arm");
    let base = Running::start("base", &base);
    let mut before = None;
    for restart in 0..RESTARTS {
        let endpoint = match restart % 2 {
            0 => format!("connect = [\"quic/127.0.0.1:{listened}\"]"),
            _ => format!("listen = [\"quic/127.0.0.1:{dialled}\"]"),
        };
        let mut arm = start(&table(&endpoint, "", &other, "base"));
        let received = base.network().readings()[0].received;
        eventually("values", || base.network().readings()[0].received > received + 10);
        arm.kill().unwrap();
        arm.wait().unwrap();
        let now = resources();
        // Zenoh starts its threads as it needs them.
        let limit = *before.get_or_insert(now);
        assert!(
            restart < 4 || now.iter().zip(limit).all(|(now, limit)| *now <= limit + 16),
            "{now:?}, {limit:?}"
        );
    }
    eventually("its end", || base.network().agents() == ["base"]);
    assert_eq!(base.network().readings()[0].refused, 0);
}

//! Agents in network namespaces, with real faults of the network between them: loss, partition, too little of it. They
//! reach each other over TLS, as nothing else is let out of a machine. It takes root, and the tools `ip`, `tc` and `nft`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real networks do takes real time")]

#[path = "../agents/mod.rs"]
mod agents;
#[path = "../processes/hub.rs"]
mod hub;
mod network;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use agents::net::Authority;
use agents::process::Process;
use agents::{Folder, output, setup, wait_for};
use hub::{Cost, Hub, Tally, be_an_agent};
use network::{Fault, Network};
use slate_blackboard::Pattern;
use slate_blackboard::channel::Writer;
use slate_share::carrier::Carrier;
use slate_share::carrier::tls::{Credentials, Files, Tls};
use slate_share::peers::{Allowance, Rights, Setup};
use slate_sorted::SortedMap;

/// How much longer than before a healthy agent may not be heard of, and a write take, while another one's network is ill.
/// Threads of a busy machine wait for each other for longer than what the one may cost the other; a thread that waited for an ill
/// network would do so for as long as it is ill, which is seconds.
const SLACK: Duration = Duration::from_secs(1);

const NAMES: [&str; 3] = ["hub", "one", "two"];

/// How many values of the hub's queue are kept.
const KEPT: usize = 4096;

type Test = (&'static str, fn(&mut Scene));

const TESTS: [Test; 3] = [
    ("nothing_is_lost_where_a_fifth_of_all_packets_is", loss),
    ("a_partition_disturbs_nobody_else_and_leaves_nothing_when_it_is_healed", partition),
    ("a_slow_network_delays_nobody_else_and_what_it_cannot_carry_is_counted", too_little),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    match &arguments[..] {
        [_, agent, name, endpoint, folder] if agent == "agent" => {
            be_an_agent(protected(setup(name), Path::new(folder)), endpoint);
            ExitCode::SUCCESS
        }
        [_, hub, prefix, folder, filter] if hub == "hub" => {
            let mut scene = Scene::new(prefix, folder);
            for (name, test) in TESTS.iter().filter(|(name, _)| name.contains(filter.as_str())) {
                test(&mut scene);
                println!("test {name} ... ok");
            }
            ExitCode::SUCCESS
        }
        _ => {
            let filter = arguments.iter().skip(1).find(|argument| !argument.starts_with('-'));
            all(filter.map_or("", String::as_str))
        }
    }
}

/// Makes the network, and runs the tests in the namespace of the hub.
fn all(filter: &str) -> ExitCode {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "authority");
    for name in NAMES {
        let signed = authority.sign(name);
        std::fs::rename(signed.certificate, folder.path(&format!("{name}.pem"))).unwrap();
        std::fs::rename(signed.key, folder.path(&format!("{name}.key"))).unwrap();
    }
    let network = Network::new(&["one", "two"]);
    let mut command = network.command("hub");
    command.args(["hub", network.prefix()]).arg(folder.path("")).arg(filter);
    if command.status().unwrap().success() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What the agents know each other by, and what they may do.
fn protected(setup: Setup, folder: &Path) -> Setup {
    let name = setup.identity.agent.clone();
    let file = |ending: &str| folder.join(format!("{name}.{ending}"));
    let (certificate, key, authority) = (file("pem"), file("key"), folder.join("authority.pem"));
    let files = Files { certificate: &certificate, key: &key, authority: &authority };
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(Credentials::load(files, &name).unwrap(), true));
    let all = || Allowance { read: vec![Pattern::parse("out/*").unwrap()], ..Allowance::default() };
    let rights = Rights::restricted(NAMES.map(|name| (name.to_owned(), all())).into());
    Setup { carriers: SortedMap::from([("tls".into(), tls)]), rights, ..setup }
}

/// A hub, and two agents at the other ends of its cables.
struct Scene {
    hub: Hub,
    writer: Writer,
    _processes: Vec<Process>,
}

impl Scene {
    fn new(prefix: &str, folder: &str) -> Self {
        let endpoint = |name: &str| format!("tls:{}:7447", network::address(name));
        let setup = protected(setup("hub"), Path::new(folder));
        let setup = setup.listen(&endpoint("one")).listen(&endpoint("two"));
        let launch = |name: &str| {
            let mut command = network::command(prefix, name);
            Process::start(command.args(["agent", name, &endpoint(name), folder]))
        };
        let (hub, processes) = Hub::start(setup, &["one", "two"], launch);
        let writer = output(&hub.agent.board, "out/count", KEPT);
        Self { hub, writer, _processes: processes }
    }

    /// Runs for a while, in which agent `two` is healthy.
    fn run(&mut self, time: Duration) -> Cost {
        self.hub.run(time, &mut self.writer, "one")
    }

    /// Runs while something is wrong with the cable of agent `one`, until so many values are written, and shows that agent
    /// `two` does not feel it.
    fn suffer(&mut self, time: Duration, values: usize, fault: impl FnOnce() -> Fault) {
        let before = self.run(Duration::from_millis(800));
        let end = self.writer.last().sequence + values as u64;
        let fault = fault();
        loop {
            self.run(time).check(before, SLACK);
            if self.writer.last().sequence >= end {
                break;
            }
        }
        drop(fault);
    }

    /// How many values of the queue of agent `name` the hub has not got.
    fn lost(&self, name: &str) -> i128 {
        self.hub.state(&format!("peers/{name}/reads/out/count/lost")).unwrap()
    }

    /// What agent `name` has got of the hub's queue, as far as it is known here.
    fn tally(&self, name: &str) -> Option<Tally> {
        let (bytes, _) = self.hub.agent.newest(&format!("agents/{name}/out/tally"))?;
        let number = |at: usize| u64::from_ne_bytes(bytes[at * 8..][..8].try_into().unwrap());
        Some(Tally { came: number(0), missed: number(1), first: number(2), last: number(3) })
    }

    /// How many values of the hub's queue it has not got.
    fn missed(&self, name: &str) -> u64 {
        self.tally(name).unwrap().missed
    }

    /// Both agents come to know what the hub wrote last, and have counted all that came before.
    fn catch_up(&mut self) {
        wait_for("both agents", || NAMES[1..].iter().all(|name| self.hub.agent.peers.is_connected(name)));
        self.run(Duration::from_millis(50));
        let last = self.writer.last().sequence;
        for name in &NAMES[1..] {
            let tally = || self.tally(name).filter(|tally| tally.last == last);
            wait_for("the end that all come to", || tally().is_some());
            let tally = tally().unwrap();
            assert_eq!(tally.came + tally.missed, tally.last - tally.first + 1, "{name}");
        }
    }
}

fn loss(scene: &mut Scene) {
    scene.catch_up();
    let before = scene.missed("one");
    scene.suffer(Duration::from_secs(3), 0, || Fault::loss("one", 20));
    scene.catch_up();
    assert_eq!((scene.lost("one"), scene.missed("one") - before), (0, 0));
    assert_eq!((scene.lost("two"), scene.missed("two")), (0, 0));
}

fn partition(scene: &mut Scene) {
    scene.suffer(Duration::from_secs(5), 0, || Fault::partition("one"));
    scene.catch_up();
    assert_eq!((scene.lost("two"), scene.missed("two")), (0, 0));
    wait_for("it to be noticed", || scene.hub.state("peers/one/link/connections") > Some(1));
}

fn too_little(scene: &mut Scene) {
    scene.catch_up();
    let before = scene.missed("one");
    // A value takes about 50 bytes, so that the cable carries one of ten.
    scene.suffer(Duration::from_secs(4), 2 * KEPT, || Fault::rate("one", 50));
    scene.catch_up();
    assert!(scene.missed("one") > before, "the cable carries all of it");
    assert_eq!((scene.lost("two"), scene.missed("two")), (0, 0));
}

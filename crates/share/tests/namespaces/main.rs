//! Agents in network namespaces, with real faults of the network between them: loss, partition, too little of it. They
//! reach each other over TLS, as nothing else is let out of a machine. It takes root, and the tools `ip`, `tc` and `nft`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first surprise")]
#![allow(clippy::disallowed_methods, reason = "what real networks do takes real time")]

#[path = "../agents/mod.rs"]
mod agents;
#[path = "../processes/hub.rs"]
mod hub;
mod network;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use agents::net::Authority;
use agents::{Folder, output, setup, wait_for};
use hub::{Hub, Process, be_an_agent};
use network::{Fault, Network};
use slate_blackboard::Pattern;
use slate_blackboard::channel::Writer;
use slate_share::carrier::Carrier;
use slate_share::carrier::tls::{Credentials, Files, Tls};
use slate_share::peers::{Allowance, Rights, Setup};

/// How much longer than before a healthy agent may not be heard of while another one's network is ill. Threads of a busy
/// machine wait for each other for longer than what the one may cost the other.
const SLACK: Duration = Duration::from_millis(200);

const NAMES: [&str; 3] = ["hub", "one", "two"];

const TESTS: [(&str, fn(&mut Scene)); 3] = [
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
    Setup { carriers: BTreeMap::from([("tls".into(), tls)]), rights, ..setup }
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
        let writer = output(&hub.agent.board, "out/count", 4096);
        Self { hub, writer, _processes: processes }
    }

    /// Runs for a while; the longest that agent `two` was not heard of.
    fn run(&mut self, time: Duration) -> Duration {
        self.hub.run(time, &mut self.writer, "one").0
    }

    /// Runs while something is wrong with the cable of agent `one`, and shows that agent `two` does not feel it.
    fn suffer(&mut self, time: Duration, fault: impl FnOnce() -> Fault) {
        let before = self.run(Duration::from_millis(800));
        let fault = fault();
        let during = self.run(time);
        drop(fault);
        println!("worst gap of the healthy agent {during:.1?}, before {before:.1?}");
        assert!(during < before + SLACK, "the healthy agent waits for the one that is ill");
    }

    /// How many values of a queue agent `name` has not got.
    fn lost(&self, name: &str) -> i128 {
        self.hub.state(&format!("peers/{name}/reads/out/count/lost")).unwrap()
    }

    /// Both agents come to know what the hub wrote last.
    fn catch_up(&mut self) {
        wait_for("both agents", || NAMES[1..].iter().all(|name| self.hub.agent.peers.is_connected(name)));
        self.run(Duration::from_millis(50));
        let last = Some(self.writer.last().sequence);
        for name in &NAMES[1..] {
            let path = format!("agents/{name}/out/read");
            wait_for("the end that all come to", || self.hub.agent.number(&path) == last);
        }
    }
}

fn loss(scene: &mut Scene) {
    scene.suffer(Duration::from_secs(4), || Fault::loss("one", 20));
    scene.catch_up();
    assert_eq!(scene.lost("two"), 0);
}

fn partition(scene: &mut Scene) {
    scene.suffer(Duration::from_secs(5), || Fault::partition("one"));
    scene.catch_up();
    assert_eq!(scene.lost("two"), 0);
    wait_for("it to be noticed", || scene.hub.state("peers/one/link/connections") > Some(1));
}

fn too_little(scene: &mut Scene) {
    scene.suffer(Duration::from_secs(4), || Fault::rate("one", 100));
    scene.catch_up();
    assert_eq!(scene.lost("two"), 0);
}

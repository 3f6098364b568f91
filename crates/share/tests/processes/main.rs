//! Agents in processes of their own, of which some are killed, started again, or stopped for a while.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real processes do takes real time")]

#[path = "../agents/mod.rs"]
mod agents;
mod hanging;
mod hub;
mod large;

use std::process::Command;
use std::time::Duration;

use agents::process::Process;
use agents::{Folder, output, setup, wait_for};
use hub::{Hub, be_an_agent};
use rustix::process::Signal;
use slate_blackboard::interface::Value;
use slate_share::peers::Setup;

/// A test of agents that reach each other in that way.
type Test = fn(&'static str);

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let ways = if cfg!(feature = "tls") { &["local", "tls"][..] } else { &["local"] };
    if let [_, role, name, endpoint, files @ ..] = &arguments[..] {
        match role.as_str() {
            "agent" => return be_an_agent(setup_with(name, files), endpoint),
            "witness" => return hanging::be_a_witness(setup_with(name, files), endpoint),
            "blobs" => return large::be_an_agent(setup_with(name, files), endpoint),
            _ => {}
        }
    }
    let tests: [(&str, Test); 5] = [
        ("a_killed_agent_disturbs_nobody_and_is_seen_again", killed),
        ("a_stopped_agent_disturbs_nobody_and_catches_up", stopped),
        ("a_killed_agent_leaves_nothing_behind", left_behind),
        ("a_large_value_of_a_killed_agent_stays_right", large::killed),
        ("time_to_live_holds_for_another_agent", hanging::time_to_live_holds_for_another_agent),
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

/// What an agent is made of, which has a certificate if these files are of one.
fn setup_with(name: &str, files: &[String]) -> Setup {
    #[cfg(feature = "tls")]
    if let [certificate, key, authority] = files {
        let certificate = agents::net::Certificate { certificate: certificate.into(), key: key.into() };
        let carriers = agents::net::carriers(name, &certificate, authority.as_ref());
        return Setup { carriers, ..setup(name) };
    }
    assert!(files.is_empty(), "{files:?}");
    setup(name)
}

/// An agent of that name in a process of its own.
fn launch(name: &str, folder: &Folder) -> Process {
    let mut command = Command::new(std::env::current_exe().unwrap());
    Process::start(command.args(["agent", name, &folder.endpoint("hub")]).args(folder.files(name)))
}

/// A hub with agents of those names, and where they find each other.
fn start(way: &'static str, names: &[&str]) -> (Hub, Vec<Process>, Folder) {
    let folder = match way {
        #[cfg(feature = "tls")]
        "tls" => Folder::over_tls(),
        _ => Folder::new(),
    };
    let setup = folder.setup("hub").listen(&folder.endpoint("hub"));
    let (hub, processes) = Hub::start(setup, names, |name| launch(name, &folder));
    (hub, processes, folder)
}

/// How much longer than before a healthy agent may not be heard of, and a write take: threads of a busy machine wait for
/// each other for longer than what an agent that hangs may cost.
const SLACK: Duration = Duration::from_millis(400);

fn killed(way: &'static str) {
    let (mut hub, mut processes, folder) = start(way, &["one", "two", "three"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    let before = hub.run(Duration::from_millis(800), &mut writer, "");
    processes[1].signal(Signal::KILL);
    let during = hub.run(Duration::from_millis(800), &mut writer, "two");
    during.check(before, SLACK);
    wait_for("its end to be seen", || !hub.agent.peers.is_connected("two"));
    wait_for("the state", || {
        let connected = hub.agent.board.read("peers/two/link/connected").unwrap().unwrap().0;
        connected == Value::Bool(false)
    });
    let (mirror, _) = hub.agent.board.find("agents/two/out/count").unwrap();
    assert!(!mirror.has_writer(), "readers see that its writer is gone");
    processes[1] = launch("two", &folder);
    wait_for("the agent to be back", || hub.agent.peers.is_connected("two"));
    wait_for("its values", || mirror.has_writer());
    let sequence = writer.last().sequence;
    wait_for("it to have read what is new", || hub.agent.number("agents/two/out/read") >= Some(sequence));
    wait_for("the others to have read it", || hub.agent.number("agents/one/out/read") >= Some(sequence));
    wait_for("the second connection to be counted", || hub.state("peers/two/link/connections") == Some(2));
}

fn stopped(way: &'static str) {
    let (mut hub, processes, _folder) = start(way, &["one", "two"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    let before = hub.run(Duration::from_millis(800), &mut writer, "");
    processes[1].signal(Signal::STOP);
    // Longer than it takes until it is held to be gone.
    let during = hub.run(Duration::from_millis(3000), &mut writer, "two");
    processes[1].signal(Signal::CONT);
    during.check(before, SLACK);
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
    let (mut hub, mut processes, folder) = start(way, &["one"]);
    let mut writer = output(&hub.agent.board, "out/count", 1024);
    hub.run(Duration::from_millis(100), &mut writer, "one");
    let files = count("/proc/self/fd");
    let threads = count("/proc/self/task");
    for _ in 0..10 {
        processes[0].signal(Signal::KILL);
        wait_for("its end", || !hub.agent.peers.is_connected("one"));
        processes[0] = launch("one", &folder);
        wait_for("the next one", || hub.agent.peers.is_connected("one"));
    }
    wait_for("as many files and threads as before", || {
        count("/proc/self/fd") <= files && count("/proc/self/task") <= threads
    });
}

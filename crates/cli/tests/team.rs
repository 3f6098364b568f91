//! The example of a team, under the supervisor.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::collections::BTreeSet;
use std::process::{Child, Stdio};
use std::time::Duration;

use common::Running;
use serde_json::Value;

/// The supervisor with all of its agents.
struct Team(Child);

impl Drop for Team {
    fn drop(&mut self) {
        // A signal, so that it ends its agents.
        let pid = rustix::process::Pid::from_child(&self.0);
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        let _ = self.0.wait();
    }
}

/// Whether that is so within 60 s.
fn comes(mut is_so: impl FnMut() -> bool) -> bool {
    (0..600).any(|_| {
        let so = is_so();
        if !so {
            std::thread::sleep(Duration::from_millis(100));
        }
        so
    })
}

/// The newest value of a property of an agent; null when it can't be read.
fn read(running: &Running, agent: &str, path: &str) -> Value {
    let output = running.call(&["get", "--agent", agent, path, "--json"]);
    serde_json::from_slice::<Value>(&output.stdout).map_or(Value::Null, |got| got["value"].clone())
}

#[test]
fn eight_robots_learn_each_others_finds_and_ask_for_looks() {
    let running = Running::new("team");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/team/team.toml");
    let mut command = running.command(&["run", file]);
    let team = Team(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let names: Vec<String> = (1..=8).map(|robot| format!("r{robot}")).collect();
    let wanted: BTreeSet<String> = names.iter().cloned().collect();
    for agent in &names {
        let mut last = BTreeSet::new();
        let knows_all = || {
            let facts = read(&running, agent, "slate://team/obstacles/facts");
            let facts = facts.as_array().cloned().unwrap_or_default();
            let robots = facts.iter().filter_map(|fact| Some(fact["robot"].as_str()?.to_owned()));
            last = robots.collect();
            last == wanted
        };
        if !comes(knows_all) {
            let knowledge = read(&running, agent, "/share/knowledge");
            let peers = running.call(&["peers", "--agent", agent]);
            panic!(
                "{agent} knows facts of {last:?}: {knowledge}\n{}",
                String::from_utf8_lossy(&peers.stdout)
            );
        }
    }
    let listed = running.done(&["list", "slate://team/**", "--agent", "r1"]);
    assert!(listed.contains("slate://team/obstacles "), "{listed}");
    let typo = ["get", "slate://team/obstacle/facts", "--agent", "r1"];
    running.fails(4, &typo, &["no property at /team/obstacle", "team/obstacles"]);
    running.fails(2, &["get", "slate://team/obstacles/facts"], &["several agents are running"]);
    // What is wrong with a link is seen before it is made.
    for (code, to, from, words) in [
        (
            5,
            "slate://r2/scout/finder/found",
            "scout/execute/look",
            "sends messages, and `slate://r2/scout/finder/found`",
        ),
        (5, "scout/finder/range", "slate://team/obstacles", "FactTable has no field"),
        (4, "scout/atlas/obstacles", "slate://team/obstacels", "no property at /team/obstacels"),
        (
            4,
            "scout/atlas/obstacles",
            "slate://r22/scout/finder/found",
            "no agent `r22` is known; nearest: r2",
        ),
        (4, "scout/atlas/obstacles", "slate://r5/scuot/finder/fuond", "no property at slate://r5/"),
    ] {
        running.fails(code, &["link", to, from, "--agent", "r1", "--dry-run"], &[words]);
    }
    for (to, from) in [
        ("scout/atlas/obstacles", "slate://r5/scout/finder/found"),
        ("slate://r5/scout/explorer/orders", "scout/execute/look"),
    ] {
        running.done(&["link", to, from, "--agent", "r1", "--dry-run"]);
    }
    let told = comes(|| {
        let ended = read(&running, "r1", "/scout/execute/status/ended");
        let ended = ended.as_array().cloned().unwrap_or_default();
        ended.iter().any(|ended| ended["kind"] == "SendToInspect" && ended["ending"] == "COMPLETED")
    });
    assert!(told, "no robot has told another one");
    drop(team);
}

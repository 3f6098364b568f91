//! The example of a team, under the supervisor.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use std::collections::BTreeSet;
use std::process::{Child, Stdio};
use std::time::Duration;

use common::Running;
use serde_json::Value;

/// The supervisor with all of its agents.
struct Team(Child);

impl Drop for Team {
    fn drop(&mut self) {
        // It is asked to, so that it ends its agents.
        let pid = rustix::process::Pid::from_child(&self.0);
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        let _ = self.0.wait();
    }
}

fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    for _ in 0..600 {
        if is_so() {
            return;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("{what}: not within 60 s");
}

/// The newest value of a property of an agent; null when it can't be read.
fn read(running: &Running, agent: &str, path: &str) -> Value {
    let output = running.call(&["get", "--agent", agent, path, "--json"]);
    serde_json::from_slice::<Value>(&output.stdout).map_or(Value::Null, |got| got["value"].clone())
}

#[test]
fn eight_robots_come_to_know_what_each_of_them_finds_and_tell_each_other_to_look() {
    let running = Running::new("team");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/team/team.toml");
    let mut command = running.command(&["run", file]);
    let team = Team(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let names: Vec<String> = (1..=8).map(|robot| format!("r{robot}")).collect();
    let wanted: BTreeSet<String> = names.iter().cloned().collect();
    for agent in &names {
        wait_for("what all have found", || {
            let facts = read(&running, agent, "/team/obstacles/facts");
            let facts = facts.as_array().cloned().unwrap_or_default();
            let robots = facts.iter().filter_map(|fact| Some(fact["robot"].as_str()?.to_owned()));
            robots.collect::<BTreeSet<_>>() == wanted
        });
    }
    wait_for("a robot to have told another one", || {
        let ended = read(&running, "r1", "/scout/execute/status/ended");
        let ended = ended.as_array().cloned().unwrap_or_default();
        ended.iter().any(|ended| ended["kind"] == "SendToLook" && ended["ending"] == "COMPLETED")
    });
    drop(team);
}

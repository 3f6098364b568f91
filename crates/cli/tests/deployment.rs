//! Several agents of one file, under the supervisor.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use common::{Running, WORLD, text, wait_for};
use serde_json::Value;

/// A robot in its simulator and a watcher; neither ends by itself.
const AGENTS: &str = r#"
[share.agents.robot]
[share.agents.watcher]

[agents.robot]
time.source = "simulator"
modules.simulator = {}

[agents.watcher.modules.referee]
params = { robot = "r2", goal_tolerance = 0.1, time_limit = 1e6 }
[agents.watcher.links]
"referee/truth" = "slate://robot/simulator/r2/truth"
"#;

fn team_text() -> String {
    format!("{WORLD}{AGENTS}")
}

fn team(name: &str) -> Running {
    let running = Running::new(name);
    fs::write(running.folder().join("team.toml"), team_text()).unwrap();
    running
}

/// A process that was started, and what it has printed so far; it is killed when this is dropped.
struct Started {
    child: Child,
    lines: Arc<Mutex<Vec<String>>>,
    readers: Vec<JoinHandle<()>>,
}

impl Started {
    fn new(running: &Running, arguments: &[&str]) -> Self {
        let mut command = running.command(arguments);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let lines = Arc::<Mutex<Vec<String>>>::default();
        let streams: [Box<dyn std::io::Read + Send>; 2] =
            [Box::new(child.stdout.take().unwrap()), Box::new(child.stderr.take().unwrap())];
        let readers = streams.map(|stream| {
            let lines = Arc::clone(&lines);
            std::thread::spawn(move || {
                BufReader::new(stream).lines().for_each(|line| lines.lock().unwrap().push(line.unwrap()));
            })
        });
        Self { child, lines, readers: readers.into() }
    }

    fn printed(&self) -> Vec<String> {
        self.lines.lock().unwrap().clone()
    }

    fn says(&self, what: &str) -> bool {
        self.printed().iter().any(|line| line.contains(what))
    }

    fn id(&self) -> String {
        self.child.id().to_string()
    }

    fn signal(&self, signal: &str) {
        kill(signal, &self.id());
    }

    /// Waits for its end; all that it printed.
    fn finish(&mut self) -> (ExitStatus, String) {
        let status = self.child.wait().unwrap();
        self.readers.drain(..).for_each(|reader| reader.join().unwrap());
        (status, self.printed().join("\n"))
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn kill(signal: &str, id: &str) {
    assert!(std::process::Command::new("kill").args([signal, id]).status().unwrap().success());
}

/// The processes that another one has started, with their arguments.
fn children(parent: &str) -> Vec<(String, String)> {
    let ids = fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap();
    let arguments =
        |id: &str| fs::read_to_string(format!("/proc/{id}/cmdline")).unwrap_or_default().replace('\0', " ");
    ids.split_whitespace().map(|id| (id.to_owned(), arguments(id))).collect()
}

fn process(started: &Started, agent: &str) -> String {
    let option = format!("--agent={agent} ");
    children(&started.id()).into_iter().find(|(_, arguments)| arguments.contains(&option)).unwrap().0
}

/// Whether a process runs; a zombie does not.
fn runs(id: &str) -> bool {
    let stat = fs::read_to_string(Path::new("/proc").join(id).join("stat")).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| !rest.trim_start().starts_with('Z'))
}

/// How many values of the robot's truth the watcher got.
fn received(running: &Running) -> u64 {
    let output = running.call(&[
        "get",
        "--agent",
        "watcher",
        "--json",
        "/peers/robot/reads/simulator/r2/truth/received",
    ]);
    serde_json::from_slice::<Value>(&output.stdout)
        .ok()
        .and_then(|value| value["value"].as_u64())
        .unwrap_or(0)
}

fn wait_for_values(running: &Running) {
    let before = received(running);
    wait_for("values of the robot", || received(running) > before);
}

#[test]
fn the_example_runs_with_one_command_to_its_end() {
    let running = Running::new("team-example");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/sharing/team.toml");
    let mut started = Started::new(&running, &["run", example.to_str().unwrap(), "--json", "--seed", "3"]);
    wait_for("the agents", || running.call(&["module", "list", "--agent", "watcher"]).status.success());
    wait_for_values(&running);
    let (status, printed) = started.finish();
    assert_eq!(status.code(), Some(0), "{printed}");
    for line in [
        "agents: robot, watcher",
        "robot   | team-robot, seed 3: goal reached",
        "watcher | team-watcher, seed 3: goal reached",
        "robot ended with exit code 0",
        "watcher ended with exit code 0",
    ] {
        assert!(printed.lines().any(|printed| printed.starts_with(line)), "no `{line}` in:\n{printed}");
    }
    // The page of one of them suffices.
    let links: Vec<_> = printed.lines().filter(|line| line.contains("console: http")).collect();
    assert_eq!(links.len(), usize::from(cfg!(feature = "console")), "{printed}");
    let summary: Value =
        serde_json::from_str(printed.lines().find(|line| line.starts_with('{')).unwrap()).unwrap();
    for agent in ["robot", "watcher"] {
        let summary = &summary["agents"][agent];
        assert_eq!((&summary["code"], &summary["restarts"]), (&0.into(), &0.into()), "{summary}");
        assert_eq!(summary["summary"]["outcome"], "goal_reached", "{summary}");
        assert!(running.folder().join(format!("runs/team-{agent}-3/summary.json")).is_file());
    }
}

#[test]
fn a_robot_behaves_the_same_in_an_agent_of_its_own() {
    let running = Running::new("team-robots");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/exp1/agents.toml");
    let mut started = Started::new(&running, &["run", file.to_str().unwrap(), "--json", "--seed", "3"]);
    // Whichever agent has it, a property is found by the robot's name, and so it is in one agent.
    wait_for("the robot's driving", || running.call(&["get", "/r2/planner/state"]).status.success());
    let get = |path: &str| running.done(&["get", path]);
    assert_eq!(get("/r2/wheels/gate/mode").trim(), "ARMED", "the simulator embodies it");
    assert_eq!(get("/referee/params/robot").trim(), "r2");
    let (status, printed) = started.finish();
    assert_eq!(status.code(), Some(0), "{printed}");
    assert!(printed.contains("r2 ended with exit code 1"), "it ends when the mission has ended: {printed}");

    let summary = printed.lines().find(|line| line.starts_with('{')).unwrap();
    let apart = serde_json::from_str::<Value>(summary).unwrap()["agents"]["base"]["summary"].clone();
    let (together, _) = common::exp1(running.folder(), &["--seed", "3"]);
    let figure = |summary: &Value, name: &str| summary[name].as_f64().unwrap();
    for name in ["outcome", "collisions_caused"] {
        assert_eq!(apart[name], together[name], "{apart}");
    }
    // Between processes and by the wall clock, what a robot hears is some milliseconds older.
    let ratio = figure(&apart, "path_length_m") / figure(&together, "path_length_m");
    assert!((0.8..1.25).contains(&ratio), "{apart} beside {together}");
}

#[test]
fn the_same_file_serves_a_process_each() {
    let mut running = team("team-each");
    running.start("watcher", &["run", "team.toml", "--agent", "watcher", "--headless"]);
    running.start("robot", &["run", "team.toml", "--agent", "robot", "--headless", "--out", "reports"]);
    wait_for_values(&running);
    wait_for("the robot's place", || running.read("watcher", "/referee/truth/x") == 0.6);
    running.kill();
    running.interrupt();
    let output = running.finish();
    assert!(!text(&output.stdout).contains("robot |"), "{output:?}");
    assert!(running.folder().join("reports/summary.json").is_file());
}

#[test]
fn a_crashed_agent_restarts_disarmed_a_finished_one_does_not() {
    let running = Running::new("team-crash");
    // It drives, and never comes to this goal.
    let exp1 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/exp1/exp1.toml");
    let robot = format!(
        "[agents.robot]\ninclude = {exp1:?}\nmodules.referee.params.time_limit = 1e6\n\
                         world.layout = \"authors\"\nworld.goal = [1.9, -1.9]\n"
    );
    let team = team_text();
    let (head, rest) = team.split_at(team.find("[agents.robot]").unwrap());
    let watcher = &rest[rest.find("[agents.watcher").unwrap()..];
    fs::write(running.folder().join("team.toml"), format!("{head}{robot}{watcher}")).unwrap();
    let mut started = Started::new(&running, &["run", "team.toml", "--out", "reports"]);
    wait_for("the agents", || running.call(&["module", "list", "--agent", "watcher"]).status.success());
    wait_for_values(&running);
    let first = process(&started, "robot");
    let armed = || running.done(&["get", "--agent", "robot", "/r2/wheels/gate/mode"]).trim() == "ARMED";
    wait_for("the arming", armed);
    kill("-KILL", &first);
    wait_for("the other robot", || {
        started.says("robot ended by signal 9 (killed); restarting in 100 ms, disarmed")
    });
    wait_for("the robot's process", || {
        children(&started.id()).iter().any(|(id, arguments)| *id != first && arguments.contains("--disarmed"))
            && running.call(&["module", "list", "--agent", "robot"]).status.success()
    });
    wait_for_values(&running);
    assert!(!armed(), "it waits for a person");
    running.done(&["arm", "--agent", "robot"]);
    wait_for("the arming", armed);

    kill("-TERM", &process(&started, "watcher"));
    wait_for("the end of the watcher", || started.says("watcher ended with exit code 1"));
    wait_for("the end of its process", || children(&started.id()).len() == 1);
    started.signal("-TERM");
    let (status, printed) = started.finish();
    assert_eq!(status.code(), Some(1), "{printed}");
    assert!(!printed.contains("watcher ended by"), "{printed}");
    assert!(running.folder().join("reports/robot/summary.json").is_file());
    assert!(running.folder().join("reports/watcher/summary.json").is_file());
}

#[test]
fn an_agent_that_always_crashes_is_given_up() {
    let running = team("team-limit");
    let started = Started::new(&running, &["run", "team.toml"]);
    wait_for("the agents", || running.call(&["module", "list", "--agent", "robot"]).status.success());
    let mut last = String::new();
    for _ in 0..6 {
        wait_for("the next robot", || {
            let robot = children(&started.id())
                .into_iter()
                .find(|(id, arguments)| *id != last && runs(id) && arguments.contains("--agent=robot "));
            robot.is_some_and(|(id, _)| {
                kill("-ABRT", &id);
                last = id;
                true
            })
        });
    }
    wait_for("the end", || started.says("(abort); it was restarted 5 times within 60 s and stays off"));
    assert!(
        running.call(&["module", "list", "--agent", "watcher"]).status.success(),
        "the other one goes on"
    );
}

#[test]
fn agents_end_with_their_supervisor() {
    for (test, signal) in [("team-orphans", "-KILL"), ("team-interrupt", "-INT"), ("team-timeout", "-TERM")] {
        let running = team(test);
        let mut started = Started::new(&running, &["run", "team.toml", "--out", "reports"]);
        wait_for("the agents", || {
            ["robot", "watcher"]
                .iter()
                .all(|agent| running.call(&["module", "list", "--agent", agent]).status.success())
        });
        let agents = children(&started.id());
        assert_eq!(agents.len(), 2, "{agents:?}");
        started.signal(signal);
        if signal == "-TERM" {
            // As `timeout` does: once to the process and once to its group.
            started.signal(signal);
        }
        let (status, printed) = started.finish();
        wait_for("their ends", || !agents.iter().any(|(id, _)| runs(id)));
        if signal == "-INT" {
            assert_eq!(status.code(), Some(1), "{printed}");
            assert!(
                printed.contains("robot ended with exit code 1\n")
                    || printed.ends_with("robot ended with exit code 1"),
                "{printed}"
            );
        }
        // Both ended in an orderly way.
        for agent in ["robot", "watcher"] {
            wait_for("the report", || {
                running.folder().join(format!("reports/{agent}/summary.json")).is_file()
            });
        }
    }
}

#[test]
fn one_refusal_starts_no_agent() {
    let running = team("team-refused");
    let folder = running.folder();
    let refused = |file: &str, arguments: &[&str], words: &[&str]| {
        running.fails(2, &[&["run", file], arguments].concat(), words);
        assert!(!folder.join("runs").exists(), "nothing was started");
    };
    // What the file shows, and what only the plugins know.
    fs::write(folder.join("keys.toml"), "[agents.a.loop]\nperiods = 1\n[agents.b]\n").unwrap();
    refused("keys.toml", &[], &["unknown key `periods`", "keys.toml:2:1"]);
    refused("keys.toml", &["--agent", "b"], &["unknown key `periods`", "keys.toml:2:1"]);
    let typo = team_text().replace("tolerance", "tolerances");
    fs::write(folder.join("parameters.toml"), typo).unwrap();
    refused("parameters.toml", &[], &["watcher |", "did you mean `goal_tolerance`?", "no agent is started"]);
    let twice = "[agents.a]\nshare.listen = \"local:x\"\n[agents.b]\nshare.listen = \"local:x\"\n";
    fs::write(folder.join("twice.toml"), twice).unwrap();
    refused("twice.toml", &[], &["local:x", "in use"]);
    let one_log = "[log.targets.file]\npath = \"agent.log\"\n[agents.a]\n[agents.b]\n";
    fs::write(folder.join("log.toml"), one_log).unwrap();
    refused("log.toml", &[], &["`a` and `b` would write the same file", "log.toml:2"]);
    let same = "[agents.a.log.targets.file]\npath = \"./agent.log\"\n\
                [agents.b.log.targets.file]\npath = \"../team-refused/../team-refused/agent.log\"\n";
    let own = folder.file_name().unwrap().to_str().unwrap();
    fs::write(folder.join("same.toml"), same.replace("team-refused", own)).unwrap();
    refused("same.toml", &[], &["`a` and `b` would write the same file", "same.toml:4"]);
    // Names.
    refused("team.toml", &["--agent", "watchr"], &["no agent is called `watchr`", "did you mean `watcher`?"]);
    refused("team.toml", &["--set", "agents.watchr.loop.period=1ms"], &["no agent is called `watchr`"]);
    refused("team.toml", &["--resume", "x"], &["a snapshot belongs to one agent", "--agent robot"]);
    running.fails(2, &["batch", "team.toml"], &["several agents are described", "`robot`, `watcher`"]);
    refused("exp1", &["--agent", "robot"], &["no agent is called `robot`", "`exp1`"]);
}

#[test]
fn settings_apply_to_one_agent_or_all_and_are_saved_accordingly() {
    let running = team("team-settings");
    let sets = ["--set", "agents.watcher.loop.period=30ms", "--set", "loop.hang=3s"];
    let _started = Started::new(&running, &[&["run", "team.toml"], &sets[..]].concat());
    let get =
        |agent: &str, path: &str| text(&running.call(&["config", "get", "--agent", agent, path]).stdout);
    wait_for("the agents", || !get("robot", "loop").is_empty() && !get("watcher", "loop").is_empty());
    assert!(get("watcher", "loop.period").contains("30ms") && get("robot", "loop.period").contains("20ms"));
    assert!(get("watcher", "loop.hang").contains("3s") && get("robot", "loop.hang").contains("3s"));
    running.done(&["config", "set", "--agent", "watcher", "modules.referee.params.goal_tolerance=0.2"]);
    running.done(&["config", "save", "--agent", "watcher"]);
    let saved = fs::read_to_string(running.folder().join("team.toml")).unwrap();
    assert_eq!(saved, team_text().replace("tolerance = 0.1", "tolerance = 0.2"));
}

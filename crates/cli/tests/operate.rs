//! Operation of a robot from a terminal: goals, keys, and requests over HTTP.
#![cfg(feature = "console")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::disallowed_methods, reason = "a test that fails panics")]

use crate::common;

use std::fs::Permissions;
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use common::{Running, json, text, wait_for};
use serde_json::Value;

/// A run without an end, whose robot has no reflexes, as these go before a person.
const EXP1: [&str; 11] = [
    "run",
    "exp1",
    "--headless",
    "--rate",
    "realtime",
    "--set",
    "robots.r2.modules.avoid_obstacle.enabled=false",
    "--set",
    "modules.referee.enabled=false",
    "--set",
    "console.port=0",
];

#[test]
fn unread_goals_are_reported_as_ineffective() {
    let mut running = Running::new("goal-unread");
    running.start("exp3", &["run", "exp3", "--headless", "--rate", "0.3"]);
    let words = ["no module has a settable goal", "the goals of r2/knowledge, r3/knowledge have no reader"];
    running.fails(4, &["goal", "1", "0", "--yes"], &words);
}

fn started(name: &str) -> Running {
    let mut running = Running::new(name);
    running.start("exp1", &EXP1);
    wait_for("its console", || running.call(&["console"]).status.success());
    running
}

/// The command at a terminal of its own, with what is typed there.
struct Terminal(Child);

impl Terminal {
    fn new(running: &Running, arguments: &str) -> Self {
        let command = format!("{} {arguments}", env!("CARGO_BIN_EXE_slate"));
        let mut script = std::process::Command::new("script");
        script.args(["-qec", &command, "/dev/null"]).env("XDG_RUNTIME_DIR", running.sockets());
        script.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(script.current_dir(running.folder()).spawn().unwrap())
    }

    fn press(&mut self, keys: &[u8]) {
        if self.0.stdin.as_mut().unwrap().write_all(keys).is_err() {
            let mut said = String::new();
            self.0.stdout.as_mut().unwrap().read_to_string(&mut said).unwrap();
            panic!("it has ended: {said}");
        }
    }

    /// Presses Esc, again when it is not noticed: the terminal may still be about to hand over single keys.
    fn leave(&mut self) {
        for _ in 0..300 {
            // It may have ended meanwhile.
            let _ = self.0.stdin.as_mut().unwrap().write_all(b"\x1b");
            std::thread::sleep(Duration::from_millis(100));
            if self.0.try_wait().unwrap().is_some() {
                return;
            }
        }
        panic!("it goes on");
    }

    /// What it ended with, and what it showed.
    fn end(self) -> (Option<i32>, String) {
        let output = self.0.wait_with_output().unwrap();
        (output.status.code(), text(&output.stdout))
    }
}

fn holder(running: &Running) -> Value {
    running.ask("exp1", "GET", "/leases", "")[0]["holder"].clone()
}

fn priority(running: &Running) -> String {
    running.read("exp1", "/r2/wheels/gate/priority").as_str().unwrap_or_default().to_owned()
}

#[test]
fn a_robot_is_driven_by_keys_and_stops_when_none_is_pressed() {
    let running = started("teleop");
    let mut terminal = Terminal::new(&running, "teleop --speed 0.2");
    wait_for("the controls", || holder(&running).as_str().is_some_and(|who| who.starts_with("slate teleop")));
    let wheels = || {
        let command = running.read("exp1", "/r2/wheels/command");
        (command["left"].as_f64().unwrap(), command["right"].as_f64().unwrap())
    };
    // Held, as a terminal repeats it.
    let hold = |terminal: &mut Terminal, key: &[u8], drives: &dyn Fn((f64, f64)) -> bool| {
        for _ in 0..200 {
            terminal.press(key);
            std::thread::sleep(Duration::from_millis(30));
            if priority(&running) == "TELEOPERATION" && drives(wheels()) {
                return;
            }
        }
        panic!("{:?} by {}", wheels(), priority(&running));
    };
    // 0.2 m/s by wheels of 9.75 cm.
    hold(&mut terminal, b"w", &|(left, right)| (left - right).abs() < 1e-9 && (left - 2.05).abs() < 0.1);
    let last = Instant::now();
    while running.read("exp1", "/r2/wheels/command/left") != 0.0 {
        assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    }
    // The plan would drive on, and does not while a person has the controls.
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(running.read("exp1", "/r2/wheels/command"), serde_json::json!({ "left": 0.0, "right": 0.0 }));
    hold(&mut terminal, b"\x1b[D", &|(left, right)| left < 0.0 && right > 0.0);
    terminal.press(b" ");
    wait_for("the stop", || running.read("exp1", "/r2/wheels/gate/mode") == "STOPPED");
    let taken = running.ask("exp1", "POST", "/leases", r#"{"actuator":"r2/wheels"}"#);
    assert_eq!(taken["code"], "S108", "{taken}");
    terminal.leave();
    let (code, shown) = terminal.end();
    assert_eq!(code, Some(0), "{shown}");
    assert!(shown.contains("w a s d") && shown.contains("is released"), "{shown}");
    assert_eq!(holder(&running), Value::Null);
}

#[test]
fn robot_stops_when_its_operator_disconnects() {
    let running = started("teleop-gone");
    let mut terminal = Terminal::new(&running, "teleop r2/wheels");
    wait_for("the controls", || holder(&running).is_string());
    let process = holder(&running);
    let process = process.as_str().unwrap().rsplit(' ').next().unwrap();
    wait_for("the teleoperation", || {
        terminal.press(b"w");
        priority(&running) == "TELEOPERATION"
    });
    let killed = Instant::now();
    assert!(std::process::Command::new("kill").args(["-KILL", process]).status().unwrap().success());
    while priority(&running) == "TELEOPERATION" {
        assert!(killed.elapsed() < Duration::from_millis(250), "{:?}", killed.elapsed());
    }
    wait_for("the controls", || holder(&running).is_null());
    terminal.end();
}

#[test]
fn teleoperation_reports_what_is_missing() {
    let running = started("teleop-refused");
    running.fails(2, &["teleop"], &["stdin is not a terminal", "terminal"]);
    let (code, shown) = Terminal::new(&running, "teleop r2/weels").end();
    assert_eq!(code, Some(4), "{shown}");
    assert!(shown.contains("no actuator is called `r2/weels`") && shown.contains("r2/wheels"), "{shown}");
}

#[test]
fn a_goal_is_set_where_the_robot_keeps_it() {
    let running = started("goal");
    running.fails(2, &["goal", "1", "0.5"], &["--yes"]);
    let said = json(&running.call(&["goal", "-0.5", "1.25", "--yes", "--json"]));
    assert_eq!(
        (&said["schema"], &said["module"]),
        (&"slate.goal/1".into(), &"r2/knowledge".into()),
        "{said}"
    );
    wait_for("the goal", || {
        let goal = running.read("exp1", "/r2/knowledge/goal");
        goal["x"] == -0.5 && goal["y"] == 1.25
    });
    running.fails(2, &["goal", "1", "0.5", "90deg", "--yes"], &["`r2/knowledge`", "no heading"]);
    let others = ["`r7` has no settable goal", "robots with a settable goal: r2/knowledge"];
    running.fails(4, &["goal", "1", "0.5", "--of", "r7", "--yes"], &others);
    for far in [["1e9", "0"], ["0", "-3"]] {
        running.fails(
            5,
            &["goal", far[0], far[1], "--yes"],
            &["outside the world, which extends from [-2.5, -2.475] to"],
        );
    }
    running.fails(2, &["goal", "1", "inf", "--yes"], &["meters"]);
}

#[test]
fn any_operation_of_the_api_is_called_by_its_path() {
    let running = started("api");
    let agent: Value = serde_json::from_str(&running.done(&["api", "GET", "/agent"])).unwrap();
    assert_eq!((&agent["name"], &agent["role"]), (&"exp1".into(), &"developer".into()));
    assert!(running.done(&["api"]).contains("/leases"));
    let body = r#"{"enabled": false}"#;
    let switched: Value =
        serde_json::from_str(&running.done(&["api", "put", "/modules/r2/pass_range", body])).unwrap();
    assert_eq!(switched["changed"], true);
    std::fs::write(running.folder().join("on.json"), r#"{"enabled": true}"#).unwrap();
    running.done(&["api", "PUT", "modules/r2/pass_range", "@on.json"]);
    running.fails(
        5,
        &["api", "PUT", "/modules/r2/pass_range", body, "--role", "viewer"],
        &["viewer may not"],
    );
    running.fails(4, &["api", "GET", "/slate/exp1/nothing/there"], &["no property at"]);
    running.fails(2, &["api", "PUT", "/modules/r2/pass_range", "{enabled"], &["`{enabled` is not JSON"]);
    running.fails(2, &["api", "GET", "/a b"], &["%"]);
    running.done(&["api", "GET", "/openapi.json", "--out", "openapi.json"]);
    let document = std::fs::read_to_string(running.folder().join("openapi.json")).unwrap();
    assert!(document.contains("\"3.1.0\""));
    // A stream continues until its reader ends.
    let path = "/slate/exp1/simulator/r2/truth";
    let mut stream = running.command(&["api", "GET", path, "--accept", "text/event-stream"]);
    let mut stream = stream.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(stream.stdout.take().unwrap()));
    assert!(lines.any(|line| line.unwrap().starts_with("data: {")));
    drop(lines);
    assert_eq!(stream.wait().unwrap().code(), Some(0));
}

#[test]
fn api_reaches_an_agent_without_a_console() {
    let mut running = Running::new("api-socket");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "realtime"]);
    running.fails(3, &["console"], &["its web console is off"]);
    let agent = json(&running.call(&["api", "GET", "/agent", "--role", "viewer"]));
    assert_eq!((&agent["name"], &agent["role"]), (&"exp1".into(), &"viewer".into()));
    assert!(running.done(&["api"]).contains("/leases"));
    running.done(&["api", "POST", "/log", r#"{"text": "a note"}"#]);
    assert!(running.done(&["log"]).contains("a tool: a note"));
    let path = "/slate/exp1/simulator/r2/truth";
    let mut stream = running.command(&["api", "GET", path, "--accept", "text/event-stream"]);
    let mut stream = stream.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(stream.stdout.take().unwrap()));
    assert!(lines.any(|line| line.unwrap().starts_with("data: {")));
    drop(lines);
    assert_eq!(stream.wait().unwrap().code(), Some(0));
}

#[test]
fn trajectory_has_route_of_each_point() {
    let running = started("trails");
    let points = || {
        let trails: Value =
            serde_json::from_str(&running.done(&["api", "GET", "/documents/trails", "--role", "viewer"]))
                .unwrap();
        let trail = trails["robots"]["r2"].clone();
        assert_eq!(trail["time"].as_array().map(Vec::len), trail["route"].as_array().map(Vec::len));
        trail
    };
    wait_for("the robot's way", || points()["time"].as_array().is_some_and(|times| times.len() > 20));
    let trail = points();
    let routes = trail["route"].as_array().unwrap();
    assert!(routes.iter().any(|route| route == "deliberative"), "{trail}");
    assert!(trail["x"].as_array().unwrap().iter().all(Value::is_number), "{trail}");
}

#[test]
fn the_link_has_the_secret_of_a_role_and_needs_a_console() {
    let mut running = started("console-link");
    let link = running.done(&["console"]);
    assert!(link.starts_with("http://127.0.0.1:") && link.contains("/#token="), "{link}");
    let viewer = json(&running.call(&["console", "--role", "viewer", "--json"]));
    assert_eq!((&viewer["role"], &viewer["agent"]), (&"viewer".into(), &"exp1".into()));
    assert_ne!(viewer["link"], link.trim());
    // A browser with a URL to open.
    let browser = running.folder().join("browser");
    std::fs::write(&browser, "#!/bin/sh\nprintf %s \"$1\" > opened\n").unwrap();
    std::fs::set_permissions(&browser, Permissions::from_mode(0o755)).unwrap();
    let opened = running.command(&["console", "--open"]).env("BROWSER", &browser).output().unwrap();
    assert!(opened.status.success(), "{opened:?}");
    wait_for("the browser", || {
        std::fs::read_to_string(running.folder().join("opened")).is_ok_and(|opened| opened == link.trim())
    });
    // A second one of that name, which is not reachable over HTTP.
    running.start("exp1-2", &["run", "exp1", "--headless", "--rate", "1"]);
    running.fails(3, &["console", "--agent", "exp1-2"], &["exp1-2", "console.port"]);
    assert_eq!(running.done(&["console", "--agent", "exp1"]), link);
}

/// Carries connections from one socket to another one, as `ssh -L` does.
fn forward(from: &Path, to: PathBuf) {
    std::fs::create_dir_all(from.parent().unwrap()).unwrap();
    std::fs::set_permissions(from.parent().unwrap(), Permissions::from_mode(0o700)).unwrap();
    let listener = UnixListener::bind(from).unwrap();
    std::thread::spawn(move || {
        for near in listener.incoming() {
            let (near, far) = (near.unwrap(), UnixStream::connect(&to).unwrap());
            for (mut from, mut to) in [(near.try_clone().unwrap(), far.try_clone().unwrap()), (far, near)] {
                std::thread::spawn(move || {
                    let _ = std::io::copy(&mut from, &mut to);
                    let _ = to.shutdown(std::net::Shutdown::Both);
                });
            }
        }
    });
}

#[test]
fn an_agent_behind_a_forwarded_socket_works_like_a_local_one() {
    let running = started("forwarded");
    let elsewhere = Running::new("elsewhere");
    let socket = |run: &Running, name: &str| run.sockets().join("slate").join(name);
    forward(&socket(&elsewhere, "robot.sock"), socket(&running, "exp1.sock"));
    assert!(elsewhere.done(&["module", "list"]).contains("r2/planner"));
    elsewhere.done(&["set", "/r2/planner/params/max_linear_velocity", "0.3"]);
    assert_eq!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 0.3);
    let mut terminal = Terminal::new(&elsewhere, "teleop --agent robot");
    wait_for("the controls", || holder(&running).is_string());
    terminal.leave();
    assert_eq!(terminal.end().0, Some(0));
    wait_for("the controls", || holder(&running).is_null());
}

#[test]
fn there_is_a_page_for_man_of_each_verb() {
    let running = Running::new("man");
    running.done(&["man", "pages"]);
    let page = |name: &str| std::fs::read_to_string(running.folder().join("pages").join(name)).unwrap();
    assert!(page("slate.1").contains(".TH slate 1"));
    assert!(page("slate-bag-info.1").contains("slate\\-bag\\-info"));
    assert!(page("slate-teleop.1").contains("rad/s"));
}

#[test]
fn colors_are_used_on_request() {
    let running = Running::new("colours");
    let colored = |arguments: &[&str]| text(&running.call(arguments).stderr).contains('\x1b');
    let wrong = ["check", "exp1", "--set", "loop.period=0ms"];
    assert!(!colored(&wrong));
    assert!(colored(&[&wrong[..], &["--color", "always"]].concat()));
    assert!(colored(&[&["--color=always"], &wrong[..]].concat()));
    assert!(!colored(&[&wrong[..], &["--color", "never"]].concat()));
    assert!(colored(&["--color=always", "chek"]) && !colored(&["--color=never", "chek"]));
}

//! A run that is reached over HTTP.
#![cfg(feature = "console")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use std::fs::Permissions;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;

use common::{Running, WORLD, folder, json, slate, text, wait_for};
use serde_json::Value;

#[test]
fn a_headless_run_is_reached_when_its_settings_ask_for_it() {
    let mut running = Running::new("console");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "realtime", "--set", "console.port=0"]);
    let file = || {
        let mut files = std::fs::read_dir(running.sockets().join("slate")).unwrap();
        files.find_map(|entry| {
            let path = entry.unwrap().path();
            path.extension().is_some_and(|extension| extension == "console").then_some(path)
        })
    };
    // Tools reach the agent a moment before browsers do.
    wait_for("the console", || file().is_some());
    let file = file().unwrap();
    let content: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let (host, token) = (content["address"].as_str().unwrap(), content["tokens"]["viewer"].as_str().unwrap());
    let host = host.strip_prefix("http://").unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let head = format!("Host: {host}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\r\n");
    stream.write_all(format!("GET /api/v1/documents/world HTTP/1.1\r\n{head}").as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    let world: Value = serde_json::from_str(body).unwrap();
    assert_eq!(world["goals"][0]["label"], "goal", "{answer}");
    running.interrupt();
    let stderr = text(&running.finish().stderr);
    assert!(stderr.contains(&format!("console: http://{host}/#token=")), "{stderr}");
    assert!(!file.exists());
}

#[test]
fn a_run_that_others_would_reach_unprotected_does_not_start() {
    let folder = folder("console-open");
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", "console.addresses=[\"0.0.0.0\"]"]);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("neither TLS nor tokens") && stderr.contains("0.0.0.0"), "{stderr}");
    assert!(!folder.join("runs").exists(), "it leaves nothing behind");
}

#[test]
fn run_with_stay_is_reached_after_its_end() {
    let mut running = Running::new("console-stay");
    running.start("exp1", &["run", "exp1", "--headless", "--stay", "--out", "here"]);
    let summary = running.folder().join("here/summary.json");
    wait_for("the report", || summary.is_file());
    // Its values stay, and so do the tools' answers.
    assert!(running.done(&["get", "/referee/verdict/state"]).contains("SUCCEEDED"));
    assert!(running.done(&["ps"]).contains("run over: exp1, seed 0: "));
    running.interrupt();
    let output = running.finish();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let stderr = text(&output.stderr);
    assert!(stderr.contains("the run is over; the agent stays until Ctrl-C"), "{stderr}");
}

#[test]
fn requests_for_a_run_are_refused_after_its_end() {
    let mut running = Running::new("console-over");
    running.start("exp1", &["run", "exp1", "--headless", "--stay", "--out", "here"]);
    let summary = running.folder().join("here/summary.json");
    wait_for("the report", || summary.is_file());
    running.done(&["snapshot", "save", "last.snapshot"]);
    let wanted = ["the run of agent `exp1` is over (exp1, seed 0: ", "start it again"];
    for arguments in [
        &["watch", "/referee/verdict/state"][..],
        &["wait", "/referee/verdict/state", "== RUNNING"],
        &["record", "start"],
        &["snapshot", "load", "last.snapshot"],
        &["api", "POST", "/leases", r#"{"actuator": "r2/wheels"}"#],
    ] {
        running.fails(5, arguments, &wanted);
    }
    assert!(!running.folder().join("recording.mcap").exists());
    // A value that was requested once is there.
    assert!(running.done(&["watch", "/referee/verdict/state", "-n", "1"]).contains("SUCCEEDED"));
}

#[test]
fn run_with_open_shows_its_link_to_a_browser() {
    let mut running = Running::new("console-browser");
    let (browser, shown) = (running.folder().join("browser"), running.folder().join("shown"));
    std::fs::write(&browser, format!("#!/bin/sh\necho \"$1\" > {shown:?}\n")).unwrap();
    std::fs::set_permissions(&browser, Permissions::from_mode(0o755)).unwrap();
    let mut command = running.command(&["run", "exp1", "--headless", "--rate", "realtime", "--open"]);
    command.env("BROWSER", &browser);
    running.launch("exp1", command);
    wait_for("the browser", || std::fs::read_to_string(&shown).is_ok_and(|link| link.ends_with('\n')));
    running.interrupt();
    let stderr = text(&running.finish().stderr);
    let link = std::fs::read_to_string(&shown).unwrap();
    assert!(stderr.contains(&format!("console: {link}")), "{link}: {stderr}");
}

#[test]
fn run_that_keeps_nothing_leaves_no_folder_and_no_path_length() {
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/camera/camera.toml");
    let mut running = Running::new("console-nothing");
    running.start("camera", &["run", camera, "--headless"]);
    running.interrupt();
    let output = running.finish();
    let stdout = text(&output.stdout);
    assert!(stdout.contains("camera, seed 0: stopped after"), "{output:?}");
    for word in ["path length", "collisions", "report:"] {
        assert!(!stdout.contains(word), "{word}: {stdout}");
    }
    assert!(!running.folder().join("runs").exists());
}

#[test]
fn run_without_a_mission_has_no_path_length() {
    let mut running = Running::new("console-aimless");
    let robot = r#"
[agent]
name = "aimless"
[time]
source = "simulator"
[modules.simulator]
[modules.referee]
params = { robot = "r2" }
[links]
"referee/truth" = "simulator/r2/truth"
"referee/clearance" = "simulator/r2/clearance"
"referee/contacts" = "simulator/contacts"
[report]
metrics = "/referee/metrics"
"#;
    std::fs::write(running.folder().join("aimless.toml"), [robot, WORLD].concat()).unwrap();
    running.start("aimless", &["run", "aimless.toml", "--headless", "--json"]);
    wait_for("figures", || running.read("aimless", "/referee/metrics/path_length").is_number());
    running.interrupt();
    let summary = json(&running.finish());
    assert_eq!((&summary["path_length_m"], &summary["outcome"]), (&Value::Null, &"stopped".into()));
}

#[test]
fn stopped_actuators_are_shown_by_ps_and_top() {
    let mut running = Running::new("console-stopped");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "realtime"]);
    assert!(!running.done(&["ps"]).contains("stopped"));
    running.done(&["stop", "a dog"]);
    let said = running.done(&["ps"]);
    assert!(said.contains("stopped: r2/wheels"), "{said}");
    let said = running.done(&["top", "--once"]);
    assert!(said.contains("actuators stopped: r2/wheels"), "{said}");
    let agents: Value = serde_json::from_str(&running.done(&["ps", "--json"])).unwrap();
    assert_eq!(agents["agents"][0]["stopped"], serde_json::json!(["r2/wheels"]), "{agents}");
    running.done(&["reset"]);
    // A gate shows it at the end of a cycle.
    wait_for("the reset", || running.done(&["ps"]).contains("not armed: r2/wheels"));
    running.done(&["arm"]);
    wait_for("the actuators", || running.done(&["ps"]).contains("ok"));
}

#[test]
fn log_lines_are_chosen_by_level_module_and_text() {
    let mut running = Running::new("console-log");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "realtime"]);
    running.done(&["stop", "a dog"]);
    let all = running.done(&["log"]);
    let some = |arguments: &[&str]| running.done(&[&["log"], arguments].concat());
    assert_eq!(some(&["--level", "error"]), "");
    assert!(some(&["--level", "warn"]).contains("a dog"), "{all}");
    assert_eq!(some(&["--level", "debug"]), all);
    let said = some(&["--text", "A DOG"]);
    assert!(said.lines().count() > 0 && said.lines().all(|line| line.contains("a dog")), "{said}");
    assert_eq!(some(&["--text", "a dog", "-n", "1"]).lines().count(), 1);
    running.fails(4, &["log", "--module", "r2/nobody"], &["no module is called `r2/nobody`"]);
    let module = said.split_whitespace().nth(2).unwrap().trim_end_matches(':');
    assert!(some(&["--module", module]).contains("a dog"), "{module}: {all}");
    running.fails(2, &["log", "--level", "loud"], &["loud"]);
}

#[test]
fn examples_are_listed_all_and_run_by_name() {
    let folder = folder("console-examples");
    let listed: Value = serde_json::from_slice(&slate(&folder, &["examples", "--json"]).stdout).unwrap();
    let listed: Vec<_> =
        listed["examples"].as_array().unwrap().iter().map(|one| one["name"].clone()).collect();
    let there = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples")).unwrap();
    for entry in there.map(Result::unwrap).filter(|entry| entry.path().is_dir()) {
        let name = entry.file_name().into_string().unwrap();
        assert!(listed.contains(&Value::from(name.as_str())), "{name}: {listed:?}");
        let output = slate(&folder, &["check", &name]);
        assert_eq!(output.status.code(), Some(0), "{name}: {output:?}");
    }
    let output = slate(&folder, &["run", "mappin"]);
    assert!(text(&output.stderr).contains("did you mean `mapping`?"), "{output:?}");
}

#[test]
fn name_of_a_robot_is_refused_as_one() {
    let output = slate(&folder("console-new"), &["new", "9bad"]);
    let stderr = text(&output.stderr);
    assert!(stderr.contains("`9bad` can't be the name of a robot"), "{stderr}");
}

#[test]
fn endpoint_that_run_refuses_is_refused_by_check() {
    let exp1 = include_str!("../../../examples/exp1/exp1.toml");
    let running = Running::new("check-endpoint");
    let tls = if cfg!(feature = "tls") { "certificate" } else { "without TLS" };
    let refused = [
        ("tcp:127.0.0.1:7448", "not an endpoint"),
        ("tls:0.0.0.0:7447", tls),
        ("zenoh:udp/127.0.0.1:7449", "[network]"),
    ];
    for (endpoint, word) in refused {
        let text = exp1.replacen("[world]", &format!("[share]\nlisten = {endpoint:?}\n[world]"), 1);
        std::fs::write(running.folder().join("shared.toml"), text).unwrap();
        running.fails(7, &["check", "shared.toml"], &[endpoint, word]);
        running.fails(2, &["run", "shared.toml", "--headless"], &[word]);
    }
    for (table, word) in [("prot = 1", "prot"), ("port = 99999", "port"), ("tokens = \"none\"", "none")] {
        let text = exp1.replacen("[world]", &format!("[console]\n{table}\n[world]"), 1);
        std::fs::write(running.folder().join("shared.toml"), text).unwrap();
        running.fails(7, &["check", "shared.toml"], &[word]);
    }
    let text = exp1.replacen("[world]", "[share]\nlisten = \"local:base\"\n[world]", 1);
    std::fs::write(running.folder().join("shared.toml"), text).unwrap();
    running.done(&["check", "shared.toml"]);
}

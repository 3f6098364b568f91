//! Language models use an agent over the Model Context Protocol, whose own library for Python asks here.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

use crate::common::{Running, text};

const PACKAGE: &str = "mcp==2.3.0";

const EXP1: [&str; 6] = ["run", "exp1", "--headless", "--json", "--rate", "0.3"];

const SPEED: &str = "/r2/planner/params/speed";

fn well(output: Output, advice: &str) -> Output {
    assert!(output.status.success(), "{advice}\n{}\n{}", text(&output.stdout), text(&output.stderr));
    output
}

/// A Python that has the library.
fn python() -> PathBuf {
    // Made once, though tests run beside each other.
    static MAKING: Mutex<()> = Mutex::new(());
    let _making = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mcp-python");
    let (python, marker) = (folder.join("bin/python"), folder.join("packages"));
    if std::fs::read_to_string(&marker).is_ok_and(|found| found == PACKAGE) {
        return python;
    }
    let made = Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).output();
    well(made.unwrap(), "this test needs Python with virtual environments: apt-get install python3-venv");
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE];
    let installed = Command::new(&python).args(pip).output();
    well(installed.unwrap(), "this test needs a package of PyPI, so it needs a network the first time");
    std::fs::write(&marker, PACKAGE).unwrap();
    python
}

/// What a client finds and is answered that calls tools in a role.
fn ask(running: &Running, role: &str, calls: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mcp_client.py");
    let mut client = Command::new(python())
        .arg(script)
        .arg(env!("CARGO_BIN_EXE_slate"))
        .args([running.folder(), running.sockets()])
        .arg(role)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    client.stdin.take().unwrap().write_all(calls.to_string().as_bytes()).unwrap();
    let output = well(client.wait_with_output().unwrap(), "the client of the protocol fails");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The answers of calls that are done, as the agent gives them.
fn done(call: &Value) -> Value {
    assert_eq!(call["error"], false, "{call}");
    serde_json::from_str(call["text"].as_str().unwrap()).unwrap()
}

fn refused(call: &Value, words: &[&str]) {
    let text = call["text"].as_str().unwrap();
    assert!(call["error"] == true && words.iter().all(|word| text.contains(word)), "{call}");
}

#[test]
fn a_viewer_over_mcp_looks_and_stops_and_changes_nothing() {
    let mut running = Running::new("mcp-viewer");
    running.start("exp1", &EXP1);
    let asked = ask(
        &running,
        "viewer",
        &json!([
            ["modules", {}],
            ["read", { "path": "/simulator/r2/truth" }],
            ["log", {}],
            ["explain", { "code": "S006" }],
            ["read", { "path": "/nothing" }],
            ["read", { "part": "/simulator/r2/truth" }],
            ["set_value", { "url": SPEED, "value": 0.35 }],
            ["drive", { "actuator": "r2/wheels", "command": {} }],
            ["stop", { "reason": "something is in the way" }],
            ["actuators", {}],
        ]),
    );
    assert_eq!(asked["server"], "slate");
    let tools = asked["tools"].as_object().unwrap();
    assert!(
        ["read", "modules", "links", "log", "explain", "stop"].iter().all(|name| tools.contains_key(*name))
    );
    assert!(["set_value", "drive", "arm", "load", "set"].iter().all(|name| !tools.contains_key(*name)));
    assert_eq!(tools["read"]["required"], json!(["path"]));

    let calls = asked["calls"].as_array().unwrap();
    assert!(done(&calls[0]).as_array().unwrap().iter().any(|module| module["name"] == "r2/planner"));
    assert!(done(&calls[1])["value"]["x"].is_f64());
    done(&calls[2]);
    assert_eq!(done(&calls[3])["code"], "S006");
    refused(&calls[4], &["nothing", "help: ", "code: S"]);
    refused(&calls[5], &["`part` is no argument", "path"]);
    refused(&calls[6], &["a viewer may not"]);
    refused(&calls[7], &["a viewer may not"]);
    assert_eq!(done(&calls[8])["stopped"], true);
    let stops = done(&calls[9]).to_string();
    assert!(stops.contains("mcp: something is in the way"), "{stops}");
    let log = running.done(&["log"]);
    assert!(log.contains("mcp: POST /stop is done"), "{log}");
    assert!(log.contains("mcp: POST /api/v1/leases is refused with 403"), "{log}");
}

#[cfg(feature = "console")]
#[test]
fn an_operator_over_mcp_drives_and_sets_only_what_is_operable() {
    let mut running = Running::new("mcp-operator");
    let operable = "console.operable=[\"/r2/knowledge/params/goal_x\"]";
    running.start("exp1", &[&EXP1[..], &["--set", operable, "--set", "console.port=0"]].concat());
    let wheels = json!({ "left": 0.5, "right": 0.5 });
    let asked = ask(
        &running,
        "operator",
        &json!([
            ["set_value", { "url": "/r2/knowledge/params/goal_x", "value": -0.5 }],
            ["set_value", { "url": SPEED, "value": 0.35 }],
            ["set", { "body": [["robots.r2.modules.planner.params.speed", "0.35"]] }],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 0.3 }],
            ["leases", {}],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 99 }],
            ["drive", { "actuator": "r2/wheels", "command": { "left": 0.5 } }],
            ["stop", {}],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 0.1 }],
        ]),
    );
    let tools = asked["tools"].as_object().unwrap();
    assert!(["set_value", "drive", "arm", "reset"].iter().all(|name| tools.contains_key(*name)));
    assert!(["set", "load", "take", "give_back"].iter().all(|name| !tools.contains_key(*name)));

    let calls = asked["calls"].as_array().unwrap();
    done(&calls[0]);
    assert_eq!(running.read("exp1", "/r2/knowledge/params")["goal_x"], -0.5);
    refused(&calls[1], &["an operator may not"]);
    refused(&calls[2], &["an operator may not"]);
    assert_ne!(running.read("exp1", SPEED), 0.35);
    assert!(done(&calls[3])["gate"].is_object(), "{}", calls[3]);
    assert_eq!(done(&calls[4])[0]["holder"], Value::Null);
    refused(&calls[5], &["`seconds` is above 0 and at most 10"]);
    refused(&calls[6], &["right"]);
    done(&calls[7]);
    // The gate holds back whoever drives.
    assert_ne!(done(&calls[8])["gate"]["state"], "armed", "{}", calls[8]);
}

#[test]
fn a_developer_over_mcp_sets_what_the_agent_lets_set() {
    let mut running = Running::new("mcp-developer");
    running.start("exp1", &EXP1);
    let calls = json!([
        ["set_value", { "url": SPEED, "value": 0.35 }],
        ["set_value", { "url": SPEED, "value": 99 }],
    ]);
    let asked = ask(&running, "developer", &calls);
    done(&asked["calls"][0]);
    refused(&asked["calls"][1], &["99"]);
    assert_eq!(running.read("exp1", SPEED), 0.35);
}

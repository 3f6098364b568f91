//! Language models use an agent over the Model Context Protocol, whose own library for Python asks here.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::{Value, json};

use crate::common::{Running, text};

const PACKAGE: &str = "mcp==2.3.0";

const EXP1: [&str; 6] = ["run", "exp1", "--headless", "--json", "--rate", "0.3"];

const SPEED: &str = "/r2/planner/params/max_linear_velocity";

fn well(output: Output, advice: &str) -> Output {
    assert!(output.status.success(), "{advice}\n{}\n{}", text(&output.stdout), text(&output.stderr));
    output
}

/// A Python that has the library.
fn python() -> PathBuf {
    slate_test_tools::python(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("mcp-python"), &[PACKAGE])
}

/// What a client finds and is answered that calls tools in a role.
fn ask(running: &Running, role: &str, calls: &Value) -> Value {
    let [folder, sockets] = [running.folder(), running.sockets()].map(|path| path.to_str().unwrap());
    ask_by(&["stdio", env!("CARGO_BIN_EXE_slate"), folder, sockets, role], calls)
}

fn ask_by(arguments: &[&str], calls: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mcp_client.py");
    let mut client = Command::new(python())
        .arg(script)
        .args(arguments)
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
            ["read", { "path": "/simulator/r2/truth", "format": "events" }],
            ["log", { "format": "events" }],
            ["log", { "format": "json" }],
            ["write", { "path": SPEED, "body": 0.35 }],
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
    assert!(["write", "drive", "arm", "load", "set"].iter().all(|name| !tools.contains_key(*name)));
    assert_eq!(tools["read"]["required"], json!(["path"]));

    let calls = asked["calls"].as_array().unwrap();
    assert!(done(&calls[0]).as_array().unwrap().iter().any(|module| module["name"] == "r2/planner"));
    assert!(done(&calls[1])["value"]["x"].is_f64());
    done(&calls[2]);
    assert_eq!(done(&calls[3])["code"], "S006");
    refused(&calls[4], &["nothing", "help: ", "code: S"]);
    refused(&calls[5], &["unknown argument `part`", "path"]);
    // A stream never ends: a tool that waits for its end hangs.
    refused(&calls[6], &["`read` answers in JSON only", "events"]);
    refused(&calls[7], &["`log` answers in JSON only", "events"]);
    done(&calls[8]);
    assert!(tools["read"]["properties"].get("format").is_none());
    refused(&calls[9], &["a viewer may not"]);
    refused(&calls[10], &["a viewer may not"]);
    assert_eq!(done(&calls[11])["stopped"], true);
    let stops = done(&calls[12]).to_string();
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
            ["write", { "path": "/r2/knowledge/params/goal_x", "body": -0.5 }],
            ["write", { "path": SPEED, "body": 0.35 }],
            ["set", { "body": [["robots.r2.modules.planner.params.max_linear_velocity", "0.35"]] }],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 0.3 }],
            ["leases", {}],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 99 }],
            ["drive", { "actuator": "r2/wheels", "command": { "left": 0.5 } }],
            ["stop", {}],
            ["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 0.1 }],
        ]),
    );
    let tools = asked["tools"].as_object().unwrap();
    assert!(["write", "drive", "arm", "reset"].iter().all(|name| tools.contains_key(*name)));
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
    // The gate limits the driver.
    assert_ne!(done(&calls[8])["gate"]["state"], "armed", "{}", calls[8]);
}

#[test]
fn a_developer_over_mcp_sets_what_the_agent_lets_set() {
    let mut running = Running::new("mcp-developer");
    running.start("exp1", &EXP1);
    let calls = json!([
        ["write", { "path": SPEED, "body": 0.35 }],
        ["write", { "path": SPEED, "body": 99 }],
    ]);
    let asked = ask(&running, "developer", &calls);
    assert_eq!(asked["tools"]["reload"]["required"], json!(["plugin"]));
    done(&asked["calls"][0]);
    refused(&asked["calls"][1], &["99"]);
    assert_eq!(running.read("exp1", SPEED), 0.35);
}

/// `slate mcp --http`, which ends with this.
#[cfg(feature = "console")]
struct Served {
    process: Child,
    url: String,
    tokens: Value,
}

#[cfg(feature = "console")]
impl Served {
    /// That of an agent with a console, for roles up to that one.
    fn start(running: &Running, role: &str) -> Self {
        let mut command = running.command(&["mcp", "--http", "127.0.0.1:0", "--role", role]);
        let mut process = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut url = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut url).unwrap();
        let files = std::fs::read_dir(running.sockets().join("slate")).unwrap();
        let mut files = files.map(|file| file.unwrap().path());
        let file = files.find(|file| file.extension().is_some_and(|end| end == "console")).unwrap();
        let tokens: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        Self { process, url: url.trim().into(), tokens: tokens["tokens"].clone() }
    }

    fn ask(&self, role: &str, calls: &Value) -> Value {
        ask_by(&["http", &self.url, self.tokens[role].as_str().unwrap()], calls)
    }

    /// The head of the answer to a request with these headers.
    fn head(&self, headers: &str) -> String {
        let host = self.url.strip_prefix("http://").unwrap().strip_suffix("/mcp").unwrap();
        let mut stream = TcpStream::connect(host).unwrap();
        let body = r#"{"jsonrpc":"2.0","id":1,"method":"tools/list"}"#;
        write!(
            stream,
            "POST /mcp HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Type: application/json\r\nAccept: \
             application/json, text/event-stream\r\n{headers}Content-Length: {}\r\n\r\n{body}",
            body.len()
        )
        .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }
}

#[cfg(feature = "console")]
impl Drop for Served {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

#[cfg(feature = "console")]
#[test]
fn mcp_over_http_gives_each_token_its_role() {
    let mut running = Running::new("mcp-http");
    running.start("exp1", &[&EXP1[..], &["--set", "console.port=0"]].concat());
    let served = Served::start(&running, "developer");
    assert!(served.url.starts_with("http://127.0.0.1:"), "{}", served.url);

    let calls = json!([
        ["read", { "path": "/simulator/r2/truth" }],
        ["write", { "path": SPEED, "body": 0.35 }],
        ["explain", { "code": "S006" }],
    ]);
    let viewer = served.ask("viewer", &calls);
    let tools = viewer["tools"].as_object().unwrap();
    assert_eq!(viewer["server"], "slate");
    assert!(["read", "explain", "stop"].iter().all(|name| tools.contains_key(*name)));
    assert!(["write", "drive", "arm", "load"].iter().all(|name| !tools.contains_key(*name)));
    assert!(done(&viewer["calls"][0])["value"]["x"].is_f64());
    refused(&viewer["calls"][1], &["a viewer may not"]);
    assert_eq!(done(&viewer["calls"][2])["code"], "S006");
    assert_ne!(running.read("exp1", SPEED), 0.35);

    let wheels = json!({ "left": 0.5, "right": 0.5 });
    let drive = json!(["drive", { "actuator": "r2/wheels", "command": wheels, "seconds": 0.2 }]);
    let operator = served.ask("operator", &json!([calls[1], drive, ["stop", { "reason": "enough" }]]));
    refused(&operator["calls"][0], &["an operator may not"]);
    assert!(done(&operator["calls"][1])["gate"].is_object());
    assert_eq!(done(&operator["calls"][2])["stopped"], true);
    done(&served.ask("developer", &calls)["calls"][1]);
    assert_eq!(running.read("exp1", SPEED), 0.35);

    let log = running.done(&["log"]);
    for line in ["viewer at 127.0.0.1:", "developer at 127.0.0.1:", "named \"mcp\": POST /stop is done"] {
        assert!(log.contains(line), "{line}: {log}");
    }
}

#[cfg(feature = "console")]
#[test]
fn mcp_over_http_needs_a_token_and_no_browser_page() {
    let mut running = Running::new("mcp-http-refused");
    running.start("exp1", &[&EXP1[..], &["--set", "console.port=0"]].concat());
    let served = Served::start(&running, "viewer");
    // What a token allows is bounded by the role of the command.
    let bounded = served.ask("developer", &json!([["write", { "path": SPEED, "body": 0.35 }]]));
    assert!(!bounded["tools"].as_object().unwrap().contains_key("write"));
    refused(&bounded["calls"][0], &["a viewer may not"]);

    let token = served.tokens["viewer"].as_str().unwrap();
    let bearer = format!("Authorization: Bearer {token}\r\n");
    assert!(served.head(&bearer).starts_with("HTTP/1.1 200"), "{}", served.head(&bearer));
    for (headers, status) in [
        (String::new(), "401"),
        (format!("Authorization: Bearer {}\r\n", &token[1..]), "401"),
        (format!("Authorization: Basic {token}\r\n"), "401"),
        (format!("{bearer}Origin: http://evil.example\r\n"), "403"),
    ] {
        let answer = served.head(&headers);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{headers}: {answer}");
        assert!(status != "401" || answer.to_lowercase().contains("www-authenticate: bearer"), "{answer}");
        assert!(!answer.contains("\"tools\""), "{answer}");
    }
}

//! Attacks with each operation that changes something; none may have an effect.

use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use slate_console::{Console, Settings};
use slate_control::operations::{OPERATIONS, of_request};
use slate_control::{MatchedOperation, Operation};
use slate_runtime::configuration::{Configuration, Options};

use crate::agent::Running;
use crate::client::Client;

/// Operations that change something, with what they would change: method, path, body, and required role.
fn changes(run: &Running) -> Vec<(&'static str, String, Json, &'static str)> {
    vec![
        ("PUT", run.at("sensor/params/step"), json!(2.0), "developer"),
        ("PATCH", run.at("sensor/params"), json!({ "step": 2.0 }), "developer"),
        ("PUT", run.at("driver/goal"), json!({ "x": 1.0, "y": 1.0 }), "operator"),
        ("POST", run.at("driver/notes"), json!({ "value": 1.0 }), "operator"),
        ("PUT", "/modules/sensor".into(), json!({ "enabled": false }), "developer"),
        ("PUT", "/plugins/sensor".into(), json!(null), "developer"),
        ("DELETE", "/plugins/sensor".into(), json!(null), "developer"),
        ("POST", "/plugins/sensor/reload".into(), json!(null), "developer"),
        ("PUT", "/links/driver/goal".into(), json!({ "from": "sensor/place" }), "developer"),
        ("DELETE", "/links/driver/history".into(), json!(null), "developer"),
        ("PATCH", "/settings".into(), json!({ "log.level": "trace" }), "developer"),
        ("DELETE", "/settings".into(), json!(null), "developer"),
        ("POST", "/settings/save".into(), json!({ "to": "origin" }), "developer"),
        ("POST", "/snapshots/attack".into(), json!(null), "developer"),
        ("POST", "/snapshots/attack/load".into(), json!(null), "developer"),
        ("PUT", "/layouts/attack".into(), json!({ "title": "Attack", "columns": [1] }), "developer"),
        ("DELETE", "/layouts/attack".into(), json!(null), "developer"),
        ("POST", "/recordings/attack".into(), json!({}), "operator"),
        ("POST", "/recordings/attack/stop".into(), json!(null), "operator"),
        ("POST", "/recordings/attack/snapshot".into(), json!(null), "operator"),
        ("POST", "/playback/pause".into(), json!(null), "operator"),
        ("POST", "/playback/resume".into(), json!(null), "operator"),
        ("POST", "/playback/step".into(), json!({ "cycles": 3 }), "operator"),
        ("POST", "/playback/seek".into(), json!({ "time": 0 }), "operator"),
        ("POST", "/playback/rate".into(), json!({ "factor": 2.0 }), "operator"),
        ("POST", "/playback/loop".into(), json!({ "section": null }), "operator"),
        ("POST", "/log".into(), json!({ "text": "attack" }), "operator"),
        ("POST", "/leases".into(), json!({ "actuator": "wheel" }), "operator"),
        ("PUT", "/leases/0123456789abcdef".into(), json!({ "release": true }), "operator"),
        ("DELETE", "/leases/0123456789abcdef".into(), json!(null), "operator"),
        ("PUT", "/value".into(), json!({ "url": "/sensor/params/step", "value": 2.0 }), "developer"),
        ("POST", "/plugins".into(), json!({ "file": "/tmp/lib.so" }), "developer"),
        ("PUT", "/plugins/sensor/shadow".into(), json!({ "file": "/tmp/lib.so" }), "developer"),
        ("DELETE", "/plugins/sensor/shadow".into(), json!(null), "developer"),
        ("POST", "/plugins/sensor/promote".into(), json!(null), "developer"),
        ("POST", "/trace".into(), json!({ "file": "attack.json" }), "developer"),
        ("DELETE", "/trace".into(), json!(null), "developer"),
        ("DELETE", "/recordings".into(), json!(null), "operator"),
        ("POST", "/snapshots/attack/values".into(), json!({ "url": "slate://other/**" }), "developer"),
        ("POST", "/watch".into(), json!({ "of": [{ "url": "/sensor/count" }] }), "viewer"),
        ("POST", "/measure".into(), json!({ "urls": ["/sensor/count"], "time": 1 }), "viewer"),
        ("POST", "/reset".into(), json!(null), "operator"),
        ("POST", "/arm".into(), json!({}), "operator"),
        ("POST", "/stop".into(), json!({ "reason": "attack" }), "viewer"),
    ]
}

/// Attack with an operation that has none above, on something that is not there.
fn general(operation: &Operation) -> (&'static str, String, Json, &'static str) {
    let fill = |path: String, name: &str| path.replace(&format!("{{{name}}}"), "attack");
    let path = operation.part_names().fold(operation.path.to_owned(), fill);
    let body = if operation.body.is_some() { json!({}) } else { Json::Null };
    (operation.method, path, body, operation.role.name())
}

/// What must not change.
fn state(run: &Running) -> String {
    let paths = ["/settings", "/links", "/plugins", "/layouts", "/leases"];
    let parts = paths.map(|path| run.get(path).text());
    // What is in memory grows by itself.
    let recordings = run.get("/recordings").json();
    let count = |part| recordings.pointer(part).and_then(|list| list.as_array()).map_or(0, Vec::len);
    let recordings = ["/files", "/recordings", "/flight/saved"].map(count);
    let modules = run.get("/modules").json();
    let conditions: Vec<_> =
        modules.as_array().unwrap().iter().map(|module| module["condition"].clone()).collect();
    let stopped = run.get("/agent").json()["stopped"].clone();
    let lines = run.get("/log").json();
    let noted =
        lines.as_array().unwrap().iter().filter(|line| line["text"].as_str().unwrap().ends_with(": attack"));
    let (noted, heard) = (noted.count(), run.number("driver/heard/value"));
    format!("{parts:?} {recordings:?} {conditions:?} {stopped} {noted} {heard}")
}

#[test]
fn no_attack_changes_anything() {
    let run = Running::start("attacks");
    let before = state(&run);
    let mut changes = changes(&run);
    let has_own = |operation: &Operation| {
        let is_same = |found: &MatchedOperation| found.operation.name == operation.name;
        changes.iter().any(|(method, path, ..)| of_request(method, path).is_ok_and(|found| is_same(&found)))
    };
    let others = OPERATIONS.iter().filter(|operation| operation.method != "GET" && !has_own(operation));
    let others: Vec<_> = others.map(general).collect();
    changes.extend(others);
    let mut attacks = 0;
    for (method, path, body, role) in changes {
        let body = Some(&body).filter(|body| !body.is_null());
        let good = run.client(role);
        let token = run.token(role);
        let nobody = Client::new(run.address(), "");
        let port = run.address().port();
        let mut refuse = |what: &str, reply: crate::client::Reply| {
            attacks += 1;
            assert!(
                (400..500).contains(&reply.status),
                "{method} {path}: {what}: {} {}",
                reply.status,
                reply.text()
            );
            if reply.status == 429 {
                // Too many wrong tokens; the next one is to be judged for itself.
                std::thread::sleep(std::time::Duration::from_millis(250));
            }
        };
        refuse("no token", nobody.send(method, &path, body));
        refuse(
            "wrong token",
            Client::new(run.address(), &token.replace(['0', '1', '2'], "f")).send(method, &path, body),
        );
        refuse("truncated token", Client::new(run.address(), &token[..63]).send(method, &path, body));
        if role != "viewer" {
            refuse("viewer token", run.client("viewer").send(method, &path, body));
        }
        refuse("token in the query", nobody.send(method, &format!("{path}?token={token}"), body));
        refuse("foreign origin", good.with("Origin", "http://evil.example").send(method, &path, body));
        refuse("null origin", good.with("Origin", "null").send(method, &path, body));
        refuse("foreign host", good.with("Host", &format!("evil.example:{port}")).send(method, &path, body));
        refuse("another port", good.with("Host", "127.0.0.1:1").send(method, &path, body));
        refuse("cross site", good.with("Sec-Fetch-Site", "cross-site").send(method, &path, body));
        // Only a program that has a token can send this, and to stop it needs nothing else.
        if body.is_some() && path != "/stop" {
            refuse("text", good.with("Content-Type", "text/plain").send(method, &path, body));
            let form = good.with("Content-Type", "application/x-www-form-urlencoded");
            refuse("form", form.send(method, &path, body));
        }
        refuse("override", good.with("X-HTTP-Method-Override", method).send("TRACE", &path, None));
        refuse("traversal", good.send(method, &format!("/..%2f..{path}"), body));
        let head = good.head(method, &format!("/api/v1{path}"));
        let long = format!(
            "{head}Content-Type: application/json\r\nContent-Length: 9999999\r\n\r\n{}",
            "1".repeat(2 << 20)
        );
        if path != "/stop" {
            refuse("too long", good.raw(long.as_bytes()));
        }
        let twice = format!(
            "{head}Content-Type: application/json\r\nContent-Length: 4\r\nContent-Length: 5\r\n\r\ntrue1"
        );
        refuse("two lengths", good.raw(twice.as_bytes()));
        let upgrade = good
            .with("Upgrade", "websocket")
            .with("Connection", "Upgrade")
            .with("Origin", "http://evil.example");
        refuse("foreign socket", upgrade.send(method, &path, None));
    }
    assert!(attacks > 260, "{attacks}");
    // No attack succeeded, and authorized callers still work.
    assert_eq!(state(&run), before);
    run.client("viewer").send("POST", "/stop", None).json();
}

#[test]
fn reads_need_a_token_and_foreign_pages_are_refused() {
    let run = Running::start("looks");
    let nobody = Client::new(run.address(), "");
    for path in ["/agent", "/properties", "/openapi.json", "/nothing"] {
        assert!(nobody.send("GET", path, None).problem(401).contains("token"), "{path}");
    }
    let token = run.token("viewer");
    nobody.send("GET", &format!("/agent?token={token}"), None).json();
    assert_eq!(nobody.send("GET", "/", None).json()["api"], "/api/v1");
    let viewer = run.client("viewer");
    viewer.with("Sec-Fetch-Site", "cross-site").send("GET", "/agent", None).problem(403);
    let own =
        viewer.with("Origin", &format!("http://{}", run.address())).with("Sec-Fetch-Site", "same-origin");
    let reply = own.send("GET", "/agent", None);
    reply.json();
    assert_eq!(reply.header("access-control-allow-origin"), "");
    assert!(reply.header("content-security-policy").contains("default-src 'self'"));
    assert_eq!(reply.header("x-content-type-options"), "nosniff");
    assert!(viewer.send("OPTIONS", "/agent", None).problem(405).contains("GET"));
    // What stands in two places is not what was checked.
    viewer
        .raw(
            format!("GET http://evil.example/api/v1/agent HTTP/1.1\r\nHost: {}\r\n\r\n", run.address())
                .as_bytes(),
        )
        .problem(421);
    assert_eq!(viewer.raw(b"nonsense\r\n\r\n").status, 400);
}

#[test]
fn guessing_is_slowed_and_valid_tokens_still_work() {
    let run = Running::start("guesses");
    let guesser = Client::new(run.address(), &"0".repeat(64));
    let statuses: Vec<_> = (0..40).map(|_| guesser.send("GET", "/agent", None).status).collect();
    assert!(statuses.contains(&401) && statuses.contains(&429), "{statuses:?}");
    run.client("viewer").send("GET", "/agent", None).json();
}

#[test]
fn silent_connections_keep_no_other_out() {
    let run = Running::start("silent");
    let silent: Vec<_> = (0..200)
        .map(|_| {
            let mut stream = run.client("viewer").connect();
            let _ = stream.write_all(b"GET /api/v1/agent HTTP/1.1\r\nHo");
            stream
        })
        .collect();
    run.client("viewer").send("POST", "/stop", None).json();
    run.client("viewer").send("GET", "/agent", None).json();
    drop(silent);
}

/// Connections whose requests begin and never end, as far as the agent lets them.
fn endless(run: &Running, count: usize, path: &str) -> Vec<TcpStream> {
    let client = run.client("viewer");
    let head = client.head("POST", path);
    let begin = |_| {
        let mut stream = client.connect();
        let _ = write!(stream, "{head}Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{{");
        stream
    };
    (0..count).map(begin).collect()
}

#[test]
fn stop_works_beside_requests_that_never_end() {
    let run = Running::start("endless");
    let mut busy = Vec::new();
    let is_full = || run.client("viewer").send("GET", "/agent", None).status == 503;
    let fills = |_| {
        // A connection without a request was closed for the new one.
        busy.extend(endless(&run, 64, "/api/v1/watch"));
        is_full()
    };
    assert!((0..20).any(fills), "there is a place left");
    run.client("viewer").send("POST", "/stop", None).json();
    drop(busy);
    assert!((0..1000).any(|_| !is_full()), "those who are gone keep others out");
    assert!(!run.get("/agent").json()["stopped"].is_null());
}

#[test]
fn stop_does_not_wait_for_its_body() {
    let run = Running::start("bodiless");
    assert!(run.get("/agent").json()["stopped"].is_null());
    let begin = Instant::now();
    let _slow = endless(&run, 1, "/api/v1/stop");
    while run.get("/agent").json()["stopped"].is_null() {
        // A body may take twice as long.
        assert!(begin.elapsed() < Duration::from_secs(5), "it waits for the body");
    }
}

#[test]
fn the_secrets_are_for_their_owner_alone_and_go_with_the_agent() {
    use std::os::unix::fs::MetadataExt;
    let run = Running::start("secrets");
    let path = run.console.token_file().to_owned();
    assert_eq!(path.metadata().unwrap().mode() & 0o777, 0o600);
    let (address, token) = run.console.link().split_once("/#token=").unwrap();
    assert_eq!(address, format!("http://{}", run.address()));
    assert_eq!(token, run.token("developer"));
    drop(run);
    assert!(!path.exists());
}

fn settings(text: &str) -> Result<Settings, String> {
    let options = Options { extra_tables: vec!["console".into()], ..Options::default() };
    let configuration = Configuration::from_text("robot.toml", text, &options).unwrap();
    Settings::of(&configuration).map_err(|report| report.render(false))
}

#[test]
fn address_for_other_machines_needs_a_token() {
    for (text, words) in [
        ("[console]\naddresses = [\"0.0.0.0\"]", "neither TLS nor tokens"),
        ("[console]\naddresses = [\"127.0.0.1\", \"192.168.0.7\"]\ntokens.viewer = \"v\"", "has no TLS"),
        ("[console]\naddresses = [\"::\"]\ncertificate = \"c\"\nkey = \"k\"", "has no tokens"),
        ("[console]\nport = 70000", "65535"),
        ("[console]\nport = \"x\"\nadress = []", "addresses"),
        ("[console]\ncertificate = \"c\"", "key"),
        ("[console]\norigins = [\"foxglove\"]", "origin"),
        ("[console]\ntokens = {}", "names no file"),
    ] {
        let refusal = settings(text).unwrap_err();
        assert!(refusal.contains("robot.toml") && refusal.contains(words), "{text}: {refusal}");
    }
    assert!(
        settings(
            "[console]\naddresses = [\"0.0.0.0\"]\ncertificate = \"c\"\nkey = \"k\"\ntokens.viewer = \"v\""
        )
        .is_ok()
    );
    let open = Settings { addresses: vec!["0.0.0.0".parse().unwrap()], port: Some(0), ..Settings::default() };
    let configuration =
        slate_runtime::configuration::Database::from_text("a.toml", "", Options::default()).unwrap();
    let agent =
        slate_runtime::Agent::load_with(&configuration, &[], slate_runtime::Options::default()).unwrap();
    let refusal = Console::start(&agent, &open, Vec::new()).unwrap_err().to_string();
    assert!(refusal.contains("0.0.0.0"), "{refusal}");
}

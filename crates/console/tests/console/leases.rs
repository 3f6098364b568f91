//! Controls over plain requests.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use slate_control::Server;

use crate::agent::Running;

fn holder(run: &Running) -> Json {
    run.get("/leases").json()[0].clone()
}

#[test]
fn one_at_a_time_has_a_lease_and_everybody_sees_who() {
    let run = Running::start("lease");
    let (viewer, operator) = (run.client("viewer"), run.client("operator"));
    assert_eq!(holder(&run), json!({ "actuator": "wheel", "holder": null, "since": null }));
    viewer.send("POST", "/leases", Some(&json!({ "actuator": "wheel" }))).problem(403);
    let lease = operator.send("POST", "/leases", Some(&json!({ "actuator": "wheel" }))).json();
    assert_eq!((&lease["actuator"], &lease["hold_ms"]), (&json!("wheel"), &json!(150)));
    assert!(holder(&run)["holder"].as_str().unwrap().starts_with("operator at 127.0.0.1:"));
    let refused = run.client("developer").send("POST", "/leases", Some(&json!({ "actuator": "wheel" })));
    assert!(refused.problem(409).contains("operator at"));
    let text = operator.send("POST", "/leases", Some(&json!({ "actuator": "arm" }))).problem(404);
    assert!(text.contains("wheel"), "{text}");
    operator.send("POST", "/leases", None).problem(400);

    let at = format!("/leases/{}", lease["lease"].as_str().unwrap());
    let driven = operator.send("PUT", &at, Some(&json!({ "command": { "value": -3.0 } }))).json();
    assert_eq!((&driven["actuator"], driven["gate"]["mode"].as_str()), (&json!("wheel"), Some("ARMED")));
    run.wait_for("the command", || run.number("wheel/command/value") == -3.0);
    let last = Instant::now();
    run.wait_for("its end", || run.number("wheel/command/value") != -3.0);
    assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    operator.send("PUT", &at, Some(&json!({ "command": { "speed": 1.0 } }))).problem(422);
    let said = operator.send("PUT", &at, Some(&json!({ "command": {} }))).problem(422);
    assert!(said.contains("it lacks value"), "{said}");
    operator.send("PUT", &at, Some(&json!({ "command": { "value": 1.0 }, "release": true }))).problem(400);
    operator.send("PUT", "/leases/0123456789abcdef", None).problem(404);

    operator.send("DELETE", &at, None).json();
    assert_eq!(holder(&run)["holder"], json!(null));
    operator.send("DELETE", &at, None).problem(404);
    operator.send("PUT", &at, None).problem(404);
    // Repeated commands are not logged, but the holder of the controls is.
    let lines = run.get("/log").text();
    assert!(
        lines.contains("takes the controls of wheel: operator at") && !lines.contains("PUT /api/v1/leases")
    );
}

#[test]
fn lease_ends_without_renewal() {
    let run = Running::start("forgotten");
    let operator = run.client("operator");
    let lease = operator.send("POST", "/leases", Some(&json!({ "actuator": "wheel" }))).json();
    let at = format!("/leases/{}", lease["lease"].as_str().unwrap());
    let term = Duration::from_millis(lease["term_ms"].as_u64().unwrap());
    std::thread::sleep(term / 2);
    operator.send("PUT", &at, None).json();
    std::thread::sleep(term * 3 / 4);
    // Later than its first end, and it was renewed.
    assert!(holder(&run)["holder"].is_string());
    run.wait_for("its end", || holder(&run)["holder"].is_null());
    operator.send("PUT", &at, None).problem(404);
    operator.send("POST", "/leases", Some(&json!({ "actuator": "wheel" }))).json();
}

/// The status of an answer on the agent's socket.
fn ask_socket(server: &Server, method: &str, path: &str) -> u16 {
    let mut stream = UnixStream::connect(server.socket()).unwrap();
    let head = format!("{method} /api/v1{path} HTTP/1.1\r\nhost: slate\r\nconnection: close\r\n\r\n");
    stream.write_all(head.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer["HTTP/1.1 ".len()..][..3].parse().unwrap()
}

#[test]
fn a_lease_is_the_same_on_the_socket_and_over_the_network() {
    let run = Running::start("both");
    let server = Server::open_on(Arc::clone(&run.surface)).unwrap();
    let operator = run.client("operator");
    let lease = operator.send("POST", "/leases", Some(&json!({ "actuator": "wheel" }))).json();
    let at = format!("/leases/{}", lease["lease"].as_str().unwrap());
    assert_eq!(ask_socket(&server, "PUT", &at), 200);
    assert_eq!(ask_socket(&server, "DELETE", &at), 200);
    assert!(holder(&run)["holder"].is_null());
    operator.send("PUT", &at, None).problem(404);
    assert_eq!(
        ask_socket(&server, "GET", "/documents/world"),
        200,
        "what the program tells beside the blackboard"
    );
}

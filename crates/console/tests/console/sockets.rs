//! WebSockets: live values, and teleoperation.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::{Error, Message, WebSocket, client};

use crate::agent::Running;

/// One end of a socket.
pub struct Socket(pub WebSocket<TcpStream>);

impl Socket {
    /// Opens a socket with these headers; else what the handshake was answered.
    pub fn try_open(run: &Running, path: &str, headers: &[(&str, &str)]) -> Result<Self, u16> {
        let mut request = format!("ws://{}{path}", run.address()).into_client_request().unwrap();
        for (name, value) in headers {
            let name: tokio_tungstenite::tungstenite::http::HeaderName = name.parse().unwrap();
            request.headers_mut().insert(name, HeaderValue::from_str(value).unwrap());
        }
        let stream = TcpStream::connect(run.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream.set_nodelay(true).unwrap();
        match client(request, stream) {
            Ok((socket, _)) => Ok(Self(socket)),
            Err(error) => match error {
                tokio_tungstenite::tungstenite::HandshakeError::Failure(Error::Http(response)) => {
                    Err(response.status().as_u16())
                }
                other => panic!("{other}"),
            },
        }
    }

    pub fn open(run: &Running, path: &str, role: &str) -> Self {
        let bearer = format!("Bearer {}", run.token(role));
        Self::try_open(run, path, &[("Authorization", &bearer)]).unwrap()
    }

    pub fn say(&mut self, value: &Json) {
        self.0.send(Message::Text(value.to_string().into())).unwrap();
    }

    pub fn receive(&mut self) -> Json {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    pub fn ask(&mut self, value: &Json) -> Json {
        self.say(value);
        self.receive()
    }
}

#[test]
fn many_values_come_over_one_socket() {
    let run = Running::start("live");
    let mut socket = Socket::open(&run, "/api/v1/live", "viewer");
    socket.say(&json!({ "subscribe": [
        { "id": 1, "url": "/sensor/count", "rate": 100 },
        { "id": 2, "url": format!("slate://{}/sensor/place/x", run.name()) },
        { "id": 3, "url": "/sensor/count", "form": "binary", "rate": 50 },
        { "id": 4, "url": "/sensor/nothing" },
    ] }));
    assert_eq!((&socket.receive()["interface"], &socket.receive()["id"]), (&json!("Speed"), &json!(2)));
    assert_eq!(socket.receive()["id"], 3);
    let refused = socket.receive();
    assert_eq!((&refused["id"], &refused["problem"]["status"]), (&json!(4), &json!(404)));
    let (mut sequences, mut places, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
    while sequences.len() < 10 || places.is_empty() || speeds.len() < 3 {
        match socket.0.read().unwrap() {
            Message::Text(text) => {
                let value: Json = serde_json::from_str(&text).unwrap();
                match value["id"].as_u64() {
                    Some(1) => sequences.push(value["sequence"].as_u64().unwrap()),
                    Some(2) => places.push(value["value"].clone()),
                    other => panic!("{other:?}"),
                }
            }
            Message::Binary(bytes) => {
                assert_eq!((bytes[0], &bytes[1..5], bytes.len()), (1, &[3, 0, 0, 0][..], 29));
                speeds.push(f64::from_le_bytes(bytes[21..29].try_into().unwrap()));
            }
            _ => {}
        }
    }
    assert!(sequences.is_sorted_by(|a, b| a < b), "{sequences:?}");
    assert_eq!(places[0], json!(1.5));
    assert!(speeds.is_sorted_by(|a, b| a < b), "{speeds:?}");
    socket.say(&json!({ "unsubscribe": [1, 2, 3] }));
    socket.say(&json!({ "sing": true }));
    while socket.receive().get("problem").is_none() {}
}

#[test]
fn socket_admits_permitted_users_only() {
    let run = Running::start("handshake");
    let path = "/api/v1/live";
    let bearer = format!("Bearer {}", run.token("viewer"));
    let good = ("Authorization", bearer.as_str());
    let open = |headers: &[(&str, &str)]| Socket::try_open(&run, path, headers).err();
    assert_eq!(open(&[]), Some(401));
    assert_eq!(open(&[good, ("Origin", "http://evil.example")]), Some(403));
    assert_eq!(open(&[good, ("Origin", "null")]), Some(403));
    assert_eq!(open(&[good, ("Sec-Fetch-Site", "cross-site")]), Some(403));
    assert_eq!(open(&[good, ("Host", "evil.example")]), Some(421));
    assert_eq!(open(&[good, ("Origin", &format!("http://{}", run.address()))]), None);
    let token = format!("slate.v1, slate.token.{}", run.token("viewer"));
    assert_eq!(open(&[("Sec-WebSocket-Protocol", &token)]), None);
    let by_query = Socket::try_open(&run, &format!("{path}?token={}", run.token("viewer")), &[]).err();
    assert_eq!(by_query, None);
    assert_eq!(
        Socket::try_open(&run, "/api/v1/teleoperation", &[good]).err(),
        Some(403),
        "a viewer does not drive"
    );
    assert_eq!(Socket::try_open(&run, "/api/v1/agent", &[good]).err(), Some(404));
}

#[test]
fn a_person_drives_until_key_release_or_disconnect() {
    let run = Running::start("drive");
    run.client("operator").send("PUT", &run.at("driver/goal"), Some(&json!({ "x": 1.0, "y": 0.0 }))).json();
    run.wait_for("the plan", || run.number("wheel/command/value") == 1.0);
    let mut socket = Socket::open(&run, "/api/v1/teleoperation", "operator");
    assert_eq!(socket.ask(&json!({ "command": { "value": 2.0 } }))["problem"]["status"], 409);
    let taken = socket.ask(&json!({ "take": "wheel", "sequence": 1 }));
    assert_eq!((&taken["taken"], &taken["sequence"]), (&json!("wheel"), &json!(1)));
    let mut second = Socket::open(&run, "/api/v1/teleoperation", "developer");
    assert!(
        second.ask(&json!({ "take": "wheel" }))["problem"]["detail"]
            .as_str()
            .unwrap()
            .contains("is controlled by")
    );
    // What is not there is not found, as everywhere.
    let unknown = &second.ask(&json!({ "take": "arm" }))["problem"];
    assert_eq!((&unknown["status"], &unknown["code"]), (&json!(404), &json!("S004")));
    assert!(unknown["detail"].as_str().unwrap().contains("wheel"), "{unknown}");
    // Held for longer than a command holds.
    for sequence in 2..12 {
        let answer = socket.ask(&json!({ "command": { "value": -3.0 }, "sequence": sequence }));
        assert_eq!(answer["sequence"], sequence);
        std::thread::sleep(Duration::from_millis(40));
    }
    assert_eq!(run.number("wheel/command/value"), -3.0);
    assert!(
        socket.ask(&json!({ "command": {} }))["problem"]["detail"]
            .as_str()
            .unwrap()
            .contains("it lacks value")
    );
    assert!(
        socket.ask(&json!({ "command": { "value": 1.0, "speed": 1.0 } }))["problem"]["detail"]
            .as_str()
            .unwrap()
            .contains("value")
    );
    socket.ask(&json!({ "release": true }));
    run.wait_for("the plan", || run.number("wheel/command/value") == 1.0);
    // The last key, and then nothing more is heard of it.
    socket.ask(&json!({ "command": { "value": -3.0 } }));
    run.wait_for("the command", || run.number("wheel/command/value") == -3.0);
    let last = Instant::now();
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    socket.ask(&json!({ "command": { "value": -3.0 } }));
    run.wait_for("the command", || run.number("wheel/command/value") == -3.0);
    let gone = Instant::now();
    drop(socket);
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(gone.elapsed() < Duration::from_millis(250), "{:?}", gone.elapsed());
    run.wait_for("the controls", || second.ask(&json!({ "take": "wheel" }))["taken"] == "wheel");
    second.ask(&json!({ "command": { "value": 2.0 } }));
    assert_eq!(second.ask(&json!({ "stop": "too near" }))["stopped"], true);
    assert_eq!(run.number("wheel/command/value"), 0.0);
    assert_eq!(run.get("/agent").json()["stopped"], "too near");
    // Nothing that is said with it is a reason not to stop.
    let operator = run.client("operator");
    for stop in [
        json!({ "stop": true }),
        json!({ "stop": null }),
        json!({ "stop": { "why": 1 } }),
        json!({ "stop": "now", "why": 1, "sequence": "a" }),
        json!({ "stop": "", "command": { "value": 1.0 } }),
    ] {
        operator.send("POST", "/reset", None).json();
        assert_eq!(run.get("/agent").json()["stopped"], json!(null));
        assert_eq!(second.ask(&stop)["stopped"], true, "{stop}");
        assert!(run.get("/agent").json()["stopped"].is_string(), "{stop}");
    }
    // A program that writes all of its fields denies it.
    operator.send("POST", "/reset", None).json();
    assert_eq!(second.ask(&json!({ "take": "wheel", "stop": null }))["taken"], "wheel");
    assert_eq!(run.get("/agent").json()["stopped"], json!(null));
}

/// The histogram of the loop: cycles, and the longest.
fn late(run: &Running) -> u64 {
    run.board
        .read("loop/state")
        .unwrap()
        .and_then(|(value, _)| value.get("overruns").and_then(|n| n.as_integer()))
        .unwrap_or(0) as u64
}

#[test]
fn clients_that_stop_reading_delay_nothing_and_are_dropped() {
    let run = Running::start("frozen");
    let before = (run.number("sensor/count/value"), Instant::now(), late(&run));
    let mut frozen = Vec::new();
    for _ in 0..8 {
        let mut socket = Socket::open(&run, "/api/v1/live", "viewer");
        let wishes: Vec<_> = (0..64)
            .map(|id| json!({ "id": id, "url": "/sensor/image", "rate": 100, "form": "binary" }))
            .collect();
        socket.say(&json!({ "subscribe": wishes }));
        frozen.push(socket);
    }
    let mut driver = Socket::open(&run, "/api/v1/teleoperation", "operator");
    driver.ask(&json!({ "take": "wheel" }));
    let mut slowest = Duration::ZERO;
    let until = Instant::now() + Duration::from_secs(4);
    while Instant::now() < until {
        let asked = Instant::now();
        driver.ask(&json!({ "command": { "value": 1.0 } }));
        slowest = slowest.max(asked.elapsed());
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(run.number("wheel/command/value"), 1.0);
    assert!(slowest < Duration::from_millis(500), "teleoperation has waited for {slowest:?}");
    let asked = Instant::now();
    run.client("viewer").send("POST", "/stop", None).json();
    assert!(asked.elapsed() < Duration::from_millis(500), "a stop has waited for {:?}", asked.elapsed());
    // It counts one a cycle of 10 ms; a busy machine may cost some of them, a client none.
    let cycles = run.number("sensor/count/value") - before.0;
    let expected = before.1.elapsed().as_secs_f64() * 100.0;
    assert!(cycles > 0.8 * expected, "{cycles} cycles of {expected}, {} overruns", late(&run) - before.2);
    // What reads nothing is let go, with what waited for it.
    run.wait_for("their end", || {
        let mut more = Vec::new();
        while let Ok(socket) = Socket::try_open(
            &run,
            "/api/v1/live",
            &[("Authorization", &format!("Bearer {}", run.token("viewer")))],
        ) {
            more.push(socket);
            if more.len() > 20 {
                return true;
            }
        }
        std::thread::sleep(Duration::from_millis(200));
        false
    });
    drop(frozen);
}

fn foxglove(run: &Running, role: &str) -> Socket {
    let bearer = format!("Bearer {}", run.token(role));
    let headers = [("Authorization", bearer.as_str()), ("Sec-WebSocket-Protocol", "foxglove.websocket.v1")];
    Socket::try_open(run, "/foxglove", &headers).unwrap()
}

#[test]
fn foxglove_command_that_lacks_a_field_is_refused() {
    let run = Running::start("foxglove-lacks");
    let mut socket = foxglove(&run, "operator");
    let channel = json!({ "id": 1, "topic": "/wheel", "encoding": "json", "schemaName": "Speed" });
    socket.say(&json!({ "op": "advertise", "channels": [channel] }));
    socket.0.send(Message::Binary([&[1, 1, 0, 0, 0][..], b"{}"].concat().into())).unwrap();
    let said = loop {
        let message = socket.receive();
        if message["op"] == "status" {
            break message;
        }
    };
    assert!(said["message"].as_str().unwrap().contains("it lacks value"), "{said}");
}

#[test]
fn foxglove_stop_waits_for_no_other_request() {
    let run = Running::start("foxglove-stop");
    let mut socket = foxglove(&run, "developer");
    let parameters = vec![json!({ "name": "/sensor/params/step", "value": 2.5 }); 1000];
    for _ in 0..8 {
        socket.say(&json!({ "op": "setParameters", "parameters": parameters, "id": "many" }));
    }
    // A call of service 1 with number 7.
    let call = [&[2, 1, 0, 0, 0, 7, 0, 0, 0, 4, 0, 0, 0][..], b"json{\"reason\":\"too near\"}"].concat();
    socket.0.send(Message::Binary(call.into())).unwrap();
    loop {
        match socket.0.read().unwrap() {
            Message::Binary(bytes) if bytes.first() == Some(&3) => break,
            Message::Text(text) => assert!(!text.contains("parameterValues"), "the stop is answered late"),
            _ => {}
        }
    }
    assert_eq!(run.get("/agent").json()["stopped"], "too near");
    run.wait_for("what was done, in the log", || {
        let lines = run.get("/log").text();
        let write = format!("PUT /api/v1/slate/{}/sensor/params/step is done", run.name());
        lines.contains("POST /api/v1/stop is done") && lines.contains(&write)
    });
}

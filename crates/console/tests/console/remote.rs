//! Tools that ask over a WebSocket as at the local socket: who may do what, and what becomes of those who ask wrongly.

use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use tokio_tungstenite::tungstenite::Message;

use crate::agent::Running;
use crate::sockets::Socket;

const PATH: &str = "/api/v1/remote";

/// Every call of the protocol, and the least role that may make it.
fn calls() -> Vec<(Json, &'static str)> {
    let path = "/sensor/params/step";
    let (viewer, operator, developer) = ("viewer", "operator", "developer");
    vec![
        (json!({ "call": "plugin/list" }), viewer),
        (json!({ "call": "module/list" }), viewer),
        (json!({ "call": "link/list" }), viewer),
        (json!({ "call": "peers" }), viewer),
        (json!({ "call": "config/get" }), viewer),
        (json!({ "call": "config/diff" }), viewer),
        (json!({ "call": "config/refused" }), viewer),
        (json!({ "call": "property/list" }), viewer),
        (json!({ "call": "read", "url": path }), viewer),
        (json!({ "call": "read/history", "url": path }), viewer),
        (json!({ "call": "record/status" }), viewer),
        (json!({ "call": "watch", "of": [{ "url": path }], "within": 0 }), viewer),
        (json!({ "call": "measure", "urls": ["/sensor/count"], "time": 1 }), viewer),
        (json!({ "call": "controls/list" }), viewer),
        (json!({ "call": "replay", "order": "status" }), viewer),
        (json!({ "call": "property/set", "url": "/driver/goal", "value": { "x": 0.0, "y": 0.0 } }), operator),
        (json!({ "call": "message/send", "url": "/nothing", "value": {} }), operator),
        (json!({ "call": "controls/take", "actuator": "wheel", "who": "me" }), operator),
        (json!({ "call": "controls/command", "command": { "value": 0.0 } }), operator),
        (json!({ "call": "controls/release" }), operator),
        (json!({ "call": "controls/leave" }), operator),
        (json!({ "call": "replay", "order": "pause" }), operator),
        (json!({ "call": "replay", "order": "resume" }), operator),
        (json!({ "call": "replay", "order": { "step": 1 } }), operator),
        (json!({ "call": "replay", "order": { "seek": 0 } }), operator),
        (json!({ "call": "replay", "order": { "rate": 2.0 } }), operator),
        (json!({ "call": "replay", "order": { "loop": null } }), operator),
        (json!({ "call": "reset" }), operator),
        (json!({ "call": "arm" }), operator),
        (json!({ "call": "record/start", "file": "run.mcap" }), operator),
        (json!({ "call": "record/stop", "file": "run.mcap" }), operator),
        (json!({ "call": "record/stop" }), operator),
        (json!({ "call": "record/snapshot", "file": "flight.mcap" }), operator),
        (json!({ "call": "property/set", "url": path, "value": 2.0 }), developer),
        (json!({ "call": "property/set", "url": "/sensor/enabled", "value": true }), developer),
        (json!({ "call": "property/set", "url": "/nothing", "value": 1 }), developer),
        (json!({ "call": "plugin/load", "name": "none" }), developer),
        (json!({ "call": "plugin/load", "file": "/tmp/lib.so" }), developer),
        (json!({ "call": "plugin/unload", "name": "none" }), developer),
        (json!({ "call": "plugin/reload", "name": "none" }), developer),
        (json!({ "call": "plugin/reload", "name": "none", "file": "/tmp/lib.so" }), developer),
        (json!({ "call": "plugin/shadow", "name": "none", "file": "/tmp/lib.so" }), developer),
        (json!({ "call": "plugin/end_shadow", "name": "none" }), developer),
        (json!({ "call": "plugin/promote", "name": "none" }), developer),
        (json!({ "call": "trace/record", "file": "trace.json" }), developer),
        (json!({ "call": "trace/progress" }), developer),
        (json!({ "call": "trace/end" }), developer),
        (json!({ "call": "module/enable", "name": "sensor" }), developer),
        (json!({ "call": "module/disable", "name": "none" }), developer),
        (json!({ "call": "link", "to": "driver/goal", "from": "sensor/place", "dry_run": true }), developer),
        (json!({ "call": "unlink", "to": "driver/history", "dry_run": true }), developer),
        (json!({ "call": "config/set", "changes": [["log.level", "trace"]], "dry_run": true }), developer),
        (json!({ "call": "config/revert" }), developer),
        (json!({ "call": "config/save" }), developer),
        (json!({ "call": "snapshot/save", "file": "remote-test" }), developer),
        (json!({ "call": "snapshot/load", "file": "remote-test" }), developer),
        (json!({ "call": "snapshot/remote", "url": "slate://other/**", "file": "remote-test" }), developer),
        // The last one, as it ends what was armed.
        (json!({ "call": "stop", "reason": "enough" }), viewer),
    ]
}

fn open(run: &Running, role: &str) -> Socket {
    let mut socket = Socket::open(run, PATH, role);
    assert_eq!(socket.hear(), json!({ "slate": 1, "agent": run.name() }));
    socket
}

#[test]
fn each_call_is_made_by_its_role_and_those_above_and_refused_to_those_below() {
    let roles = ["viewer", "operator", "developer"];
    let rank = |role: &str| roles.iter().position(|own| *own == role).unwrap();
    for role in roles {
        let run = Running::start(&format!("remote-{role}"));
        let mut socket = open(&run, role);
        for (call, least) in calls() {
            let answer = socket.ask(&call);
            let message = answer["error"]["message"].as_str().unwrap_or_default();
            let is_refused = message.ends_with(" may not do this");
            assert_eq!(is_refused, rank(role) < rank(least), "{role}: {call}: {answer}");
            if is_refused {
                let help = answer["error"]["help"].as_str().unwrap();
                assert!(help.contains(least), "{help}");
            }
        }
        assert_eq!(run.get("/agent").json()["stopped"], "enough");
    }
    // Snapshots are where an agent was started.
    std::fs::remove_file("snapshots/remote-test.snapshot").unwrap();
    let _ = std::fs::remove_dir("snapshots");
}

/// Whoever adds a call says here who may make it.
#[test]
fn the_calls_that_are_tried_are_all_that_there_are() {
    let nonsense = serde_json::from_value::<slate_runtime::remote::Call>(json!({ "call": "?" }));
    let text = nonsense.unwrap_err().to_string();
    let (_, names) = text.split_once("expected one of ").unwrap();
    let mut known: Vec<_> = names.split(", ").map(|name| name.trim_matches('`').to_owned()).collect();
    let mut tried: Vec<_> =
        calls().iter().map(|(call, _)| call["call"].as_str().unwrap().to_owned()).collect();
    known.sort();
    tried.sort();
    tried.dedup();
    assert_eq!(tried, known);
}

#[test]
fn the_door_is_opened_by_those_who_may() {
    let run = Running::start("remote-door");
    let bearer = format!("Bearer {}", run.token("developer"));
    let good = ("Authorization", bearer.as_str());
    let open = |headers: &[(&str, &str)]| Socket::try_open(&run, PATH, headers).err();
    assert_eq!(open(&[]), Some(401));
    assert_eq!(open(&[("Authorization", &bearer[..bearer.len() - 1])]), Some(401));
    for wrong in [
        ("Origin", "http://evil.example"),
        ("Origin", "null"),
        ("Sec-Fetch-Site", "cross-site"),
        ("Sec-Fetch-Site", "same-site"),
    ] {
        assert_eq!(open(&[good, wrong]), Some(403), "{wrong:?}");
    }
    assert_eq!(open(&[good, ("Host", "evil.example")]), Some(421));
    assert_eq!(open(&[good, ("Sec-WebSocket-Protocol", "foxglove.websocket.v1")]), Some(400));
    assert_eq!(open(&[good]), None);
    // As any other operation it is none, and says what it is.
    let reply = run.get("/remote");
    assert!(reply.problem(426).contains("WebSocket"));
    assert_eq!(reply.header("upgrade"), "websocket");
    let document = run.get("/openapi.json").json();
    assert!(document["paths"][PATH]["get"]["responses"]["101"].is_object());
}

#[test]
fn a_file_has_a_name_and_no_folder() {
    let run = Running::start("remote-files");
    let mut socket = open(&run, "developer");
    for file in ["/tmp/stolen.mcap", "../up.mcap", "a/b.mcap", "", ".mcap", "a.mcap.mcap", "a\u{0}b", "a.sh"]
    {
        for call in ["record/start", "record/snapshot", "snapshot/save", "snapshot/load", "trace/record"] {
            let answer = socket.ask(&json!({ "call": call, "file": file }));
            let message = answer["error"]["message"].as_str().unwrap();
            assert!(message.contains("can't be the name of"), "{call} {file:?}: {answer}");
        }
    }
    for call in ["plugin/load", "plugin/reload", "plugin/shadow"] {
        let mut call = json!({ "call": call, "name": "sensor", "file": "/tmp/lib.so" });
        if call["call"] == "plugin/load" {
            call.as_object_mut().unwrap().remove("name");
        }
        let answer = socket.ask(&call);
        assert!(answer["error"]["message"].as_str().unwrap().contains("over the network"), "{answer}");
    }
    assert_eq!(
        socket.ask(&json!({ "call": "record/start", "file": "mine.mcap" })),
        json!({ "result": null })
    );
    let again = socket.ask(&json!({ "call": "record/start", "file": "mine" }));
    assert!(again["error"]["message"].as_str().unwrap().contains("mine.mcap already"), "{again}");
    let ended = socket.ask(&json!({ "call": "record/stop", "file": "mine.mcap" }));
    assert_eq!(ended["result"]["file"], json!(run.folder.join("mine.mcap")), "{ended}");
    socket.ask(&json!({ "call": "trace/record", "file": "what.json" }));
    let traced = socket.ask(&json!({ "call": "trace/end" }));
    assert_eq!(traced["result"]["file"], json!(run.folder.join("what.json")), "{traced}");
    assert!(run.folder.join("what.json").is_file());
}

#[test]
fn what_is_no_call_is_answered_and_what_is_too_long_ends_the_visit() {
    let run = Running::start("remote-nonsense");
    let mut socket = open(&run, "developer");
    for nonsense in ["", "{", "[]", "{\"call\":\"sing\"}", "{\"call\":\"stop\",\"loud\":1}", "\u{0}"] {
        socket.0.send(Message::Text(nonsense.into())).unwrap();
        let answer = socket.hear();
        assert!(answer["error"]["message"].as_str().unwrap().contains("no call"), "{nonsense:?}: {answer}");
    }
    assert!(socket.ask(&json!({ "call": "module/list" }))["result"].is_array());
    let long = format!("{{\"call\":\"stop\",\"reason\":\"{}\"}}", "a".repeat(1 << 20));
    let _ = socket.0.send(Message::Text(long.into()));
    assert!(socket.0.read().is_err());
    assert_eq!(run.get("/agent").json()["stopped"], Json::Null);
}

#[test]
fn who_drives_over_it_holds_the_controls_as_long_as_he_is_there() {
    let run = Running::start("remote-drive");
    let mut socket = open(&run, "operator");
    let taken = socket.ask(&json!({ "call": "controls/take", "actuator": "wheel", "who": "keys" }));
    assert_eq!(taken["result"]["hold"], 150, "{taken}");
    let holder = run.get("/leases").json()[0]["holder"].clone();
    assert!(holder.as_str().unwrap().starts_with("keys (operator at 127.0.0.1"), "{holder}");
    let drive = |socket: &mut Socket| {
        socket.ask(&json!({ "call": "controls/command", "command": { "value": -3.0 } }));
        run.wait_for("the command", || run.number("wheel/command/value") == -3.0);
        Instant::now()
    };
    // The last command, and nothing more is heard of it.
    let last = drive(&mut socket);
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    // The connection goes.
    drive(&mut socket);
    let gone = Instant::now();
    drop(socket);
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(gone.elapsed() < Duration::from_millis(250), "{:?}", gone.elapsed());
    run.wait_for("the controls", || run.get("/leases").json()[0]["holder"].is_null());
    // One that is there and says nothing has them no longer than a lease holds.
    let mut silent = open(&run, "operator");
    silent.ask(&json!({ "call": "controls/take", "actuator": "wheel" }));
    let taken = Instant::now();
    run.wait_for("the controls", || run.get("/leases").json()[0]["holder"].is_null());
    assert!(taken.elapsed() > Duration::from_secs(4), "{:?}", taken.elapsed());
}

#[test]
fn tools_that_wait_or_are_gone_keep_nobody_from_stopping_or_looking() {
    let run = Running::start("remote-crowd");
    let watch = json!({ "call": "watch", "of": [{ "url": "/driver/goal", "after": 9 }], "within": 4000 });
    let bearer = format!("Bearer {}", run.token("viewer"));
    let headers = [("Authorization", bearer.as_str())];
    let mut crowd: Vec<_> = std::iter::from_fn(|| Socket::try_open(&run, PATH, &headers).ok()).collect();
    assert_eq!(crowd.len(), 12);
    crowd.iter_mut().for_each(|socket| socket.say(&watch));
    // Others look and drive, and a stop is a request of its own.
    let asked = Instant::now();
    Socket::open(&run, "/api/v1/live", "viewer");
    let mut driver = Socket::open(&run, "/api/v1/teleoperation", "operator");
    assert_eq!(driver.ask(&json!({ "take": "wheel" }))["taken"], "wheel");
    run.client("viewer").send("POST", "/stop", None).json();
    assert!(asked.elapsed() < Duration::from_secs(1), "{:?}", asked.elapsed());
    // Their places are free when what they asked for is over, and not before.
    drop(crowd);
    assert_eq!(Socket::try_open(&run, PATH, &headers).err(), Some(503));
    run.wait_for("a place", || Socket::try_open(&run, PATH, &headers).is_ok());
}

#[test]
fn a_tool_that_asks_too_fast_is_answered_more_slowly_and_delays_no_cycle() {
    let run = Running::start("remote-fast");
    let mut socket = open(&run, "viewer");
    let before = (run.number("sensor/count/value"), Instant::now());
    let calls = 600;
    for _ in 0..calls {
        assert!(socket.ask(&json!({ "call": "read", "url": "/sensor/count" }))["result"].is_object());
    }
    let took = before.1.elapsed();
    // 256 a second, after what is free at once.
    assert!(took > Duration::from_millis(1900), "{took:?}");
    // It counts one a cycle of 10 ms; a busy machine may cost some of them.
    let cycles = run.number("sensor/count/value") - before.0;
    assert!(cycles > 0.8 * took.as_secs_f64() * 100.0, "{cycles} cycles in {took:?}");
}

#[test]
fn tools_that_read_nothing_are_let_go_and_delay_no_cycle() {
    let run = Running::start("remote-frozen");
    let bearer = format!("Bearer {}", run.token("viewer"));
    let headers = [("Authorization", bearer.as_str())];
    let before = (run.number("sensor/count/value"), Instant::now());
    let call = json!({ "call": "watch", "of": vec![json!({ "url": "/sensor/image" }); 8] }).to_string();
    let frozen: Vec<_> = (0..12)
        .map(|_| {
            let mut socket = Socket::try_open(&run, PATH, &headers).unwrap();
            socket.0.get_ref().set_nonblocking(true).unwrap();
            // As much as goes out without anything coming in.
            for _ in 0..200 {
                let _ = socket.0.send(Message::Text(call.clone().into()));
            }
            socket
        })
        .collect();
    assert_eq!(Socket::try_open(&run, PATH, &headers).err(), Some(503));
    // When what the kernel keeps for them is full, they have 5 s.
    while Socket::try_open(&run, PATH, &headers).is_err() {
        assert!(before.1.elapsed() < Duration::from_secs(60), "they are still there");
        std::thread::sleep(Duration::from_millis(200));
    }
    let (cycles, passed) = (run.number("sensor/count/value") - before.0, before.1.elapsed());
    assert!(cycles > 0.8 * passed.as_secs_f64() * 100.0, "{cycles} cycles in {passed:?}");
    drop(frozen);
}

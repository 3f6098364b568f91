//! Properties of an agent that others set.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use slate_blackboard::Stamp;
use slate_blackboard::interface::Interface;
use slate_interfaces::Pose2;
use slate_network::{SampleAttachment, encoding};
use slate_ros_messages as ros;
use zenoh::query::Reply;
use zenoh::{Session, Wait};

use crate::network::agent::{Running, ask_json, eventually, json, ports, session, wait_for_agent};

fn start(name: &str, set: &str) -> (Running, Session) {
    let [port] = ports();
    let agent = Running::start(name, &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nset = [{set}]"));
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, name);
    eventually("the first cycle", || !agent.number("driver/seen/value").is_nan());
    (agent, other)
}

fn pose(x: f64) -> Vec<u8> {
    let bytes: Vec<u8> = [x, 0.0, 0.0].iter().flat_map(|number| number.to_ne_bytes()).collect();
    let mut message = Vec::new();
    ros::encode(Pose2::DESCRIPTOR, &bytes, &mut message).unwrap();
    message
}

#[test]
fn a_parameter_an_input_and_a_switch_are_set_as_by_slate_set() {
    let (agent, other) = start("set", "\"sensor/params\", \"driver/goal\", \"sensor/enabled\"");
    let accepted = ask_json(&other, "slate/set/sensor/params/step", Some((b"2.5", "text/plain"))).unwrap();
    assert_eq!(accepted["status"], "accepted");
    assert_eq!(accepted["changes"][0]["path"], "modules.sensor.params.step");
    assert_eq!(accepted["changes"][0]["after"], "2.5");
    eventually("the parameter", || agent.number("sensor/params/step") == 2.5);
    // The configuration has it, so it is saved, recorded and shown as any other change.
    let settings = ask_json(&other, "slate/set/sensor/params/step", Some((b"2.5", "text/plain"))).unwrap();
    assert_eq!(settings["changes"], serde_json::json!([]));
    eventually("the log", || agent.has_logged("network: ") && agent.has_logged("modules.sensor.params.step"));
    let message = pose(3.0);
    let whole = encoding(Pose2::DESCRIPTOR);
    assert_eq!(
        ask_json(&other, "slate/set/driver/goal", Some((&message, &whole))).unwrap()["status"],
        "accepted"
    );
    eventually("the goal", || agent.number("driver/seen/value") == 3.0);
    let part = (&b"{\"x\": 4}"[..], "application/json");
    assert_eq!(ask_json(&other, "slate/set/driver/goal", Some(part)).unwrap()["status"], "accepted");
    eventually("the field", || agent.number("driver/seen/value") == 4.0);
    // Without an encoding, too: what many programs send.
    assert_eq!(
        ask_json(&other, "slate/set/driver/goal", Some((&pose(5.0), ""))).unwrap()["status"],
        "accepted"
    );
    eventually("the goal", || agent.number("driver/seen/value") == 5.0);
    assert_eq!(
        ask_json(&other, "slate/set/sensor/enabled", Some((b"false", ""))).unwrap()["status"],
        "accepted"
    );
    eventually("the switch", || {
        let count = agent.number("sensor/count/value");
        std::thread::sleep(std::time::Duration::from_millis(50));
        agent.number("sensor/count/value") == count
    });
}

#[test]
fn a_message_is_done_or_refused() {
    let (agent, other) = start("told", "\"driver/notes\"");
    let done =
        ask_json(&other, "slate/told/driver/notes", Some((b"{\"value\": 2}", "application/json"))).unwrap();
    assert_eq!(done["status"], "done");
    eventually("the message", || agent.number("driver/heard/value") == 2.0);
    let refused = ask_json(&other, "slate/told/driver/notes", Some((b"-1", "text/plain"))).unwrap_err();
    assert_eq!(refused["status"], "refused");
    assert_eq!(agent.number("driver/heard/value"), 2.0);
}

#[test]
fn protected_property_is_refused_with_reason() {
    let (agent, other) =
        start("refuses", "\"sensor/*\", \"driver/goal\", \"driver/linked\", \"driver/seen\"");
    let text = "text/plain";
    let twist = "application/cdr;slate_msgs/msg/Twist2";
    let own = encoding(Pose2::DESCRIPTOR);
    let message = pose(9.0);
    let cases: [(&str, &[u8], &str, &str); 12] = [
        ("driver/ambient", b"1", text, "may not be set from the network"),
        ("driver/notes", b"1", text, "may not be set from the network"),
        ("sensor/count", b"1", text, "one writer"),
        ("driver/linked", b"1", text, "is linked, from /sensor/count"),
        ("sensor/params/step", b"7.5", text, "outside"),
        ("sensor/params/step", b"fast", text, "not text"),
        ("sensor/params/stride", b"1", text, "stride"),
        ("driver/goal", &message, twist, "expected slate_msgs/msg/Pose2"),
        ("driver/goal", &message[..20], &own, "bytes should follow"),
        ("driver/goal", b"1", text, "several fields"),
        ("driver/goal", b"{\"x\":", "application/json", "not JSON"),
        ("sensor/nothing", b"1", text, "nothing"),
    ];
    for (path, bytes, encoding, reason) in cases {
        let error = ask_json(&other, &format!("slate/refuses/{path}"), Some((bytes, encoding))).unwrap_err();
        assert_eq!(error["status"], "refused", "{path}");
        assert!(error["reason"].as_str().unwrap().contains(reason), "{path}: {error}");
        assert!(!error["help"].as_str().unwrap().is_empty(), "{path}: {error}");
    }
    let several = ask_json(&other, "slate/refuses/sensor/**", Some((b"1", text))).unwrap_err();
    assert!(several["reason"].as_str().unwrap().contains("several properties"), "{several}");
    let tree = ask_json(&other, "slate/refuses/@tree", Some((b"1", text))).unwrap_err();
    assert!(tree["reason"].as_str().unwrap().contains("takes no payload"), "{tree}");
    assert_eq!(agent.number("sensor/params/step"), 1.0);
    assert_eq!(agent.number("driver/seen/value"), 0.0);
}

#[test]
fn a_value_of_another_schema_sets_nothing() {
    let (agent, other) = start("schema", "\"driver/goal\"");
    let attachment = SampleAttachment { stamp: Stamp::default(), hash: 1, number: 0 }.encode();
    let replies = other
        .get("slate/schema/driver/goal")
        .payload(pose(9.0))
        .encoding(encoding(Pose2::DESCRIPTOR))
        .attachment(&attachment[..])
        .wait()
        .unwrap();
    let error = replies.recv().unwrap().into_result().unwrap_err();
    let error = error.payload().try_to_string().unwrap().into_owned();
    assert!(error.contains("both ends need the same version"), "{error}");
    assert_eq!(agent.number("driver/seen/value"), 0.0);
}

#[test]
fn too_many_changes_at_once_are_answered_with_full() {
    let (agent, other) = start("busy", "\"sensor/params\"");
    let answers = Arc::new(Mutex::new(BTreeMap::<String, usize>::new()));
    const SENT: usize = 400;
    for i in 0..SENT {
        let counted = Arc::clone(&answers);
        let count = move |reply: Reply| {
            let bytes = match reply.result() {
                Ok(sample) => sample.payload().to_bytes().into_owned(),
                Err(error) => error.payload().to_bytes().into_owned(),
            };
            let status = json(&bytes)["status"].as_str().unwrap().to_owned();
            *counted.lock().unwrap().entry(status).or_default() += 1;
        };
        let step = format!("{}", 1.0 + (i % 4) as f64);
        let get = other.get("slate/busy/sensor/params/step").payload(step).timeout(Duration::from_secs(20));
        get.callback(count).wait().unwrap();
    }
    eventually("all answers", || answers.lock().unwrap().values().sum::<usize>() == SENT);
    let answers = answers.lock().unwrap().clone();
    assert_eq!(answers.keys().collect::<Vec<_>>(), ["accepted", "full"], "{answers:?}");
    // It answers again as soon as it has time.
    let accepted = ask_json(&other, "slate/busy/sensor/params/step", Some((b"5", "text/plain"))).unwrap();
    assert_eq!(accepted["status"], "accepted");
    eventually("the last change", || agent.number("sensor/params/step") == 5.0);
}

//! Properties of an agent that others read.

use std::sync::{Arc, Mutex};

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Interface;
use slate_blackboard::{Access, Store};
use slate_interfaces::{Point2, Pose2};
use slate_network::{SampleAttachment, encoding};
use slate_ros_messages as ros;
use zenoh::Wait;
use zenoh::sample::Sample;

use crate::network::agent::{Running, ask, ask_json, eventually, json, ports, session, wait_for_agent};

fn attachment(sample: &Sample) -> SampleAttachment {
    SampleAttachment::decode(&sample.attachment().unwrap().to_bytes()).unwrap()
}

#[test]
fn a_subscriber_reads_each_change_with_stamp_and_schema() {
    let [port] = ports();
    let agent =
        Running::start("reads", &format!("listen = [\"tcp/127.0.0.1:{port}\"]\npublish = [\"sensor/*\"]"));
    let other = session("peer", &[], &[port]);
    let samples = Arc::new(Mutex::new(Vec::new()));
    let taken = Arc::clone(&samples);
    let take = move |sample: Sample| taken.lock().unwrap().push(sample);
    let _all = other.declare_subscriber("slate/reads/**").callback(take).wait().unwrap();
    let of = |key: &str| -> Vec<Sample> {
        let samples = samples.lock().unwrap();
        samples.iter().filter(|sample| sample.key_expr().as_str() == key).cloned().collect()
    };
    eventually("twenty values", || of("slate/reads/sensor/count").len() > 20);
    let counts = of("slate/reads/sensor/count");
    for pair in counts.windows(2) {
        assert!(attachment(&pair[0]).stamp.sequence < attachment(&pair[1]).stamp.sequence);
        assert!(attachment(&pair[0]).stamp.time < attachment(&pair[1]).stamp.time);
    }
    // The count is its sequence number, so stamp and value belong together.
    for sample in &counts {
        let number = &sample.payload().to_bytes()[4..12];
        let number = f64::from_le_bytes(number.try_into().unwrap());
        assert_eq!(number as u64, attachment(sample).stamp.sequence);
    }
    let pose = of("slate/reads/sensor/pose").pop().unwrap();
    assert_eq!(pose.encoding().to_string(), encoding(Pose2::DESCRIPTOR));
    assert_eq!(attachment(&pose).hash, Pose2::DESCRIPTOR.hash);
    assert_eq!(attachment(&pose).stamp.generation, 1);
    let value = ros::decode(Pose2::DESCRIPTOR, &pose.payload().to_bytes()).unwrap();
    let expected: Vec<u8> = [1.5_f64, -2.5, 0.25].iter().flat_map(|number| number.to_ne_bytes()).collect();
    assert_eq!(value, expected);
    // A debug output is computed, as it has a reader.
    assert!(!of("slate/reads/sensor/trace").is_empty());
    // What is not named stays private.
    assert!(of("slate/reads/driver/heard").is_empty());
    drop(agent);
}

#[test]
fn nothing_is_computed_or_encoded_without_readers() {
    let [port] = ports();
    let agent = Running::start("idle", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "idle");
    eventually("some cycles", || agent.number("sensor/count/value") > 20.0);
    let (trace, _) = agent.surface.board().find("sensor/trace").unwrap();
    assert!(!trace.is_watched() && agent.number("sensor/trace/value").is_nan());
    let reader = other.declare_subscriber("slate/idle/sensor/trace").wait().unwrap();
    eventually("a watcher", || trace.is_watched());
    assert!(reader.recv().is_ok());
    reader.undeclare().wait().unwrap();
    eventually("nobody to watch", || !trace.is_watched());
}

#[test]
fn a_command_leaves_after_its_gate_alone() {
    let [port] = ports();
    let wheel = "[modules.wheel]\n[actuators.motor]\ncommand = \"wheel/turn\"\nsafe = { value = 0.0 }\ntime_to_live = \"1s\"";
    let mut agent = Running::load_with("guarded", wheel, &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    agent.connect().unwrap();
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "guarded");
    let value = |path: &str| ask_json(&other, &format!("slate/guarded/{path}?format=json"), None);
    eventually("the command behind the gate", || value("motor/command").is_ok());
    for key in ["wheel/turn", "@read/all/wheel/turn"] {
        let refused = value(key).unwrap_err();
        assert!(refused["reason"].as_str().unwrap().contains("nothing is published"), "{refused}");
    }
    let tree = ask_json(&other, "slate/guarded/@tree", None).unwrap();
    let listed = |path: &str| tree.as_array().unwrap().iter().any(|entry| entry["path"] == path);
    assert!(listed("motor/command") && !listed("wheel/turn"), "{tree}");
}

#[test]
fn a_property_that_comes_later_is_published_until_it_goes() {
    let [port] = ports();
    let agent = Running::start("grows", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let other = session("peer", &[], &[port]);
    let reader = other.declare_subscriber("slate/grows/later/pose").wait().unwrap();
    let board = agent.surface.board();
    let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 2, queues: 0, window: 0 } };
    let property = board.add_channel("later/pose", "", Pose2::DESCRIPTOR, store, Access::Output).unwrap();
    let mut writer = property.channel().unwrap().writer().unwrap();
    writer.write(&[0; 24], 0, 7).unwrap();
    let sample = reader.recv().unwrap();
    assert_eq!((attachment(&sample).stamp.time, attachment(&sample).stamp.sequence), (7, 1));
    board.remove("later/pose").unwrap();
    let gone = || ask_json(&other, "slate/grows/later/pose", None);
    assert!(gone().unwrap_err()["reason"].as_str().unwrap().contains("nothing is published"));
    // It comes back as another interface.
    let property = board.add_channel("later/pose", "", Point2::DESCRIPTOR, store, Access::Output).unwrap();
    let mut writer = property.channel().unwrap().writer().unwrap();
    writer.write(&[0; 16], 0, 8).unwrap();
    let sample = reader.recv().unwrap();
    assert_eq!(sample.encoding().to_string(), encoding(Point2::DESCRIPTOR));
    assert_eq!(attachment(&sample).hash, Point2::DESCRIPTOR.hash);
}

#[test]
fn newest_values_tree_and_schemas_answer_queries() {
    let [port] = ports();
    let agent = Running::start(
        "asked",
        &format!("listen = [\"tcp/127.0.0.1:{port}\"]\npublish = [\"sensor/**\"]\nset = [\"driver/notes\"]"),
    );
    eventually("a value", || agent.number("sensor/count/value") > 1.0);
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "asked");
    let pose = ask(&other, "slate/asked/sensor/pose", None).remove(0).unwrap();
    assert_eq!(attachment(&pose).hash, Pose2::DESCRIPTOR.hash);
    assert!(ros::decode(Pose2::DESCRIPTOR, &pose.payload().to_bytes()).is_ok());
    assert_eq!(ask_json(&other, "slate/asked/sensor/pose/theta", None), Ok(json(b"0.25")));
    let whole = ask_json(&other, "slate/asked/sensor/pose?format=json", None);
    assert_eq!(whole, Ok(json(b"{\"x\": 1.5, \"y\": -2.5, \"theta\": 0.25}")));
    let mut keys: Vec<_> = ask(&other, "slate/asked/sensor/*", None)
        .into_iter()
        .map(|reply| reply.unwrap().key_expr().to_string())
        .collect();
    keys.sort();
    for name in ["count", "pose"] {
        assert!(keys.contains(&format!("slate/asked/sensor/{name}")), "{keys:?}");
    }
    let tree = ask_json(&other, "slate/asked/@tree", None).unwrap();
    let entry = |path: &str| tree.as_array().unwrap().iter().find(|entry| entry["path"] == path);
    let listed = entry("sensor/pose").unwrap();
    assert_eq!(listed["encoding"], "application/cdr;slate_msgs/msg/Pose2");
    assert_eq!(listed["schema"], format!("{:016x}", Pose2::DESCRIPTOR.hash));
    assert_eq!(
        (&entry("driver/notes").unwrap()["settable"], &listed["settable"]),
        (&true.into(), &false.into())
    );
    assert!(entry("driver/heard").is_none());
    let schema = ask_json(&other, "slate/asked/@schema/Pose2", None).unwrap();
    assert_eq!(schema["schema"], listed["schema"]);
    // A program with the definition reads the value without this crate's interfaces.
    let (name, text) = (schema["message"].as_str().unwrap(), schema["definition"].as_str().unwrap());
    let value = ros::Schema::parse(name, text).unwrap().decode(&pose.payload().to_bytes()).unwrap();
    assert_eq!(value.get("y").and_then(ros::Value::as_f64), Some(-2.5));
    assert_eq!(schema["json_schema"]["properties"]["theta"]["x-unit"], "rad");
    assert!(ask(&other, "slate/asked/@schema/*", None).len() >= 2);
}

#[test]
fn missing_name_is_error_with_nearest_name() {
    let [port] = ports();
    let _agent =
        Running::start("absent", &format!("listen = [\"tcp/127.0.0.1:{port}\"]\npublish = [\"sensor/**\"]"));
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "absent");
    let cases = [
        ("slate/absent/sensor/pos", "nothing is published at slate/absent/sensor/pos", "sensor/pose"),
        ("slate/absent/driver/heard", "nothing is published", "@tree"),
        ("slate/absent/sensor/pose/z", "`z`", "@schema"),
        ("slate/absent/sensor/trace", "has no value yet", "subscribe"),
        ("slate/absent/@schema/Map", "no interface", "@schema/*"),
    ];
    for (key, reason, help) in cases {
        let error = ask_json(&other, key, None).unwrap_err();
        assert_eq!(error["status"], "refused", "{key}");
        assert!(error["reason"].as_str().unwrap().contains(reason), "{key}: {error}");
        assert!(error["help"].as_str().unwrap().contains(help), "{key}: {error}");
    }
}

//! Topics both ways, with rospy.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::path::{Path, PathBuf};

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_ros1::{Ros1Bridge, Ros1Settings};
use slate_runtime::Options;

use crate::ros1::agent::{Running, eventually, linked};
use crate::ros1::peer::Master;

fn scan(ranges: &[f32]) -> Json {
    json!({
        "header": { "seq": 7, "stamp": { "secs": 12, "nsecs": 34 }, "frame_id": "laser" },
        "angle_min": -1.0, "angle_max": 1.0, "angle_increment": 1.0, "time_increment": 0.0, "scan_time": 0.0,
        "range_min": 0.125, "range_max": 8.0, "ranges": ranges, "intensities": [],
    })
}

#[test]
fn topics_of_nodes_fill_inputs() {
    let master = Master::start();
    let links = "\"base/scan\" = \"ros1:/scan\"\n\"base/command\" = \"ros1:/cmd_vel\"";
    let agent = Running::start(&master.address(), links);
    let mut peer = master.peer("laser");
    peer.advertise("/scan", "sensor_msgs/LaserScan");
    peer.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("subscriptions", || peer.matched("/scan") == 1 && peer.matched("/cmd_vel") == 1);
    peer.publish("/scan", &scan(&[1.5, 2.0, f32::MAX]));
    eventually("the scan", || agent.number("base/scan/ranges/1") == 2.0);
    assert_eq!(agent.number("base/scan/range_min"), 0.125);
    let command =
        json!({ "linear": { "x": 0.5, "y": 9.0, "z": 0.0 }, "angular": { "x": 0.0, "y": 0.0, "z": -0.75 } });
    peer.publish("/cmd_vel", &command);
    eventually("the command", || agent.number("base/odometry/twist/angular") == -0.75);
    // A message without room is logged once, changes nothing, and later ones are read.
    for _ in 0..3 {
        peer.publish("/scan", &scan(&[1.0; 5]));
    }
    let status = || agent.bridge().topics().into_iter().find(|own| own.topic == "/scan").unwrap();
    eventually("refusals", || status().refused == 3);
    assert_eq!(status().error.unwrap(), "`ranges` has 5 items, and the input has room for 4");
    let lines = agent.log.lines();
    assert_eq!(lines.iter().filter(|line| line.to_string().contains("does not fit /base/scan")).count(), 1);
    peer.publish("/scan", &scan(&[3.0, 4.0]));
    eventually("the next scan", || agent.number("base/scan/ranges/1") == 4.0);
    eventually("no error", || status().error.is_none());
    // A tool can't set what comes from ROS.
    let (input, _) = agent.composer.board().get("base/scan").unwrap();
    let value = slate_blackboard::interface::Value::Float(0.0);
    assert!(input.set("angle_min", &value, 0).unwrap_err().to_string().contains("ros1:/scan"));
}

#[test]
fn two_inputs_of_a_topic_both_learn_of_a_later_publisher() {
    let master = Master::start();
    let links = "\"base/command\" = \"ros1:/cmd_vel\"\n\"second/command\" = \"ros1:/cmd_vel\"";
    let text = linked(&master.address(), links).replacen(
        "[modules.base]",
        "[modules.base]\n[modules.second]\nkind = \"base\"",
        1,
    );
    let agent = Running::of(&text);
    let mut peer = master.peer("driver");
    peer.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("subscriptions", || {
        let topics = agent.bridge().topics();
        topics.len() == 2 && topics.iter().all(|own| own.others == Some(1))
    });
}

#[test]
fn properties_are_topics_with_the_checksums_of_ros() {
    let master = Master::start();
    let links = "\"ros1:/odom\" = \"base/odometry\"\n\"ros1:/sum\" = \"base/sum\"";
    let agent = Running::start(&master.address(), links);
    let mut peer = master.peer("listener");
    // rospy takes only messages whose checksum is that of its own definition.
    peer.subscribe("/odom", "nav_msgs/Odometry");
    peer.request(json!({ "do": "subscribe", "topic": "/sum" }));
    let mut heard = Vec::new();
    eventually("odometry", || {
        heard.extend(peer.take("/odom"));
        heard.len() > 20
    });
    let odometry = heard.last().unwrap();
    assert_eq!(odometry["header"]["frame_id"], "odom");
    assert_eq!(odometry["child_frame_id"], "base_link");
    assert_eq!(odometry["pose"]["pose"]["position"]["y"], -2.5);
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs();
    let stamp = odometry["header"]["stamp"]["secs"].as_u64().unwrap();
    assert!(now - stamp < 60, "{stamp} {now}");
    let sums = peer.take("/sum");
    assert_eq!(sums[0]["type"], "slate_msgs/Number");
    assert_eq!(agent.bridge().topics()[0].others, Some(1));
    assert_eq!(peer.request(json!({ "do": "topics" }))["/odom"], "nav_msgs/Odometry");
    let nodes = peer.request(json!({ "do": "nodes" }));
    assert!(nodes.as_array().unwrap().contains(&"/r2_d2".into()), "{nodes}");
    assert!(agent.bridge().topics()[0].count > 20);
    // With the agent its node goes.
    drop(agent);
    eventually("the end of the node", || {
        !peer.request(json!({ "do": "nodes" })).as_array().unwrap().contains(&"/r2_d2".into())
    });
}

#[test]
fn a_node_that_ends_and_comes_again_is_read_again() {
    let master = Master::start();
    let agent = Running::start(&master.address(), "\"base/command\" = \"ros1:/cmd_vel\"");
    for round in 1..=3 {
        let mut peer = master.peer("driver");
        peer.advertise("/cmd_vel", "geometry_msgs/Twist");
        eventually("the subscription", || peer.matched("/cmd_vel") == 1);
        let turn = f64::from(round);
        let command = json!({ "linear": { "x": 0.0, "y": 0.0, "z": 0.0 }, "angular": { "x": 0.0, "y": 0.0, "z": turn } });
        peer.publish("/cmd_vel", &command);
        eventually("the command", || agent.number("base/command/angular") == turn);
    }
}

#[test]
fn a_killed_node_does_not_keep_its_subscription() {
    let master = Master::start();
    let agent = Running::start(&master.address(), "\"ros1:/odom\" = \"base/odometry\"");
    let others = || agent.bridge().topics()[0].others;
    let mut peer = master.peer("listener");
    peer.subscribe("/odom", "nav_msgs/Odometry");
    eventually("a subscription", || others() == Some(1));
    drop(peer);
    eventually("its end", || others() == Some(0));
    // A topic without subscribers is not encoded.
    let count = agent.bridge().topics()[0].count;
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(agent.bridge().topics()[0].count <= count + 1);
}

#[test]
fn late_subscribers_hear_the_last_message_of_a_latched_topic() {
    let master = Master::start();
    let text = format!(
        "[modules.lamp]\n[ros1]\nmaster = \"{}\"\nserve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"std_srvs/SetBool\" }}\n\
         write.\"lit\" = {{ from = \"lamp/lit\", latched = true }}",
        master.address()
    );
    let _agent = Running::of(&text);
    let mut peer = master.peer("person");
    let called = peer.request(
        json!({ "do": "call", "service": "/lamp", "type": "std_srvs/SetBool", "request": { "data": true } }),
    );
    assert_eq!(called, json!({ "success": true, "message": "done" }));
    peer.request(json!({ "do": "subscribe", "topic": "/lit" }));
    eventually("the last message", || peer.take("/lit").len() == 1);
}

#[test]
fn a_master_that_begins_anew_learns_all_again() {
    let mut master = Master::core();
    let links = "\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/odom\" = \"base/odometry\"";
    let agent = Running::start(&master.address(), links);
    let turn = |peer: &mut crate::ros1::peer::Peer, turn: f64| {
        let command = json!({ "linear": { "x": 0.0 }, "angular": { "z": turn } });
        peer.publish("/cmd_vel", &command);
        eventually("the command", || agent.number("base/command/angular") == turn);
    };
    let mut old = master.peer("old");
    old.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("the subscription", || old.matched("/cmd_vel") == 1);
    turn(&mut old, 1.0);
    master.kill();
    eventually("the loss", || agent.logged("is lost; connections to nodes remain") == 1);
    // Nodes that know each other need no master.
    turn(&mut old, 2.0);
    master.revive();
    eventually("its return", || agent.logged("has restarted, and /r2_d2 is registered again") == 1);
    let mut new = master.peer("new");
    new.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("the subscription", || new.matched("/cmd_vel") == 1);
    turn(&mut new, 3.0);
    new.subscribe("/odom", "nav_msgs/Odometry");
    eventually("odometry", || !new.take("/odom").is_empty());
}

#[test]
fn mismatch_names_both_types() {
    let master = Master::start();
    let links = "\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/odom\" = \"base/odometry\"";
    let agent = Running::start(&master.address(), links);
    let mut peer = master.peer("driver");
    peer.advertise("/cmd_vel", "geometry_msgs/TwistStamped");
    let words = "/cmd_vel: a publisher, /driver, has type geometry_msgs/TwistStamped (98d34b0043a2093cf9d9345ab6eef12e) and this \
                 agent geometry_msgs/Twist (9f195f881246fdfa2798d1d3eebca84a), so they exchange nothing";
    eventually("a publisher of another type", || agent.logged(words) == 1);
    peer.publish("/cmd_vel", &json!({ "twist": { "linear": { "x": 1.0 } } }));
    peer.subscribe("/odom", "geometry_msgs/Twist");
    let words = "/odom: a subscription, /driver, has type geometry_msgs/Twist (9f195f881246fdfa2798d1d3eebca84a) and this agent \
                 nav_msgs/Odometry (cd5e73d190d741a2f92e81eda573aca7), so they exchange nothing";
    eventually("a subscriber of another type", || agent.logged(words) == 1);
    assert!(agent.number("base/command/linear").is_nan());
    assert!(peer.take("/odom").is_empty());
}

#[test]
fn nodes_on_other_machines_are_not_spoken_with_unless_trusted() {
    let master = Master::start();
    let agent = Running::start(&master.address(), "\"base/command\" = \"ros1:/cmd_vel\"");
    let mut peer = master.peer("driver");
    let far = json!({ "do": "register", "topic": "/cmd_vel", "type": "geometry_msgs/Twist", "api": "http://192.0.2.1:9/" });
    peer.request(far);
    eventually("the reason", || agent.logged("192.0.2.1:9 is on another machine: write trusted = true") == 1);
    // Those on this one are read as before.
    peer.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("the subscription", || peer.matched("/cmd_vel") == 1);
    peer.publish("/cmd_vel", &json!({ "linear": { "x": 0.25 } }));
    eventually("the command", || agent.number("base/command/linear") == 0.25);
}

#[test]
fn without_a_master_nothing_begins() {
    let agent = Running::load(
        &linked("http://127.0.0.1:9", "\"base/command\" = \"ros1:/cmd_vel\""),
        Options::default(),
    );
    let settings = Ros1Settings::of(&agent.configuration).unwrap().unwrap();
    let error = Ros1Bridge::open(&agent.surface, &settings).unwrap_err();
    assert!(error.to_string().starts_with("the master of ROS at http://127.0.0.1:9: "), "{error}");
    assert!(error.help().contains("roscore"), "{}", error.help());
    // The input is as before: a person may set it.
    agent.set("base/command", "linear", Value::Float(1.0));
}

/// The file of `geometry_msgs/WrenchStamped`, with those of the messages in it beside it, as a workspace of ROS has them.
fn wrench_definition() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-messages/geometry_msgs/msg");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, text) in [
        ("WrenchStamped", "# A wrench with a frame and a time.\nHeader header\nWrench wrench\n"),
        ("Wrench", "Vector3 force\nVector3 torque\n"),
        ("Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ] {
        std::fs::write(folder.join(name).with_extension("msg"), text).unwrap();
    }
    folder.join("WrenchStamped.msg")
}

#[test]
fn messages_defined_by_files_are_read_and_written() {
    let master = Master::start();
    let file = wrench_definition();
    let file = file.display();
    let agent = Running::of(&format!(
        "[modules.wrist]\n[links]\n\"wrist/load\" = {{ from = \"ros1:/load\", definition = \"{file}\" }}\n[ros1]\n\
         master = \"{}\"\nwrite.\"/felt\" = {{ from = \"wrist/felt\", definition = \"{file}\", frame = \"wrist\" }}",
        master.address()
    ));
    let mut peer = master.peer("sensor");
    peer.advertise("/load", "geometry_msgs/WrenchStamped");
    peer.subscribe("/felt", "geometry_msgs/WrenchStamped");
    eventually("matches", || peer.matched("/load") == 1 && agent.bridge().topics()[1].others == Some(1));
    peer.publish(
        "/load",
        &json!({ "wrench": { "force": { "x": 1.5, "z": -9.0 }, "torque": { "y": 0.25 } } }),
    );
    let mut felt = Vec::new();
    eventually("the load", || {
        felt.extend(peer.take("/felt"));
        !felt.is_empty()
    });
    assert_eq!(felt[0]["wrench"]["force"], json!({ "x": 1.5, "y": 0.0, "z": -9.0 }));
    assert_eq!(felt[0]["wrench"]["torque"], json!({ "x": 0.0, "y": 0.25, "z": 0.0 }));
    assert_eq!(felt[0]["header"]["frame_id"], "wrist");
}

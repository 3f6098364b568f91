//! Frames, time and log of a node, with rospy.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use serde_json::{Value as Json, json};
use slate_module::Level;

use crate::ros1::agent::{Running, eventually};
use crate::ros1::peer::{Master, Peer};

/// A transform of a frame, as rospy has it.
fn transforms(parent: &str, child: &str, x: f64) -> Json {
    json!({ "transforms": [{
        "header": { "stamp": { "secs": 12, "nsecs": 34 }, "frame_id": parent },
        "child_frame_id": child,
        "transform": { "translation": { "x": x, "y": 2.0, "z": 0.5 }, "rotation": { "z": 0.6, "w": 0.8 } },
    }] })
}

fn advertise_latched(peer: &mut Peer, topic: &str) {
    peer.request(json!({ "do": "advertise", "topic": topic, "type": "tf2_msgs/TFMessage", "latched": true }));
}

#[test]
fn frames_come_from_two_latched_writers_and_a_moving_one() {
    let master = Master::start();
    let text = format!(
        "[modules.laser_frame]\nkind = \"external_frame\"\n[modules.camera_frame]\nkind = \"external_frame\"\n\
         [modules.arm_frame]\nkind = \"external_frame\"\n[ros1]\nmaster = \"{}\"\ntf = true\n\
         frames.\"laser_frame/transform\" = \"laser\"\nframes.\"camera_frame/transform\" = \"camera\"\n\
         frames.\"arm_frame/transform\" = \"arm\"\n",
        master.address()
    );
    // Both have written before.
    let (mut one, mut other) = (master.peer("one"), master.peer("other"));
    advertise_latched(&mut one, "/tf_static");
    advertise_latched(&mut other, "/tf_static");
    one.publish("/tf_static", &transforms("base_link", "laser", 1.0));
    other.publish("/tf_static", &transforms("/base_link", "/camera", 3.0));
    let agent = Running::of(&text);
    eventually("the laser", || agent.number("laser_frame/transform/translation/x") == 1.0);
    eventually("the camera", || agent.number("camera_frame/transform/translation/x") == 3.0);
    assert_eq!(agent.value("camera_frame/transform/parent").unwrap().as_str(), Some("base_link"));
    one.advertise("/tf", "tf2_msgs/TFMessage");
    eventually("a subscription", || one.matched("/tf") == 1);
    for x in [4.0, 5.0] {
        one.publish("/tf", &transforms("laser", "arm", x));
        eventually("the arm", || agent.number("arm_frame/transform/translation/x") == x);
    }
    assert_eq!(agent.number("arm_frame/transform/rotation/z"), 0.6);
    // Transforms from ROS are not sent back.
    let mut listener = master.peer("listener");
    listener.subscribe("/tf_static", "tf2_msgs/TFMessage");
    let mut taken = 0;
    eventually("both writers", || {
        taken += listener.take("/tf_static").len();
        taken == 2
    });
}

#[test]
fn frames_of_the_agent_are_heard_by_late_listeners() {
    let master = Master::start();
    let text =
        format!("[modules.base]\n[modules.mast]\n[ros1]\nmaster = \"{}\"\ntf = true\n", master.address());
    let _agent = Running::of(&text);
    std::thread::sleep(std::time::Duration::from_secs(2));
    let mut listener = master.peer("listener");
    listener.subscribe("/tf_static", "tf2_msgs/TFMessage");
    listener.subscribe("/tf", "tf2_msgs/TFMessage");
    let mut fixed = Vec::new();
    eventually("the mast", || {
        fixed.extend(listener.take("/tf_static"));
        !fixed.is_empty()
    });
    let mast = &fixed[0]["transforms"][0];
    assert_eq!((&mast["header"]["frame_id"], &mast["child_frame_id"]), (&json!("base_link"), &json!("mast")));
    assert_eq!(mast["transform"]["translation"]["z"], 1.25);
    let mut moving = Vec::new();
    eventually("odometry", || {
        moving.extend(listener.take("/tf"));
        moving.len() > 2
    });
    let base = &moving[0]["transforms"][0];
    assert_eq!((&base["header"]["frame_id"], &base["child_frame_id"]), (&json!("odom"), &json!("base_link")));
    assert_eq!(base["transform"]["translation"]["y"], -2.5);
}

#[test]
fn nodes_of_ros_1_hear_the_time_of_the_agent() {
    let master = Master::start();
    let text = format!("[modules.base]\n[ros1]\nmaster = \"{}\"\nclock = true\n", master.address());
    let _agent = Running::lockstep(&text);
    let mut peer = master.peer("sleeper");
    peer.subscribe("/clock", "rosgraph_msgs/Clock");
    let mut heard = Vec::new();
    eventually("times", || {
        heard.extend(peer.take("/clock"));
        heard.len() > 20
    });
    let time = |own: &Json| {
        own["clock"]["secs"].as_u64().unwrap() * 1_000_000_000 + own["clock"]["nsecs"].as_u64().unwrap()
    };
    assert!(heard.windows(2).all(|two| time(&two[0]) < time(&two[1])), "{heard:?}");
    assert!(heard.iter().all(|own| time(own) % 10_000_000 == 0), "{heard:?}");
}

#[test]
fn rosout_has_lines_of_the_log_with_level_and_module() {
    let master = Master::start();
    let agent =
        Running::of(&format!("[modules.base]\n[ros1]\nmaster = \"{}\"\nrosout = true\n", master.address()));
    let mut peer = master.peer("listener");
    peer.subscribe("/rosout", "rosgraph_msgs/Log");
    eventually("a subscription", || {
        agent.composer.log(Level::Warn, "the battery is low");
        let heard = peer.take("/rosout");
        let own = heard.iter().find(|line| line["msg"] == "the battery is low");
        own.is_some_and(|line| line["level"] == 4 && line["name"] == "/r2_d2")
    });
}

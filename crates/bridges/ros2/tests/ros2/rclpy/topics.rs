//! Topics both ways.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::path::Path;

use serde_json::{Value as Json, json};
use slate_ros2::TopicStatus;

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::{Peer, python};

fn scan(ranges: &[f32]) -> Json {
    json!({
        "header": { "stamp": { "sec": 12, "nanosec": 34 }, "frame_id": "laser" },
        "angle_min": -1.0, "angle_max": 1.0, "angle_increment": 1.0,
        "range_min": 0.125, "range_max": 8.0, "ranges": ranges,
    })
}

fn status(agent: &Running, topic: &str) -> TopicStatus {
    agent.bridge().topics().into_iter().find(|own| own.topic == topic).unwrap()
}

#[test]
fn a_scan_with_its_header_is_read() {
    alone("ros2::rclpy::topics::a_scan_with_its_header_is_read", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/scan\" = {{ topic = \"/scan\", reliable = false }}\n\
             read.\"driver/command\" = \"/cmd_vel\""
        );
        let agent = Running::start("reader", &table);
        let mut peer = Peer::start("laser", domain);
        peer.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({ "reliable": false }));
        peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        eventually("subscriptions", || peer.matched("/scan") == 1 && peer.matched("/cmd_vel") == 1);
        eventually("publishers", || {
            status(&agent, "/scan").others == Some(1) && status(&agent, "/cmd_vel").others == Some(1)
        });
        peer.publish("/scan", &scan(&[1.5, 2.0, f32::MAX]));
        eventually("the scan", || agent.number("driver/scan/ranges/1") == 2.0);
        assert_eq!(agent.number("driver/scan/angle_min"), -1.0);
        assert_eq!(agent.number("driver/scan/range_min"), 0.125);
        let command = json!({ "linear": { "x": 0.5, "y": 9.0 }, "angular": { "z": -0.75 } });
        peer.publish("/cmd_vel", &command);
        eventually("the command", || agent.number("driver/wheels/angular") == -0.75);
        assert_eq!(agent.number("driver/command/linear"), 0.5);
        // A message without room is logged once, changes nothing, and later ones are read.
        for _ in 0..3 {
            peer.publish("/scan", &scan(&[1.0; 5]));
        }
        eventually("refusals", || status(&agent, "/scan").refused == 3);
        let error = status(&agent, "/scan").error.unwrap();
        assert_eq!(error, "`ranges` has 5 items, and the input has room for 4");
        agent.composer.flush_log(std::time::Duration::from_secs(5));
        assert_eq!(agent.logged("does not fit /driver/scan"), 1);
        assert_eq!(agent.number("driver/scan/ranges/1"), 2.0);
        peer.publish("/scan", &scan(&[3.0, 4.0]));
        eventually("the next scan", || agent.number("driver/scan/ranges/1") == 4.0);
        assert_eq!(status(&agent, "/scan").error, None);
        // A tool can't set what comes from ROS.
        let (input, _) = agent.composer.board().get("driver/scan").unwrap();
        let value = slate_blackboard::interface::Value::Float(0.0);
        assert!(input.set("angle_min", &value, 0).unwrap_err().to_string().contains("ros2:/scan"));
    });
}

#[test]
fn properties_are_topics_of_a_node_that_ros_shows() {
    alone("ros2::rclpy::topics::properties_are_topics_of_a_node_that_ros_shows", |domain| {
        let table = format!(
            "domain = {domain}\nnamespace = \"/robots\"\nread.\"driver/command\" = \"cmd_vel\"\n\
             write.\"/odom\" = \"sensor/odometry\"\nwrite.\"~/scan\" = {{ from = \"sensor/scan\", frame = \"laser\", \
             reliable = false, depth = 1 }}\nwrite.\"/count\" = \"sensor/count\""
        );
        let agent = Running::start("r2-d2", &table);
        let mut peer = Peer::start("listener", domain);
        peer.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
        peer.subscribe("/robots/r2_d2/scan", "sensor_msgs/msg/LaserScan", json!({ "reliable": false }));
        let mut heard = Vec::new();
        eventually("odometry", || {
            heard.extend(peer.take("/odom"));
            heard.len() > 20
        });
        let odometry = heard.last().unwrap();
        assert_eq!(odometry["header"]["frame_id"], "odom");
        assert_eq!(odometry["child_frame_id"], "base_link");
        assert_eq!(odometry["pose"]["pose"]["position"]["y"], -2.5);
        let turn = &odometry["pose"]["pose"]["orientation"];
        assert!((turn["z"].as_f64().unwrap() - 0.5_f64.sqrt()).abs() < 1e-12, "{turn}");
        assert_eq!(odometry["twist"]["twist"]["angular"]["z"], -0.25);
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs();
        let stamp = odometry["header"]["stamp"]["sec"].as_u64().unwrap();
        assert!(now - stamp < 60, "{stamp} {now}");
        let xs: Vec<f64> =
            heard.iter().map(|own| own["pose"]["pose"]["position"]["x"].as_f64().unwrap()).collect();
        assert!(xs.is_sorted_by(|a, b| a < b), "{xs:?}");
        let mut scans = Vec::new();
        eventually("scans", || {
            scans.extend(peer.take("/robots/r2_d2/scan"));
            !scans.is_empty()
        });
        assert_eq!(scans[0]["header"]["frame_id"], "laser");
        assert_eq!((&scans[0]["angle_max"], &scans[0]["ranges"][2]), (&json!(0.5), &json!(2.5)));
        eventually("the node", || {
            let nodes = peer.request(json!({ "do": "nodes" }));
            nodes.as_array().unwrap().contains(&"/robots/r2_d2".into())
        });
        let topics = peer.request(json!({ "do": "topics" }));
        assert_eq!(topics["/odom"], json!(["nav_msgs/msg/Odometry"]));
        assert_eq!(topics["/count"], json!(["slate_msgs/msg/Number"]));
        let endpoints = |peer: &mut Peer, topic: &str, publishers: bool| {
            peer.request(json!({ "do": "endpoints", "topic": topic, "publishers": publishers }))
        };
        assert_eq!(
            endpoints(&mut peer, "/odom", true),
            json!([["r2_d2", "nav_msgs/msg/Odometry", "RELIABLE", "VOLATILE"]])
        );
        assert_eq!(
            endpoints(&mut peer, "/robots/r2_d2/scan", true),
            json!([["r2_d2", "sensor_msgs/msg/LaserScan", "BEST_EFFORT", "VOLATILE"]])
        );
        assert_eq!(
            endpoints(&mut peer, "/robots/cmd_vel", false),
            json!([["r2_d2", "geometry_msgs/msg/Twist", "RELIABLE", "VOLATILE"]])
        );
        assert!(status(&agent, "/odom").count > 20);
    });
}

#[test]
fn qos_mismatch_names_policy_and_type() {
    alone("ros2::rclpy::topics::qos_mismatch_names_policy_and_type", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/scan\" = \"/scan\"\nread.\"driver/command\" = \"/cmd_vel\"\n\
             write.\"/odom\" = {{ from = \"sensor/odometry\", reliable = false }}\nwrite.\"/map_odom\" = \"sensor/odometry\""
        );
        let agent = Running::start("picky", &table);
        let mut peer = Peer::start("other", domain);
        peer.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({ "reliable": false }));
        peer.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
        peer.subscribe("/map_odom", "nav_msgs/msg/Odometry", json!({ "transient_local": true }));
        peer.advertise("/cmd_vel", "geometry_msgs/msg/TwistStamped", json!({}));
        let said = [
            "/scan: a publisher offers incompatible QoS, so nothing is received from it: RELIABILITY (offered BEST_EFFORT, requested \
             RELIABLE); reliable = false reads it",
            "/odom: a subscription requests incompatible QoS, so nothing is sent to it: RELIABILITY (offered BEST_EFFORT, requested \
             RELIABLE); take reliable = false away",
            "/map_odom: a subscription requests incompatible QoS, so nothing is sent to it: DURABILITY (offered VOLATILE, requested \
             TRANSIENT_LOCAL); transient_local = true offers it",
            "/cmd_vel: a publisher has type geometry_msgs/msg/TwistStamped and this agent geometry_msgs/msg/Twist",
        ];
        for words in said {
            eventually(words, || agent.has_logged(words));
        }
        let mut incompatible = Vec::new();
        eventually("what rclpy says of it", || {
            incompatible
                .extend(peer.request(json!({ "do": "take_incompatible" })).as_array().unwrap().clone());
            let is_said = |topic: &str, policy: &str| {
                incompatible.iter().any(|own| own[0] == topic && own[1].as_str().unwrap().contains(policy))
            };
            is_said("/scan", "RELIABILITY")
                && is_said("/odom", "RELIABILITY")
                && is_said("/map_odom", "DURABILITY")
        });
        let lines = agent.log.lines();
        let shown = lines.iter().filter(|line| line.to_string().contains("/scan: a publisher offers"));
        assert_eq!(shown.count(), 1);
    });
}

#[test]
fn a_late_subscription_receives_the_last_values_that_are_kept() {
    alone("ros2::rclpy::topics::a_late_subscription_receives_the_last_values_that_are_kept", |domain| {
        let table = format!(
            "domain = {domain}\nwrite.\"/last\" = {{ from = \"sensor/odometry\", transient_local = true, depth = 1 }}\n\
             read.\"driver/command\" = {{ topic = \"/held\", transient_local = true }}"
        );
        let mut peer = Peer::start("early", domain);
        peer.advertise("/held", "geometry_msgs/msg/Twist", json!({ "transient_local": true, "depth": 1 }));
        peer.publish("/held", &json!({ "linear": { "x": 0.25 } }));
        let agent = Running::start("late", &table);
        eventually("the value from before", || agent.number("driver/command/linear") == 0.25);
        eventually("values", || status(&agent, "/last").count > 3);
        agent.composer.enable("sensor", false).unwrap();
        let last = {
            std::thread::sleep(std::time::Duration::from_millis(300));
            agent.number("sensor/odometry/pose/x")
        };
        peer.subscribe("/last", "nav_msgs/msg/Odometry", json!({ "transient_local": true }));
        let mut heard = Vec::new();
        eventually("the last value", || {
            heard.extend(peer.take("/last"));
            heard.last().is_some_and(|own: &Json| own["pose"]["pose"]["position"]["x"] == last)
        });
    });
}

#[test]
fn a_killed_node_comes_back() {
    alone("ros2::rclpy::topics::a_killed_node_comes_back", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/command\" = \"/cmd_vel\"\nwrite.\"/odom\" = \"sensor/odometry\""
        );
        let agent = Running::start("phoenix", &table);
        for life in 1..=2 {
            let mut peer = Peer::start("mortal", domain);
            peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
            peer.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
            eventually("a subscription", || peer.matched("/cmd_vel") == 1);
            let speed = f64::from(life) / 4.0;
            eventually("the command", || {
                peer.publish("/cmd_vel", &json!({ "linear": { "x": speed } }));
                agent.number("driver/command/linear") == speed
            });
            eventually("odometry", || !peer.take("/odom").is_empty());
            peer.kill();
        }
        assert_eq!(agent.number("driver/command/linear"), 0.5);
    });
}

#[test]
fn a_reliable_topic_loses_nothing_at_1000_messages_a_second() {
    alone("ros2::rclpy::topics::a_reliable_topic_loses_nothing_at_1000_messages_a_second", |domain| {
        let table =
            format!("domain = {domain}\nread.\"driver/command\" = {{ topic = \"/cmd_vel\", depth = 1000 }}");
        let agent = Running::start("counter", &table);
        let mut peer = Peer::start("quick", domain);
        peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({ "depth": 1000 }));
        eventually("a subscription", || {
            peer.matched("/cmd_vel") == 1 && status(&agent, "/cmd_vel").others == Some(1)
        });
        let (input, _) = agent.composer.board().get("driver/command").unwrap();
        peer.request(json!({ "do": "burst", "topic": "/cmd_vel", "count": 3000, "period": 0.001 }));
        eventually("all of them", || status(&agent, "/cmd_vel").count == 3000);
        let status = status(&agent, "/cmd_vel");
        assert_eq!((status.dropped, status.refused), (0, 0));
        // Each was a write of its own, and the last one is there.
        assert_eq!(input.channel().unwrap().published(), 3000);
        assert_eq!(agent.number("driver/command/linear"), 3000.0);
    });
}

/// Sends so many images of a size through an agent, one after the other, and panics unless each comes back whole.
fn send_images(mut peer: Peer, domain: u16, size: u64, count: usize) {
    let text = format!(
        "[agent]\nname = \"mirror\"\n[loop]\nperiod = \"10ms\"\n[modules.eye]\n[ros2]\ndomain = {domain}\n\
         read.\"eye/image\" = {{ topic = \"/camera\", depth = 1 }}\n\
         write.\"/seen\" = {{ from = \"eye/image\", frame = \"camera\", depth = 1 }}"
    );
    let agent = Running::of(&text);
    peer.advertise("/camera", "sensor_msgs/msg/Image", json!({ "depth": 1 }));
    peer.request(json!({ "do": "see", "topic": "/seen" }));
    eventually("a subscription", || {
        peer.matched("/camera") == 1 && status(&agent, "/seen").others == Some(1)
    });
    let sum: u64 = (0..size).map(|number| number % 251).sum();
    for number in 1..=count {
        peer.request(json!({ "do": "show", "topic": "/camera", "size": size }));
        eventually("the image", || status(&agent, "/camera").count == number as u64);
        let mut seen = Vec::new();
        eventually("the image again", || {
            seen.extend(peer.take("/seen"));
            !seen.is_empty()
        });
        assert_eq!(seen, [json!([size / 1024, size, sum])]);
    }
}

#[test]
fn an_image_of_a_mebibyte_goes_through_the_agent() {
    alone("ros2::rclpy::topics::an_image_of_a_mebibyte_goes_through_the_agent", |domain| {
        send_images(Peer::start("camera", domain), domain, 1 << 20, 1);
    });
}

#[test]
fn images_of_eight_mebibytes_go_through_the_agent() {
    // Some kernels do not show it in a namespace.
    if let Ok(room) = std::fs::read_to_string("/proc/sys/net/core/rmem_max") {
        let is_enough = room.trim().parse::<u64>().unwrap() >= 4 << 20;
        assert!(is_enough, "this test needs sockets with room: sysctl -w net.core.rmem_max=4194304");
    }
    alone("ros2::rclpy::topics::images_of_eight_mebibytes_go_through_the_agent", |domain| {
        send_images(Peer::with_large_buffers("camera", domain), domain, 8 << 20, 5);
    });
}

#[test]
fn messages_defined_by_files_are_read_and_written() {
    alone("ros2::rclpy::topics::messages_defined_by_files_are_read_and_written", |domain| {
        // As ROS itself has it, with the file of the message in it beside it.
        let environment = python().parent().and_then(Path::parent).unwrap().to_owned();
        let file = environment.join("share/geometry_msgs/msg/WrenchStamped.msg");
        let text = format!(
            "agent.name = \"arm\"\nloop.period = \"10ms\"\n[modules.wrist]\n[links]\n\
             \"wrist/load\" = {{ from = \"ros2:/load\", definition = {file:?} }}\n[ros2]\ndomain = {domain}\n\
             write.\"/felt\" = {{ from = \"wrist/felt\", definition = {file:?}, frame = \"wrist\" }}"
        );
        let agent = Running::of(&text);
        let mut peer = Peer::start("sensor", domain);
        peer.advertise("/load", "geometry_msgs/msg/WrenchStamped", json!({}));
        peer.subscribe("/felt", "geometry_msgs/msg/WrenchStamped", json!({}));
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
    });
}

//! Topics both ways over Zenoh.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use serde_json::{Value as Json, json};
use slate_ros2::TopicStatus;

use crate::ros2::rclpy::agent::{Running, eventually};
use crate::ros2::zenoh::peer::{Node, Router};

fn status(agent: &Running, topic: &str) -> TopicStatus {
    agent.bridge().topics().into_iter().find(|own| own.topic == topic).unwrap()
}

#[test]
fn a_scan_and_a_command_are_read_over_zenoh() {
    let router = Router::start();
    let table = router.table(3)
        + "read.\"driver/scan\" = { topic = \"/scan\", reliable = false }\nread.\"driver/command\" = \"/cmd_vel\"";
    let agent = Running::start("reader", &table);
    let mut node = Node::start(&router, 3);
    node.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({ "reliable": false }));
    node.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
    eventually("publishers", || {
        status(&agent, "/scan").others == Some(1) && status(&agent, "/cmd_vel").others == Some(1)
    });
    let scan = |ranges: &[f32]| json!({ "angle_min": -1.0, "range_min": 0.125, "ranges": ranges });
    eventually("the scan", || {
        node.publish("/scan", &scan(&[1.5, 2.0]));
        agent.number("driver/scan/ranges/1") == 2.0
    });
    assert_eq!(agent.number("driver/scan/range_min"), 0.125);
    node.publish("/cmd_vel", &json!({ "linear": { "x": 0.5, "y": 9.0 }, "angular": { "z": -0.75 } }));
    eventually("the command", || agent.number("driver/wheels/angular") == -0.75);
    assert_eq!(agent.number("driver/command/linear"), 0.5);
    // A message without room changes nothing, and later ones are read.
    let before = status(&agent, "/scan").count;
    (0..3).for_each(|_| node.publish("/scan", &scan(&[1.0; 5])));
    eventually("refusals", || status(&agent, "/scan").refused == 3);
    assert_eq!(status(&agent, "/scan").count, before);
    node.publish("/scan", &scan(&[3.0, 4.0]));
    eventually("the next scan", || agent.number("driver/scan/ranges/1") == 4.0);
}

#[test]
fn properties_are_topics_that_others_hear_and_see() {
    let router = Router::start();
    let table = router.table(3)
        + "namespace = \"/robots\"\nread.\"driver/command\" = \"cmd_vel\"\nwrite.\"/odom\" = \"sensor/odometry\"\n\
           write.\"~/scan\" = { from = \"sensor/scan\", frame = \"laser\", reliable = false, depth = 1 }";
    let agent = Running::start("r2-d2", &table);
    let mut node = Node::start(&router, 3);
    node.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
    node.subscribe("/robots/r2_d2/scan", "sensor_msgs/msg/LaserScan", json!({ "reliable": false }));
    let mut heard = Vec::new();
    eventually("odometry", || {
        heard.extend(node.take("/odom"));
        heard.len() > 20
    });
    let odometry = heard.last().unwrap();
    assert_eq!(odometry["header"]["frame_id"], "odom");
    assert_eq!(odometry["pose"]["pose"]["position"]["y"], -2.5);
    let xs = heard.iter().map(|own| own["pose"]["pose"]["position"]["x"].as_f64().unwrap());
    assert!(xs.collect::<Vec<_>>().is_sorted_by(|a, b| a < b));
    eventually("a scan", || {
        node.take("/robots/r2_d2/scan")
            .first()
            .is_some_and(|scan| scan["header"]["frame_id"] == "laser" && scan["ranges"][2] == json!(2.5))
    });
    // The graph, as the other implementation reads it.
    let topics = node.request(json!({ "do": "topics" }));
    assert_eq!(topics["/robots/cmd_vel"], json!(["geometry_msgs/msg/Twist"]));
    let endpoints = |node: &mut Node, topic: &str, publishers: bool| {
        let found = node.request(json!({ "do": "endpoints", "topic": topic, "publishers": publishers }));
        found.as_array().unwrap().clone()
    };
    let odom = endpoints(&mut node, "/odom", true);
    let hash = "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0";
    assert_eq!(odom, [json!(["r2_d2", "/robots", "nav_msgs/msg/Odometry", hash, "::,10:,:,:,,"])]);
    let scan = endpoints(&mut node, "/robots/r2_d2/scan", true);
    assert_eq!(scan[0][4], "2::,1:,:,:,,");
    assert_eq!(endpoints(&mut node, "/robots/cmd_vel", false).len(), 1);
    assert!(status(&agent, "/odom").count > 20);
}

#[test]
fn messages_have_number_time_and_identity_beside_them() {
    let router = Router::start();
    let agent = Running::start("talker", &(router.table(3) + "write.\"/odom\" = \"sensor/odometry\""));
    let mut node = Node::start(&router, 3);
    node.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
    let mut attachments: Vec<Json> = Vec::new();
    eventually("messages", || {
        attachments.extend(node.list("take_attachments", "/odom"));
        attachments.len() > 5
    });
    let bytes = |own: &Json| -> Vec<u8> {
        let text = own.as_str().unwrap();
        (0..text.len()).step_by(2).map(|at| u8::from_str_radix(&text[at..at + 2], 16).unwrap()).collect()
    };
    let all: Vec<_> = attachments.iter().map(bytes).collect();
    let number = |own: &Vec<u8>| i64::from_le_bytes(own[..8].try_into().unwrap());
    assert!(all.windows(2).all(|pair| number(&pair[1]) == number(&pair[0]) + 1), "{attachments:?}");
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as i64;
    let sent = i64::from_le_bytes(all[0][8..16].try_into().unwrap());
    assert!((0..60_000_000_000).contains(&(now - sent)), "{sent} {now}");
    // The identity is the hash of the token, by an implementation of its own.
    let token = node.tokens().into_iter().find(|token| token.contains("/MP/") && token.contains("/%odom/"));
    let gid = node.request(json!({ "do": "gid", "token": token.unwrap() }));
    assert_eq!(attachments[0].as_str().unwrap()[32..], format!("10{}", gid.as_str().unwrap()));
    drop(agent);
    eventually("no tokens", || node.tokens().iter().all(|token| !token.contains("talker")));
}

#[test]
fn nothing_is_lost_over_zenoh_at_a_thousand_messages_a_second() {
    let router = Router::start();
    let agent = Running::start(
        "counter",
        &(router.table(3) + "read.\"driver/command\" = { topic = \"/cmd_vel\", depth = 1000 }"),
    );
    let mut node = Node::start(&router, 3);
    node.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
    eventually("a publisher", || status(&agent, "/cmd_vel").others == Some(1));
    eventually("a first command", || {
        node.publish("/cmd_vel", &json!({ "linear": { "x": -1.0 } }));
        status(&agent, "/cmd_vel").count > 0
    });
    std::thread::sleep(std::time::Duration::from_millis(300));
    let before = status(&agent, "/cmd_vel").count;
    node.request(json!({ "do": "burst", "topic": "/cmd_vel", "count": 3000, "period": 0.001 }));
    eventually("all of them", || status(&agent, "/cmd_vel").count == before + 3000);
    assert_eq!(status(&agent, "/cmd_vel").dropped, 0);
    assert_eq!(agent.number("driver/command/linear"), 3000.0);
}

#[test]
fn images_of_mebibytes_go_both_ways_over_zenoh() {
    let router = Router::start();
    let text = "[agent]\nname = \"mirror\"\n[loop]\nperiod = \"10ms\"\n[modules.eye]\n[ros2]\n".to_owned()
        + &router.table(3)
        + "read.\"eye/image\" = \"/camera\"\nwrite.\"/seen\" = { from = \"eye/image\", depth = 1 }";
    let agent = Running::of(&text);
    let mut node = Node::start(&router, 3);
    node.advertise("/camera", "sensor_msgs/msg/Image", json!({}));
    node.subscribe("/seen", "sensor_msgs/msg/Image", json!({}));
    eventually("both ends", || {
        status(&agent, "/camera").others == Some(1) && status(&agent, "/seen").others == Some(1)
    });
    let size: u64 = 1 << 20;
    let sum: u64 = (0..size).map(|number| number % 251).sum();
    let mut seen = Vec::new();
    eventually("an image there and back", || {
        node.request(json!({ "do": "show", "topic": "/camera", "size": size }));
        seen.extend(node.take("/seen"));
        !seen.is_empty()
    });
    assert_eq!((&seen[0]["height"], &seen[0]["data"]), (&json!(1024), &json!([size, sum])));
    // The input has no room for a larger one, which comes whole.
    node.request(json!({ "do": "show", "topic": "/camera", "size": 9 << 20 }));
    eventually("the reason", || {
        status(&agent, "/camera").error.is_some_and(|error| error.contains("9437184 items"))
    });
}

#[test]
fn late_subscriptions_receive_what_was_kept() {
    let router = Router::start();
    let mut node = Node::start(&router, 3);
    let speeds: Vec<_> = (1..=4).map(|speed| json!({ "linear": { "x": speed } })).collect();
    node.request(
        json!({ "do": "keep", "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist", "values": speeds }),
    );
    // The log of a busy machine says that cycles are late, and below the newest line is read.
    let table = router.table(3)
        + "read.\"driver/command\" = { topic = \"/cmd_vel\", transient_local = true, depth = 3 }\n\
           [log]\nlevel = \"error\"";
    let agent = Running::start("late", &table);
    // The last three of four, the newest last.
    eventually("what was kept", || status(&agent, "/cmd_vel").count == 3);
    assert_eq!(agent.number("driver/command/linear"), 4.0);
    // What the agent keeps, the other implementation requests, of which it takes the newest.
    agent.composer.log(slate_module::Level::Error, "the wheel is stuck");
    let mut line = Json::Null;
    eventually("the log", || {
        node.subscribe("/rosout", "rcl_interfaces/msg/Log", json!({ "transient_local": true, "depth": 100 }));
        line = node.take("/rosout").pop().unwrap_or_default();
        line["msg"] == "the wheel is stuck"
    });
    assert_eq!((&line["level"], &line["name"]), (&json!(40), &json!("late")));
}

#[test]
fn an_agent_without_a_router_runs_and_joins_it_later() {
    let port = super::peer::free_port();
    let table = format!(
        "wire = \"zenoh\"\nrouter = \"tcp/127.0.0.1:{port}\"\ndomain = 3\nread.\"driver/command\" = \"/cmd_vel\""
    );
    let agent = Running::start("early", &table);
    eventually("a warning", || {
        agent.has_logged(&format!("no router is reached at `tcp/127.0.0.1:{port}`"))
            && agent.has_logged("rmw_zenohd")
    });
    let before = agent.number("sensor/count/value");
    eventually("cycles", || agent.number("sensor/count/value") > before + 20.0);
    let drive = |router: &Router, speed: f64| {
        let mut node = Node::start(router, 3);
        node.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        eventually("the command", || {
            node.publish("/cmd_vel", &json!({ "linear": { "x": speed } }));
            agent.number("driver/wheels/linear") == speed
        });
    };
    let router = Router::at(port);
    drive(&router, 0.5);
    assert_eq!(agent.logged("no router is reached"), 1);
    // A router that ends, and comes back.
    drop(router);
    eventually("a warning", || agent.has_logged(&format!("the router at tcp/127.0.0.1:{port} is lost")));
    assert_eq!(status(&agent, "/cmd_vel").others, Some(0));
    drive(&Router::at(port), 0.75);
    assert_eq!(agent.logged("is back, and the node has joined again"), 1);
}

#[test]
fn different_types_and_broken_messages_are_reported() {
    let router = Router::start();
    let agent = Running::start(
        "picky",
        &(router.table(3) + "read.\"driver/command\" = \"/cmd_vel\"\nread.\"driver/scan\" = \"/scan\""),
    );
    let mut node = Node::start(&router, 3);
    node.advertise("/cmd_vel", "geometry_msgs/msg/TwistStamped", json!({}));
    let hash = format!("RIHS01_{}", "ab".repeat(32));
    node.request(
        json!({ "do": "advertise", "topic": "/scan", "type": "sensor_msgs/msg/LaserScan", "hash": hash }),
    );
    eventually("the type", || {
        agent.has_logged(
            "/cmd_vel: a publisher has type geometry_msgs/msg/TwistStamped and this agent geometry_msgs/msg/Twist",
        )
    });
    let line = format!(
        "/scan: a publisher defines sensor_msgs/msg/LaserScan differently (type hash {hash}, here RIHS01_64c1"
    );
    eventually("the hash", || agent.has_logged(&line));
    assert_eq!(status(&agent, "/scan").others, Some(0));
    // What is not a token or no message changes nothing.
    for token in [
        "@ros2_lv/3/x",
        "@ros2_lv/3/a/0/1/MP/%/%/n/%scan/t/h/nothing",
        "@ros2_lv/3/a/0/1/ZZ/%/%/n/%scan/t/h/::,10:,:,:,,",
        "@ros2_lv/3/a/0/1/MS/%/%/n/%scan",
    ] {
        node.request(json!({ "do": "announce", "token": token }));
    }
    let key = "3/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828";
    for data in ["", "00", "0001000000", "000100000000000000000000ffffffff"] {
        node.request(json!({ "do": "put", "key": key, "data": data }));
    }
    eventually("refusals", || status(&agent, "/scan").refused == 4);
    assert_eq!(status(&agent, "/scan").count, 0);
}

//! A run with ROS, made again from its recording.

use std::path::Path;

use serde_json::json;
use slate_ros2::RosBridge;

use crate::ros2::rclpy::agent::{
    alone, assert_repeated, configuration, database, exchange_requests, plugins, record,
};
use crate::ros2::rclpy::peer::Peer;

const SET_BOOL: &str = "std_srvs/srv/SetBool";

/// Records a run in lockstep in which a node publishes as fast as it can.
fn record_topics(path: &Path, domain: u16) {
    let table = format!(
        "domain = {domain}\nread.\"driver/scan\" = \"/scan\"\nread.\"driver/command\" = \"/cmd_vel\"\n\
         write.\"/wheels\" = \"driver/wheels\""
    );
    let database = database(&configuration("mirror", &table));
    record::<RosBridge>(path, (&database, &plugins()), &[], |bridge, _| {
        let mut peer = Peer::start("driver", domain);
        peer.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({}));
        peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        let mut number = 0.0;
        while bridge.topics()[..2].iter().any(|topic| topic.count < 100) {
            number += 1.0;
            peer.publish("/scan", &json!({ "ranges": [number, number / 3.0] }));
            peer.publish("/cmd_vel", &json!({ "linear": { "x": number }, "angular": { "z": -number } }));
            assert!(number < 100_000.0, "{:?}", bridge.topics());
        }
    });
}

/// Records a run in lockstep in which a node calls an inbox, and an outbox calls a node.
fn record_services(path: &Path, domain: u16) {
    let text = format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.lamp]\n[modules.asker]\nparams.tells = false\n[ros2]\n\
         domain = {domain}\n\
         serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}\n\
         call.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", response = \"asker/reply\" }}"
    );
    record::<RosBridge>(path, (&database(&text), &plugins()), &["asker/wish"], |_, composer| {
        let mut peer = Peer::start("person", domain);
        let response = json!({ "success": true, "message": "yes" });
        peer.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }));
        exchange_requests(composer, |on| {
            let request = json!({ "data": on });
            let called = json!({ "do": "call", "service": "/lamp", "type": SET_BOOL, "request": request });
            assert_eq!(peer.request(called)["success"], json!(true));
        });
        let asked = peer.request(json!({ "do": "asked", "service": "/enable" }));
        assert_eq!(asked.as_array().map(Vec::len), Some(30));
    });
}

#[test]
fn requests_and_responses_come_again_without_ros() {
    alone("ros2::rclpy::replay::requests_and_responses_come_again_without_ros", |domain| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-services.mcap");
        record_services(&path, domain);
        assert_repeated(&path, &plugins(), 100);
    });
}

#[test]
fn a_run_with_ros_is_made_again_bit_for_bit() {
    alone("ros2::rclpy::replay::a_run_with_ros_is_made_again_bit_for_bit", |domain| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2.mcap");
        record_topics(&path, domain);
        assert_repeated(&path, &plugins(), 250);
    });
}

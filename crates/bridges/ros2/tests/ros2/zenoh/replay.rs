//! A run with ROS over Zenoh, made again from its recording.

use std::path::Path;

use serde_json::json;
use slate_ros2::RosBridge;

use crate::ros2::rclpy::agent::{
    assert_repeated, configuration, database, exchange_requests, plugins, record,
};
use crate::ros2::zenoh::peer::{Node, Router};

const SET_BOOL: &str = "std_srvs/srv/SetBool";

#[test]
fn a_run_over_zenoh_is_made_again_bit_for_bit() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-zenoh.mcap");
    let router = Router::start();
    let table = router.table(3)
        + "read.\"driver/scan\" = \"/scan\"\nread.\"driver/command\" = \"/cmd_vel\"\nwrite.\"/wheels\" = \"driver/wheels\"";
    let database = database(&configuration("mirror", &table));
    record::<RosBridge>(&path, (&database, &plugins()), &[], |bridge, _| {
        let mut node = Node::start(&router, 3);
        node.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({}));
        node.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        let mut number = 0.0;
        while bridge.topics()[..2].iter().any(|topic| topic.count < 100) {
            number += 1.0;
            node.publish("/scan", &json!({ "ranges": [number, number / 3.0] }));
            node.publish("/cmd_vel", &json!({ "linear": { "x": number }, "angular": { "z": -number } }));
            assert!(number < 100_000.0, "{:?}", bridge.topics());
        }
    });
    assert_repeated(&path, &plugins(), 250);
}

#[test]
fn requests_and_responses_over_zenoh_come_again() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-zenoh-services.mcap");
    let router = Router::start();
    let text = format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.lamp]\n[modules.asker]\nparams.tells = false\n[ros2]\n\
         {}serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}\n\
         call.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", response = \"asker/reply\" }}",
        router.table(3)
    );
    record::<RosBridge>(&path, (&database(&text), &plugins()), &["asker/wish"], |_, composer| {
        let mut node = Node::start(&router, 3);
        let response = json!({ "success": true, "message": "yes" });
        node.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }));
        exchange_requests(composer, |on| {
            let request = json!({ "data": on });
            let called = json!({ "do": "call", "service": "/lamp", "type": SET_BOOL, "request": request });
            assert_eq!(node.request(called)["success"], json!(true));
        });
    });
    assert_repeated(&path, &plugins(), 100);
}

//! A run with ROS 1, made again from its recording.

use std::path::Path;

use serde_json::json;
use slate_ros1::Ros1Bridge;

use crate::ros1::agent::{assert_repeated, database, exchange_requests, linked, plugins, record};
use crate::ros1::peer::Master;

const SET_BOOL: &str = "std_srvs/SetBool";

/// Records a run in lockstep in which a node publishes as fast as it can.
fn record_topics(path: &Path) {
    let master = Master::start();
    let links =
        "\"base/scan\" = \"ros1:/scan\"\n\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/sum\" = \"base/sum\"";
    let database = database(&linked(&master.address(), links));
    record::<Ros1Bridge>(path, (&database, &plugins()), &[], |bridge, _| {
        let mut peer = master.peer("driver");
        peer.advertise("/scan", "sensor_msgs/LaserScan");
        peer.advertise("/cmd_vel", "geometry_msgs/Twist");
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
fn record_services(path: &Path) {
    let master = Master::start();
    let text = format!(
        "[modules.lamp]\n[modules.asker]\nparams.tells = false\n[ros1]\nmaster = \"{}\"\n\
         serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}\n\
         call.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", response = \"asker/reply\" }}",
        master.address()
    );
    record::<Ros1Bridge>(path, (&database(&text), &plugins()), &["asker/wish"], |_, composer| {
        let mut peer = master.peer("person");
        let response = json!({ "success": true, "message": "yes" });
        peer.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }));
        exchange_requests(composer, |on| {
            let request = json!({ "data": on });
            let called = json!({ "do": "call", "service": "/lamp", "type": SET_BOOL, "request": request });
            assert_eq!(peer.request(called)["success"], json!(true));
        });
    });
}

#[test]
fn services_of_ros_1_come_again_without_it() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-services.mcap");
    record_services(&path);
    assert_repeated(&path, &plugins(), 100);
}

#[test]
fn a_run_with_ros_1_is_made_again_bit_for_bit() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1.mcap");
    record_topics(&path);
    assert_repeated(&path, &plugins(), 200);
}

//! A run with ROS, made again from its recording.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde_json::json;
use slate_record::Recorder;
use slate_record::replay::{Comparison, Verdict};
use slate_ros2::{RosBridge, RosSettings};
use slate_runtime::configuration::Record;
use slate_runtime::{Agent, Control, Options, Rate, RecordedTimes};

use crate::ros2::rclpy::agent::{alone, database, plugins};
use crate::ros2::rclpy::peer::Peer;

fn times() -> Box<RecordedTimes> {
    Box::new(RecordedTimes::new((0..20_000_u64).map(|cycle| cycle * 10_000_000).collect()))
}

/// Records a run in lockstep in which a node publishes as fast as it can, and returns what was heard of it.
#[allow(clippy::disallowed_methods, reason = "the node goes by the machine's clock")]
fn recorded(path: &Path, domain: u16) -> u64 {
    let table = format!(
        "domain = {domain}\nread.\"driver/scan\" = \"/scan\"\nread.\"driver/command\" = \"/cmd_vel\"\n\
         write.\"/wheels\" = \"driver/wheels\""
    );
    let database = database("mirror", &table);
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options {
        time_source: Some(times()),
        rate: Rate::REALTIME,
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let settings = RosSettings::of(&database.current()).unwrap().unwrap();
    let mut bridge = RosBridge::open(&agent.composer(), &settings).unwrap();
    recorder.begin(&agent, path);
    bridge.start().unwrap();
    let mut peer = Peer::start("driver", domain);
    peer.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({}));
    peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
    let heard = std::thread::scope(|scope| {
        let stopper = agent.stopper();
        let (bridge, peer) = (&bridge, &mut peer);
        let node = scope.spawn(move || {
            let mut number = 0.0;
            while bridge.topics()[..2].iter().any(|topic| topic.count < 100) {
                number += 1.0;
                peer.publish("/scan", &json!({ "ranges": [number, number / 3.0] }));
                peer.publish("/cmd_vel", &json!({ "linear": { "x": number }, "angular": { "z": -number } }));
                assert!(number < 100_000.0, "{:?}", bridge.topics());
            }
            stopper.stop();
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        node.join().unwrap();
        bridge.topics()[..2].iter().map(|topic| topic.count).min().unwrap()
    });
    std::thread::sleep(Duration::from_millis(50));
    drop(bridge);
    recorder.end(&mut agent).unwrap();
    heard
}

#[test]
fn a_run_with_ros_is_made_again_bit_for_bit() {
    alone("ros2::rclpy::replay::a_run_with_ros_is_made_again_bit_for_bit", |domain| {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("ros2.mcap");
        assert!(recorded(&path, domain) >= 100);
        // Without ROS.
        let comparison = Comparison::open(&path).unwrap();
        let database = comparison.run().configuration(Vec::new()).unwrap();
        let options = Options {
            time_source: Some(times()),
            recording: Some(comparison.recording()),
            ..Options::default()
        };
        let agent = Agent::load_with(&database, &plugins(), options).unwrap();
        let verdict = comparison.compare(agent).unwrap();
        assert!(matches!(verdict, Verdict::Identical { values: 250.., whole: true, .. }), "{verdict:?}");
    });
}

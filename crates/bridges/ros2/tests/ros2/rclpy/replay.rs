//! A run with ROS, made again from its recording.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde_json::json;
use slate_control::ControlSurface;
use slate_record::Recorder;
use slate_record::replay::{Comparison, Verdict};
use slate_ros2::{RosBridge, RosSettings};
use slate_runtime::configuration::Record;
use slate_runtime::{Agent, Control, ExternalContent, ExternalValue, Options, Rate, RecordedTimes};

use crate::ros2::rclpy::agent::{alone, database, database_of, eventually, plugins};
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
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = RosBridge::open(&surface, &settings).unwrap();
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

/// Records a run in lockstep whose modules are asked by a node, and ask one.
fn with_services(path: &Path, domain: u16) {
    let text = format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.lamp]\n[modules.asker]\nparams.tells = false\n[ros2]\n\
         domain = {domain}\n\
         serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"std_srvs/srv/SetBool\" }}\n\
         call.\"/enable\" = {{ from = \"asker/requests\", type = \"std_srvs/srv/SetBool\", response = \"asker/reply\" }}"
    );
    let database = database_of(&text);
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options {
        time_source: Some(times()),
        rate: Rate::REALTIME,
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let settings = RosSettings::of(&database.current()).unwrap().unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = RosBridge::open(&surface, &settings).unwrap();
    agent.composer().external_input("asker/wish").unwrap().0.set_external("ros2:/wish");
    recorder.begin(&agent, path);
    bridge.start().unwrap();
    let mut peer = Peer::start("person", domain);
    let response = json!({ "success": true, "message": "yes" });
    peer.request(
        json!({ "do": "serve", "service": "/enable", "type": "std_srvs/srv/SetBool", "response": response }),
    );
    std::thread::scope(|scope| {
        let peer = &mut peer;
        let (stopper, composer) = (agent.stopper(), agent.composer());
        scope.spawn(move || {
            let replies =
                || composer.board().read("asker/replies/value").unwrap().and_then(|(own, _)| own.as_f64());
            for number in 1..=30 {
                let called = json!({
                    "do": "call", "service": "/lamp", "type": "std_srvs/srv/SetBool", "request": { "data": number % 3 == 0 },
                });
                assert_eq!(peer.request(called)["success"], json!(true));
                let wish =
                    ExternalValue {
                        input: "asker/wish".into(),
                        content: ExternalContent::Bytes(vec![u8::from(number % 2 == 0)]),
                    };
                assert!(composer.set_external(vec![wish])[0].is_ok());
                eventually("an answer", || replies() == Some(f64::from(number)));
            }
            let asked = peer.request(json!({ "do": "asked", "service": "/enable" }));
            assert_eq!(asked.as_array().map(Vec::len), Some(30));
            stopper.stop();
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
    });
    drop(bridge);
    recorder.end(&mut agent).unwrap();
}

#[test]
fn requests_and_responses_come_again_without_ros() {
    alone("ros2::rclpy::replay::requests_and_responses_come_again_without_ros", |domain| {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("ros2-services.mcap");
        with_services(&path, domain);
        let comparison = Comparison::open(&path).unwrap();
        let database = comparison.run().configuration(Vec::new()).unwrap();
        let options = Options {
            time_source: Some(times()),
            recording: Some(comparison.recording()),
            ..Options::default()
        };
        let agent = Agent::load_with(&database, &plugins(), options).unwrap();
        let verdict = comparison.compare(agent).unwrap();
        assert!(matches!(verdict, Verdict::Identical { values: 100.., whole: true, .. }), "{verdict:?}");
    });
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

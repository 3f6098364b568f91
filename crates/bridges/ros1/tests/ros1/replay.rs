//! A run with ROS 1, made again from its recording.
#![allow(clippy::disallowed_methods, reason = "the node goes by the machine's clock")]

use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use slate_control::ControlSurface;
use slate_record::Recorder;
use slate_record::replay::{Comparison, Verdict};
use slate_ros1::{Ros1Bridge, Ros1Settings};
use slate_runtime::configuration::Record;
use slate_runtime::{Agent, Control, Options, Rate, RecordedTimes};

use crate::ros1::agent::{database, linked, plugins};
use crate::ros1::peer::Master;

fn times() -> Box<RecordedTimes> {
    Box::new(RecordedTimes::new((0..20_000_u64).map(|cycle| cycle * 10_000_000).collect()))
}

/// Records a run in lockstep in which a node publishes as fast as it can.
fn record(path: &Path) {
    let master = Master::start();
    let links =
        "\"base/scan\" = \"ros1:/scan\"\n\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/sum\" = \"base/sum\"";
    let database = database(&linked(&master.address(), links));
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options {
        time_source: Some(times()),
        rate: Rate::REALTIME,
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let settings = Ros1Settings::of(&database.current()).unwrap().unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = Ros1Bridge::open(&surface, &settings).unwrap();
    recorder.begin(&agent, path);
    bridge.start().unwrap();
    let mut peer = master.peer("driver");
    peer.advertise("/scan", "sensor_msgs/LaserScan");
    peer.advertise("/cmd_vel", "geometry_msgs/Twist");
    std::thread::scope(|scope| {
        let stopper = agent.stopper();
        let (bridge, peer) = (&bridge, &mut peer);
        scope.spawn(move || {
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
    });
    drop(bridge);
    recorder.end(&mut agent).unwrap();
}

#[test]
fn a_run_with_ros_is_made_again_bit_for_bit() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1.mcap");
    record(&path);
    // Without ROS.
    let comparison = Comparison::open(&path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options =
        Options { time_source: Some(times()), recording: Some(comparison.recording()), ..Options::default() };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let verdict = comparison.compare(agent).unwrap();
    assert!(matches!(verdict, Verdict::Identical { values: 200.., whole: true, .. }), "{verdict:?}");
}

//! A run with ROS 1, made again from its recording.
#![allow(clippy::disallowed_methods, reason = "the node goes by the machine's clock")]

use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use slate_control::ControlSurface;
use slate_record::Recorder;
use slate_record::replay::{Comparison, Verdict};
use slate_ros1::{Ros1Bridge, Ros1Settings};
use slate_runtime::configuration::{Database, Record};
use slate_runtime::{Agent, Control, ExternalContent, ExternalValue, Options, Rate, RecordedTimes};

use crate::ros1::agent::{database, eventually, linked, plugins};
use crate::ros1::peer::Master;

fn times() -> Box<RecordedTimes> {
    Box::new(RecordedTimes::new((0..20_000_u64).map(|cycle| cycle * 10_000_000).collect()))
}

/// An agent in lockstep, in real time, and what records it.
fn recorded(text: &str) -> (Agent, Recorder, Database) {
    let database = database(text);
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options {
        time_source: Some(times()),
        rate: Rate::REALTIME,
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    (Agent::load_with(&database, &plugins(), options).unwrap(), recorder, database)
}

/// Records a run in lockstep in which a node publishes as fast as it can.
fn record(path: &Path) {
    let master = Master::start();
    let links =
        "\"base/scan\" = \"ros1:/scan\"\n\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/sum\" = \"base/sum\"";
    let (mut agent, recorder, database) = recorded(&linked(&master.address(), links));
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

/// Records a run in lockstep in which a node calls an inbox, and an outbox calls a node.
fn record_services(path: &Path) {
    let master = Master::start();
    let text = format!(
        "[modules.lamp]\n[modules.asker]\nparams.tells = false\n[ros1]\nmaster = \"{}\"\n\
         serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"std_srvs/SetBool\" }}\n\
         call.\"/enable\" = {{ from = \"asker/requests\", type = \"std_srvs/SetBool\", response = \"asker/reply\" }}",
        master.address()
    );
    let (mut agent, recorder, database) = recorded(&text);
    let settings = Ros1Settings::of(&database.current()).unwrap().unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = Ros1Bridge::open(&surface, &settings).unwrap();
    agent.composer().external_input("asker/wish").unwrap().0.set_external("ros1:/wish");
    recorder.begin(&agent, path);
    bridge.start().unwrap();
    let mut peer = master.peer("person");
    let response = json!({ "success": true, "message": "yes" });
    peer.request(
        json!({ "do": "serve", "service": "/enable", "type": "std_srvs/SetBool", "response": response }),
    );
    std::thread::scope(|scope| {
        let peer = &mut peer;
        let (stopper, composer) = (agent.stopper(), agent.composer());
        scope.spawn(move || {
            let replies =
                || composer.board().read("asker/replies/value").unwrap().and_then(|(own, _)| own.as_f64());
            for number in 1..=30 {
                let request = json!({ "data": number % 3 == 0 });
                let called =
                    json!({ "do": "call", "service": "/lamp", "type": "std_srvs/SetBool", "request": request });
                assert_eq!(peer.request(called)["success"], json!(true));
                let content = ExternalContent::Bytes(vec![u8::from(number % 2 == 0)]);
                let wish = ExternalValue { input: "asker/wish".into(), content };
                assert!(composer.set_external(vec![wish])[0].is_ok());
                eventually("an answer", || replies() == Some(f64::from(number)));
            }
            stopper.stop();
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
    });
    drop(bridge);
    recorder.end(&mut agent).unwrap();
}

/// Runs a recording again, without ROS.
fn run_again(path: &Path) -> Verdict {
    let comparison = Comparison::open(path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options =
        Options { time_source: Some(times()), recording: Some(comparison.recording()), ..Options::default() };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    comparison.compare(agent).unwrap()
}

#[test]
fn services_of_ros_1_come_again_without_it() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-services.mcap");
    record_services(&path);
    let verdict = run_again(&path);
    assert!(matches!(verdict, Verdict::Identical { values: 100.., whole: true, .. }), "{verdict:?}");
}

#[test]
fn a_run_with_ros_1_is_made_again_bit_for_bit() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1.mcap");
    record(&path);
    let verdict = run_again(&path);
    assert!(matches!(verdict, Verdict::Identical { values: 200.., whole: true, .. }), "{verdict:?}");
}

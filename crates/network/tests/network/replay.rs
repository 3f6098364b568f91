//! A run with Zenoh, made again from its recording.
#![allow(clippy::disallowed_methods, reason = "the other program goes by the machine's clock")]

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use slate_control::ControlSurface;
use slate_network::{AgentNetwork, NetworkSettings};
use slate_record::Recorder;
use slate_replay::{Comparison, Verdict};
use slate_runtime::configuration::{Database, Options as Sources, Record};
use slate_runtime::{Agent, Control, Options, Rate, RecordedTimes};
use zenoh::Wait;

use crate::network::agent::modules::{configuration, plugins};
use crate::network::agent::{ports, session};

/// Values of each key.
const VALUES: u64 = 300;

fn times() -> Box<RecordedTimes> {
    Box::new(RecordedTimes::new((0..20_000_u64).map(|cycle| cycle * 10_000_000).collect()))
}

#[test]
fn a_run_with_zenoh_is_made_again_bit_for_bit() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("network.mcap");
    let [port] = ports();
    let links = "\"driver/ambient\" = \"zenoh:demo/ambient\"\n\"driver/goal/x\" = \"zenoh:demo/x\"\n\
                 \"driver/speeds\" = { from = \"zenoh:demo/speeds\", values = \"all\" }";
    let text = configuration(
        "mirror",
        links,
        &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/notes\" = \"zenoh:demo/notes\""),
    );
    let sources = Sources { extra_tables: vec![slate_network::TABLE.into()], ..Sources::default() };
    let database = Database::from_text("test.toml", &text, sources).unwrap();
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let options = Options {
        time_source: Some(times()),
        rate: Rate::REALTIME,
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let settings = NetworkSettings::of(&database.current()).unwrap().unwrap();
    let network = AgentNetwork::start(&surface, &settings).unwrap();
    recorder.begin(&agent, &path);
    std::thread::scope(|scope| {
        let (stopper, network) = (agent.stopper(), &network);
        let program = scope.spawn(move || {
            let other = session("peer", &[], &[port]);
            let keys = ["demo/ambient", "demo/x", "demo/speeds", "demo/notes"]
                .map(|key| other.declare_publisher(key).wait().unwrap());
            let mut number = 0.0;
            while network.readings().iter().any(|reading| reading.received < VALUES) {
                number += 1.0;
                for key in &keys {
                    key.put((number / 3.0).to_string()).wait().unwrap();
                }
                std::thread::sleep(Duration::from_micros(500));
                assert!(number < 100_000.0, "{:?}", network.readings());
            }
            stopper.stop();
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        program.join().unwrap();
    });
    std::thread::sleep(Duration::from_millis(50));
    let received = network.readings().iter().map(|reading| reading.received).sum::<u64>();
    drop(network);
    recorder.end(&mut agent).unwrap();
    assert!(received >= 4 * VALUES);
    // Without a network.
    let comparison = Comparison::open(&path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options =
        Options { time_source: Some(times()), recording: Some(comparison.recording()), ..Options::default() };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let verdict = comparison.compare(agent).unwrap();
    assert!(matches!(verdict, Verdict::Identical { values: 1200.., whole: true, .. }), "{verdict:?}");
}

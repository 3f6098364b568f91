//! Playback of a recording, controlled by a client.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::{Value as Json, json};
use slate_bag::{Channel, Compression, Header, Schema, Writer};
use slate_console::{Console, Settings};
use slate_record::Recorder;
use slate_replay::{Plan, Player};
use slate_runtime::configuration::{Database, Options as Sources};
use slate_runtime::{Agent, Options, RecordedTimes};

use crate::client::Client;
use crate::modules::{CONFIGURATION, plugins};

const MS: u64 = 1_000_000;

/// A recording of 50 cycles, 10 ms each.
fn recorded() -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("console-playback.mcap");
    let text = format!("{CONFIGURATION}\n[record]\nenabled = true\nexclude = [\"/**/image\"]");
    let database = Database::from_text("test.toml", &text, Sources::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new((0..50).map(|cycle| cycle * 10 * MS).collect()))),
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.begin(&agent, &file);
    (0..50).for_each(|_| assert!(agent.step()));
    recorder.end(&mut agent).unwrap();
    file
}

/// Ends a playback, also after a failed assertion.
struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn a_playback_is_paused_stepped_sought_and_looped_on_request() {
    let plan = Plan { is_paused: true, ..Plan::default() };
    let mut player = Player::open(&recorded(), &plugins(), plan).unwrap();
    let database = player.configuration().unwrap();
    let options = Options { rate: player.rate(), playback: Some(player.playback()), ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    agent.composer().control_playback(player.control());
    let settings = Settings { port: Some(0), ..Settings::default() };
    let console = Console::start(&agent, &settings, Vec::new()).unwrap();
    let tokens: Json = serde_json::from_str(&std::fs::read_to_string(console.token_file()).unwrap()).unwrap();
    let name = agent.board().agent().to_owned();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _end = End(&stop);
            let client =
                |role: &str| Client::new(console.addresses()[0], tokens["tokens"][role].as_str().unwrap());
            let operator = client("operator");
            let get = |path: &str| client("viewer").send("GET", path, None).json();
            let order = |what: &str, body: Json| {
                operator.send(
                    "POST",
                    &format!("/playback/{what}"),
                    Some(&body).filter(|body| !body.is_null()),
                )
            };
            let status = get("/playback");
            assert_eq!((&status["is_paused"], &status["to"]), (&json!(true), &json!(490 * MS)));
            assert_eq!(order("step", json!({ "cycles": 3 })).json()["time"], 20 * MS);
            assert_eq!(order("step", json!(null)).json()["time"], 30 * MS);
            let count = || get(&format!("/slate/{name}/sensor/count/value?bare"));
            assert_eq!(count(), 4.0);
            assert_eq!(order("seek", json!({ "time": 205 * MS })).json()["time"], 205 * MS);
            assert_eq!(count(), 21.0);
            // What comes is known before it is played.
            let ahead = get(&format!("/history/{name}/sensor/count/value?from={}&to={}", 470 * MS, 480 * MS));
            let told: Vec<_> =
                ahead["values"].as_array().unwrap().iter().map(|own| own["value"].clone()).collect();
            assert_eq!(
                (told, &ahead["count"], &ahead["to"]),
                (vec![json!(48.0), json!(49.0)], &json!(2), &json!(490 * MS))
            );
            let then = get(&format!("/history/{name}/sensor/count?to={}&limit=1", 99 * MS));
            assert_eq!(
                then["values"],
                json!([{ "value": { "value": 10.0 }, "sequence": 10, "time": 90 * MS }])
            );
            assert_eq!(count(), 21.0, "looking changes nothing");
            let section = json!({ "from": 100 * MS, "to": 120 * MS });
            assert_eq!(order("loop", json!({ "section": section })).json()["section"], section);
            let before = order("resume", json!(null)).json()["values"].as_u64().unwrap();
            while get("/playback")["values"].as_u64().unwrap() < before + 100 {}
            assert_eq!(order("pause", json!(null)).json()["rate"], json!(null));
            assert_eq!(order("rate", json!({ "factor": 2.0 })).json()["rate"], 2.0);
            assert_eq!(order("loop", json!({ "section": null })).json()["section"], json!(null));
            // Invalid requests are refused, and so are viewers.
            assert!(order("seek", json!({ "time": 491 * MS })).problem(409).contains("0.490 s"));
            assert!(order("rate", json!({ "factor": -1.0 })).problem(409).contains("positive factor"));
            assert!(order("step", json!({ "cycles": 0 })).problem(422).contains("1000000"));
            assert!(order("seek", json!({ "time": "now" })).problem(422).contains("body"));
            let viewer = client("viewer").send("POST", "/playback/resume", None);
            assert!(viewer.problem(403).contains("viewer"));
        });
        player.run(&mut agent, &stop).unwrap();
    });
}

/// A foreign recording with a number of texts at three times.
fn at_three_times(count: u64) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("console-three-times.mcap");
    let header = Header { profile: "ros2".into(), library: "somebody".into() };
    let mut writer = Writer::new(Vec::new(), &path, &header, Compression::Lz4).unwrap();
    let (name, data) = ("other_msgs/msg/Page".into(), b"string letters\n".to_vec());
    writer.schema(&Schema { id: 1, name, encoding: "ros2msg".into(), data }).unwrap();
    let channel = Channel {
        id: 1,
        schema_id: 1,
        topic: "/page".into(),
        message_encoding: "cdr".into(),
        metadata: [].into(),
    };
    writer.channel(&channel).unwrap();
    // Behind what every value begins with, the length of the text.
    let text = [&[0, 1, 0, 0][..], &20_001_u32.to_le_bytes(), &[b'a'; 20_000], &[0]].concat();
    for number in 0..count {
        let time = [0, MS, 2 * MS][usize::from(number > 4) + usize::from(number + 4 > count)];
        writer.message(1, 0, time, time, &text).unwrap();
    }
    std::fs::write(&path, writer.finish().unwrap()).unwrap();
    path
}

#[test]
fn continuing_in_the_past_misses_no_value_of_one_time() {
    const COUNT: u64 = 1000;
    let plan = Plan { is_paused: true, ..Plan::default() };
    let mut player = Player::open(&at_three_times(COUNT), &plugins(), plan).unwrap();
    let database = player.configuration().unwrap();
    let options = Options { rate: player.rate(), playback: Some(player.playback()), ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    agent.composer().control_playback(player.control());
    let settings = Settings { port: Some(0), ..Settings::default() };
    let console = Console::start(&agent, &settings, Vec::new()).unwrap();
    let tokens: Json = serde_json::from_str(&std::fs::read_to_string(console.token_file()).unwrap()).unwrap();
    let viewer = Client::new(console.addresses()[0], tokens["tokens"]["viewer"].as_str().unwrap());
    let name = agent.board().agent().to_owned();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _end = End(&stop);
            let (mut told, mut from, mut amid) = (Vec::new(), "0".to_owned(), 0);
            loop {
                let path = format!("/history/{name}/page?from={from}&limit=10000");
                let part = viewer.send("GET", &path, None).json();
                let of = |own: &Json, name: &str| own[name].as_u64().unwrap();
                let values = part["values"].as_array().unwrap();
                told.extend(values.iter().map(|own| (of(own, "time"), of(own, "sequence"))));
                assert_eq!(told.len() as u64 + of(&part, "left_out"), COUNT);
                let Some(next) = part["next"].as_str() else { break };
                let last = told.last().unwrap();
                assert_eq!(next.split_once(':').unwrap().1.parse(), Ok(last.1 + 1));
                amid += u64::from(next.starts_with(&format!("{}:", last.0)));
                from = next.into();
            }
            assert!(told.iter().map(|(_, sequence)| *sequence).eq(1..=COUNT));
            assert!(amid > 0, "no answer ends between values of one time");
        });
        player.run(&mut agent, &stop).unwrap();
    });
}

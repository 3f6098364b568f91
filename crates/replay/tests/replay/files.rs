use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use slate_bag::{Channel, Compression, Reader, Schema, Writer};
use slate_replay::{Choice, Plan, PlayError, Player};

use crate::replay::support::{Foreign, file, foreign, load, plugins, record_on_the_wall_clock, recorded};

fn refused(path: &std::path::Path, plan: Plan) -> String {
    Player::open(path, &plugins(), plan).unwrap_err().to_string()
}

/// A text and a number, as CDR has them.
fn reading(text: &str, number: f64) -> Vec<u8> {
    let mut bytes = (text.len() as u32 + 1).to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes.push(0);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes.extend(number.to_le_bytes());
    bytes
}

fn scan<'a>(topic: &'a str, values: Vec<(u64, Vec<u8>)>) -> Foreign<'a> {
    Foreign {
        topic,
        kind: "other_msgs/msg/Reading",
        text: "string frame\nfloat64 range\n",
        encoding: "cdr",
        values,
    }
}

#[test]
fn foreign_file_is_played_by_its_own_description() {
    let start = 1_700_000_000_000_000_000;
    let values =
        (0..5).map(|n| (start + n * 100_000_000, reading(&"x".repeat(n as usize), n as f64))).collect();
    let path = foreign("foreign.mcap", &[scan("/scan", values)]);
    let choice = Choice { map: [("/scan".into(), "/r2/laser/scan".into())].into(), ..Choice::default() };
    let mut player = Player::open(&path, &plugins(), Plan { choice, ..Plan::default() }).unwrap();
    let mut agent = load(&player, None);
    let played = player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    assert_eq!((played.values, played.time), (5, 400_000_000));
    let (value, stamp) = agent.board().read("r2/laser/scan").unwrap().unwrap();
    assert_eq!(value.get("frame").unwrap().as_str(), Some("xxxx"));
    assert_eq!(value.get("range").unwrap().as_f64(), Some(4.0));
    assert_eq!((stamp.sequence, stamp.time), (5, 400_000_000));
    let plan = Plan { modules: ["back".into()].into(), ..Plan::default() };
    assert!(refused(&path, plan).contains("no configuration"));
}

#[test]
fn unplayable_values_are_skipped_and_reported() {
    let wide = Foreign {
        kind: "other_msgs/msg/Wide",
        text: "wstring text\n",
        ..scan("/wide", vec![(1, vec![0; 8])])
    };
    let json = Foreign { encoding: "json", ..scan("/json", vec![(1, b"{}".to_vec())]) };
    let odd = scan("/a b/c", vec![(1, reading("", 1.0))]);
    let path = foreign("odd.mcap", &[wide, json, odd, scan("/scan", vec![(1, reading("a", 1.0))])]);
    let player = Player::open(&path, &plugins(), Plan::default()).unwrap();
    let left_out: BTreeMap<_, _> = player.left_out().into_iter().collect();
    assert!(left_out["/wide"].contains("wstring"), "{left_out:?}");
    assert!(left_out["/json"].contains("`json`"), "{left_out:?}");
    assert!(left_out["/a b/c"].contains("--map"), "{left_out:?}");
    assert_eq!(left_out.len(), 3);
}

#[test]
fn a_value_that_is_none_of_its_type_is_named_with_its_topic() {
    let path = foreign("short.mcap", &[scan("/scan", vec![(1, reading("a", 1.0)), (2, vec![9, 0])])]);
    let error = refused(&path, Plan::default());
    assert!(error.contains("value 2 of /scan is no"), "{error}");
}

#[test]
fn backward_times_play_at_the_last_value_with_a_warning() {
    let values = [5, 9, 7, 12].map(|time| (time * 1_000_000, reading("a", time as f64))).to_vec();
    let path = foreign("backwards.mcap", &[scan("/scan", values)]);
    let mut player = Player::open(&path, &plugins(), Plan::default()).unwrap();
    assert_eq!(player.backwards(), [("/scan".to_owned(), 1)]);
    let mut agent = load(&player, None);
    player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    let (value, stamp) = agent.board().read("scan/range").unwrap().unwrap();
    assert_eq!((value.as_f64(), stamp.sequence), (Some(12.0), 4));
}

/// Several threads may write a property of an agent, each with the time of its own tick.
#[test]
fn backward_times_of_an_agents_recording_cause_no_warning() {
    let (own, other) = (file("threads.mcap"), file("threads-back.mcap"));
    record_on_the_wall_clock(&own);
    let mut reader = Reader::open(&own).unwrap();
    let mut writer = Writer::new(Vec::new(), &other, reader.header(), Compression::None).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        writer.schema(message.schema.unwrap()).unwrap();
        writer.channel(message.channel).unwrap();
        let is_late = message.channel.topic == "/source/number" && message.sequence % 7 == 0;
        let time = message.log_time - if is_late { 60_000_000 } else { 0 };
        writer.message(message.channel.id, message.sequence, time, time, message.data).unwrap();
    }
    reader.metadata().unwrap().iter().for_each(|metadata| writer.metadata(metadata).unwrap());
    for number in 0..reader.attachments() {
        writer.attachment(&reader.attachment(number).unwrap().unwrap()).unwrap();
    }
    std::fs::write(&other, writer.finish().unwrap()).unwrap();
    let player = Player::open(&other, &plugins(), Plan::default()).unwrap();
    assert_eq!(player.backwards(), []);
    assert!(player.extent().0 > 3);
}

#[test]
fn a_property_has_one_writer() {
    let one = || scan("/scan", vec![(1, reading("a", 1.0))]);
    let path = foreign("writers.mcap", &[one(), one()]);
    let error = refused(&path, Plan::default());
    assert!(error.contains("/scan has two writers") && error.contains("--exclude"), "{error}");
    let path = foreign("mapped.mcap", &[one(), scan("/other", vec![(1, reading("a", 1.0))])]);
    let choice = Choice { map: [("/other".into(), "/scan".into())].into(), ..Choice::default() };
    let error = refused(&path, Plan { choice, ..Plan::default() });
    assert!(error.contains("/scan and /other are both to be played at /scan"), "{error}");
}

#[test]
fn an_interface_of_another_version_is_played_as_it_was_recorded() {
    let (path, other) = (recorded("version.mcap"), file("version-other.mcap"));
    let mut reader = Reader::open(&path).unwrap();
    let mut writer = Writer::new(Vec::new(), &other, reader.header(), Compression::None).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        let mut channel = Channel::clone(message.channel);
        let mut schema = Schema::clone(message.schema.unwrap());
        if channel.topic == "/back/sum" {
            channel.metadata.insert("hash".into(), "0000000000000001".into());
            schema.data =
                String::from_utf8(schema.data).unwrap().replace("float64 value", "float64 amount").into();
            (schema.id, channel.schema_id) = (1000, 1000);
        }
        writer.schema(&schema).unwrap();
        writer.channel(&channel).unwrap();
        let (sequence, time) = (message.sequence, message.log_time);
        writer.message(channel.id, sequence, time, message.publish_time, message.data).unwrap();
    }
    let metadata = reader.metadata().unwrap();
    metadata.iter().for_each(|metadata| writer.metadata(metadata).unwrap());
    for number in 0..reader.attachments() {
        writer.attachment(&reader.attachment(number).unwrap().unwrap()).unwrap();
    }
    std::fs::write(&other, writer.finish().unwrap()).unwrap();
    let mut player = Player::open(&other, &plugins(), Plan::default()).unwrap();
    let remarks = player.remarks();
    assert_eq!(remarks.len(), 1);
    assert!(remarks[0].1.contains("Number is 0000000000000001") && remarks[0].1.contains("another version"));
    let mut agent = load(&player, None);
    player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    let (_, stamp) = agent.board().read("back/sum/amount").unwrap().unwrap();
    assert_eq!(stamp.sequence, 30);
    let plan = Plan { modules: ["back".into()].into(), ..Plan::default() };
    let outcome = crate::replay::support::play(&other, plan).1.unwrap();
    assert!(outcome.first.unwrap().recorded.contains("another version"));
}

#[test]
fn a_cut_file_is_damaged_and_an_empty_one_says_so() {
    let path = recorded("cut.mcap");
    let bytes = std::fs::read(&path).unwrap();
    let cut = file("cut-off.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let error = Player::open(&cut, &plugins(), Plan::default()).unwrap_err();
    assert!(matches!(error, PlayError::Bag(slate_bag::Error::Damaged { .. })), "{error}");
    let choice = Choice { select: vec!["/nothing".into()], ..Choice::default() };
    let error = refused(&path, Plan { choice, ..Plan::default() });
    assert!(error.contains("no topic `/nothing`"), "{error}");
    let error = refused(&path, Plan { start: Some(1_000_000_000), ..Plan::default() });
    assert!(error.contains("0.290 s"), "{error}");
    let empty = foreign("empty.mcap", &[]);
    assert!(refused(&empty, Plan::default()).contains("nothing to play"));
}

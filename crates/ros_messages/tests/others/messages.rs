//! Messages that other programs read from Slate, and Slate from them.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Command;

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use serde_json::{Value as Json, json};
use slate_interfaces::LaserScan;
use slate_module::blackboard::interface::Interface;
use slate_ros_messages::{
    Definition, Schema, Shown, Value, WireFormat, definition, definition_in, encode, encode_in, standard,
    standard_in, type_description,
};

use crate::interfaces::{all, value};
use crate::python::{python, run};

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/others").join(name)
}

/// A value as JSON, as the scripts print it.
fn tree(value: &Value) -> Json {
    let float = |number: f64| match number {
        number if number.is_nan() => json!("nan"),
        number if number.is_infinite() => json!(if number > 0.0 { "inf" } else { "-inf" }),
        number => json!(number),
    };
    match value {
        Value::Bool(value) => json!(value),
        Value::Signed(number) => json!(number),
        Value::Unsigned(number) => json!(number),
        Value::Single(number) => float((*number).into()),
        Value::Double(number) => float(*number),
        Value::Text(text) => json!(text),
        Value::Numbers(numbers) => numbers.iter().map(|number| tree(&number)).collect(),
        Value::List(items) => items.iter().map(tree).collect(),
        Value::Map(map) => Json::Object(map.iter().map(|(name, value)| (name.into(), tree(value))).collect()),
    }
}

/// A file as it grows, and what its channels hold.
struct File {
    writer: mcap::Writer<Cursor<Vec<u8>>>,
    expected: BTreeMap<String, Vec<Json>>,
}

impl File {
    fn add(&mut self, topic: String, definition: &Definition, messages: &[Vec<u8>]) {
        let schema = self.writer.add_schema(&definition.name, "ros2msg", definition.text.as_bytes()).unwrap();
        let channel = self.writer.add_channel(schema, &topic, "cdr", &BTreeMap::new()).unwrap();
        let reader = Schema::parse(&definition.name, &definition.text).unwrap();
        let mut values = Vec::new();
        for (i, message) in messages.iter().enumerate() {
            let time = i as u64;
            let header =
                MessageHeader { channel_id: channel, sequence: i as u32, log_time: time, publish_time: time };
            self.writer.write_to_known_channel(&header, message).unwrap();
            values.push(tree(&reader.decode(message).unwrap()));
        }
        self.expected.insert(topic, values);
    }
}

#[test]
fn two_libraries_of_others_read_all_interfaces_in_both_forms() {
    let options = WriteOptions::new().compression(None).profile("ros2");
    let mut file = File { writer: options.create(Cursor::default()).unwrap(), expected: BTreeMap::new() };
    for descriptor in all() {
        let zeros = vec![0; descriptor.size];
        let values = [value(descriptor, 0, 1), value(descriptor, 3, 2), value(descriptor, 2, 3), zeros];
        let messages = values.each_ref().map(|bytes| {
            let mut message = Vec::new();
            encode(descriptor, bytes, &mut message).unwrap();
            message
        });
        let whole = definition(descriptor);
        file.add(format!("/lossless/{}", descriptor.name), &whole, &messages);
        if let Some(shown) = Shown::of(&whole).unwrap() {
            let messages = messages.each_ref().map(|whole| {
                let mut message = Vec::new();
                shown.encode(whole, &mut message).unwrap();
                message
            });
            // To one of the libraries all messages of a name are the same.
            let Definition { name, text } = shown.definition();
            let (name, text) =
                (name.replace("slate_msgs/", "shown_msgs/"), text.replace("slate_msgs/", "shown_msgs/"));
            file.add(format!("/shown/{}", descriptor.name), &Definition { name, text }, &messages);
        }
        if let Some(standard) = standard(descriptor) {
            let messages = values.each_ref().map(|bytes| {
                let mut message = Vec::new();
                standard.encode(bytes, 1_500_000_000, "map", &mut message).unwrap();
                message
            });
            file.add(format!("/standard/{}", descriptor.name), standard.definition(), &messages);
        }
    }
    // What all readers, this crate's too, could get wrong together.
    let mut scan = Vec::new();
    for number in [-1.0_f64, 0.5, 0.25, 8.0] {
        scan.extend(number.to_ne_bytes());
    }
    scan.extend(1.5_f32.to_ne_bytes());
    scan.extend(f32::INFINITY.to_ne_bytes());
    let laser = standard(LaserScan::DESCRIPTOR).unwrap();
    let mut message = Vec::new();
    laser.encode(&scan, 1_500_000_000, "laser", &mut message).unwrap();
    file.add("/scan".into(), laser.definition(), &[message]);
    let read = json!({
        "header": { "stamp": { "sec": 1, "nanosec": 500_000_000 }, "frame_id": "laser" },
        "angle_min": -1.0, "angle_max": -0.5, "angle_increment": 0.5, "time_increment": 0.0, "scan_time": 0.0,
        "range_min": 0.25, "range_max": 8.0, "ranges": [1.5, "inf"], "intensities": [],
    });
    assert_eq!(file.expected["/scan"], [read]);

    file.writer.finish().unwrap();
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros.mcap");
    std::fs::write(&path, file.writer.into_inner().into_inner()).unwrap();
    let output = run(Command::new(python()).arg(script("read.py")).arg(&path), "others can't read the file");
    let mut found: BTreeMap<(String, String), Vec<Json>> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let mut line: Json = serde_json::from_str(line).unwrap();
        let key = |name: &str| line[name].as_str().unwrap().to_owned();
        found.entry((key("reader"), key("topic"))).or_default().push(line["value"].take());
    }
    for reader in ["mcap", "rosbags"] {
        for (topic, expected) in &file.expected {
            assert_eq!(found.get(&(reader.into(), topic.clone())), Some(expected), "{reader} {topic}");
        }
    }
}

#[test]
fn another_library_reads_messages_and_types_of_ros_1() {
    let mut lines = String::new();
    let mut expected = Vec::new();
    for descriptor in all() {
        let values = [value(descriptor, 0, 1), value(descriptor, 3, 2)];
        let mut add = |definition: &Definition, messages: &[Vec<u8>], is_of_ros: bool| {
            let reader = Schema::parse(&definition.name, &definition.text).unwrap();
            let Definition { name, text } = definition;
            lines.push_str(&format!("{}\n", json!({ "name": name, "text": text, "messages": messages })));
            let own =
                messages.iter().map(|message| tree(&reader.decode_in(WireFormat::Ros1, message).unwrap()));
            expected.push((name.clone(), own.collect::<Vec<_>>(), is_of_ros));
        };
        let messages = values.each_ref().map(|bytes| {
            let mut message = Vec::new();
            encode_in(WireFormat::Ros1, descriptor, bytes, &mut message).unwrap();
            message
        });
        add(&definition_in(WireFormat::Ros1, descriptor), &messages, false);
        if let Some(standard) = standard_in(WireFormat::Ros1, descriptor) {
            let messages = values.each_ref().map(|bytes| {
                let mut message = Vec::new();
                standard.encode(bytes, 1_500_000_000, "map", &mut message).unwrap();
                message
            });
            add(standard.definition(), &messages, true);
        }
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1.jsonl");
    std::fs::write(&path, lines).unwrap();
    let mut command = Command::new(python());
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(script("ros1.py"));
    command.stdin(std::fs::File::open(&path).unwrap());
    let output = run(&mut command, "others can't read messages of ROS 1");
    let found = String::from_utf8(output.stdout).unwrap();
    assert_eq!(found.lines().count(), expected.len());
    for (line, (name, values, is_of_ros)) in found.lines().zip(expected) {
        let line: Json = serde_json::from_str(line).unwrap();
        assert_eq!(line["values"], json!(values), "{name}");
        if is_of_ros {
            assert_eq!(line["checksum"], line["ros"], "{name}");
        }
    }
}

#[test]
fn hashes_of_all_types_are_those_that_others_compute() {
    let all = all();
    let standards = all.iter().filter_map(|own| standard(own)).map(|own| own.definition().clone());
    let definitions: Vec<_> = all.iter().map(|own| definition(own)).chain(standards).collect();
    let line = |own: &Definition| {
        let description = type_description(own).unwrap();
        json!({ "name": own.name, "text": own.text, "description": description }).to_string()
    };
    let lines: Vec<_> = definitions.iter().map(line).collect();
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hashes.jsonl");
    std::fs::write(&path, lines.join("\n")).unwrap();
    let mut command = Command::new(python());
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(script("hashes.py"));
    command.stdin(std::fs::File::open(&path).unwrap());
    let output = run(&mut command, "rosbags can't read definitions");
    let found = String::from_utf8(output.stdout).unwrap();
    assert_eq!(found.lines().count(), definitions.len());
    for line in found.lines() {
        let line: Json = serde_json::from_str(line).unwrap();
        assert_eq!(line[1], line[2], "{}", line[0]);
    }
}

#[test]
fn messages_of_all_types_of_ros_are_read_as_others_wrote_them() {
    let mut command = Command::new(python());
    // It would write beside the script.
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(script("write.py"));
    let output = run(&mut command, "others can't write messages");
    let own: BTreeMap<String, Definition> = all()
        .into_iter()
        .filter_map(standard)
        .map(|standard| (standard.definition().name.clone(), standard.definition().clone()))
        .collect();
    let (mut read, mut same) = (0, 0);
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let line: Json = serde_json::from_str(line).unwrap();
        let (name, text) = (line["name"].as_str().unwrap(), line["text"].as_str().unwrap());
        let theirs = Schema::parse(name, text).unwrap();
        let ours = own.get(name).map(|definition| Schema::parse(name, &definition.text).unwrap());
        for message in line["messages"].as_array().unwrap() {
            let message: Vec<u8> = serde_json::from_value(message.clone()).unwrap();
            assert_eq!(tree(&theirs.decode(&message).unwrap()), line["value"], "{name}");
            // The definitions that come with this crate are those of ROS.
            if let Some(ours) = &ours {
                assert_eq!(tree(&ours.decode(&message).unwrap()), line["value"], "{name}");
                same += 1;
            }
        }
        read += 1;
    }
    assert!(read > 150, "{read}");
    assert_eq!(same, 2 * own.len());
}

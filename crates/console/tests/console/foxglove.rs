//! The client library of Foxglove, which is not ours.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value as Json, json};
use slate_bag as bag;
use slate_test_tools::{node_packages, run};

use crate::agent::Running;
use crate::modules::CONFIGURATION;

/// The client, and what reads files, and messages by their schemas.
const PACKAGES: [&str; 5] = [
    "@foxglove/ws-protocol@0.8.0",
    "@mcap/core@2.2.2",
    "@foxglove/rosmsg@5.0.5",
    "@foxglove/rosmsg2-serialization@3.1.0",
    "ws@8.18.0",
];

/// A folder that has the packages.
fn packages() -> PathBuf {
    node_packages(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("foxglove-node"), &PACKAGES)
}

#[test]
fn the_foxglove_client_reads_sets_calls_and_drives() {
    let packages = packages();
    for (name, protocol) in [("foxglove-one", "foxglove.websocket.v1"), ("foxglove-two", "foxglove.sdk.v1")] {
        let agent = Running::start(name);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/console/foxglove.cjs");
        let output = run(
            Command::new("node")
                .arg(script)
                .args([
                    &agent.address().to_string(),
                    protocol,
                    &agent.token("operator"),
                    &agent.token("developer"),
                ])
                .env("NODE_PATH", packages.join("node_modules")),
            "the client is not content",
        );
        let seen: Json = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(seen["protocol"], protocol);
        assert_eq!(seen["name"], format!("slate://{}", agent.name()));
        assert_eq!(seen["rising"], true);
        let image =
            json!({ "schema": "sensor_msgs/msg/Image", "width": 64, "encoding": "rgb8", "bytes": 12288 });
        assert_eq!(seen["image"], image);
        let way = json!({ "schema": "nav_msgs/msg/Path", "points": [[0, 0, 1], [3, 4, 1]] });
        assert_eq!(seen["way"], way);
        assert_eq!(
            (&seen["place"], &seen["schema"]),
            (&json!({ "x": 1.5, "y": "NaN" }), &json!("slate_msgs/msg/Speed"))
        );
        let parameters = seen["parameters"].as_array().unwrap();
        assert!(parameters.contains(&json!(["/sensor/params/step", 1])), "{parameters:?}");
        assert_eq!(seen["told"], "/sensor/params/step");
        assert_eq!((&seen["publishers"], &seen["subscribers"]), (&json!(["sensor"]), &json!(["driver"])));
        assert_eq!(seen["stopped"], json!([7, "{\"done\":\"stop\"}"]));
        assert_eq!(seen["refused"], 8);
        assert_eq!(agent.number("driver/heard/value"), 8.0);
        assert_eq!(agent.number("wheel/command/value"), 0.0);
        assert_eq!(agent.get("/agent").json()["stopped"], "by Foxglove");
    }
}

#[test]
fn the_foxglove_reader_reads_recordings_by_index_and_schema() {
    let packages = packages();
    let agent = Running::start("foxglove-file");
    let operator = agent.client("operator");
    operator.send("POST", "/recordings/read", None).json();
    (0..3).for_each(|note| {
        drop(operator.send("POST", &agent.at("driver/notes"), Some(&json!({ "value": note }))).json());
    });
    let file = operator.send("POST", "/recordings/read/stop", None).json();
    let file = file["file"].as_str().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/console/foxglove-file.cjs");
    let output = run(
        Command::new("node").arg(script).arg(file).env("NODE_PATH", packages.join("node_modules")),
        "the reader is not content",
    );
    let read: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(read["isOrdered"], true);
    assert_eq!(read["attachments"], json!(["configuration.toml"]));
    let mut reader = bag::Reader::open(file).unwrap();
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    while let Some(message) = reader.next_message().unwrap() {
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
    }
    let topics = read["topics"].as_object().unwrap();
    let theirs = topics.iter().map(|(topic, own)| (topic.clone(), own["count"].as_u64().unwrap()));
    assert_eq!(theirs.collect::<BTreeMap<_, _>>(), counts);
    assert_eq!(topics["/sensor/place"]["schema"], "slate_msgs/msg/Place");
    assert_eq!(topics["/sensor/place"]["value"]["x"], 1.5);
    assert_eq!(topics["/sensor/image"]["value"]["width"], 64);
    // What a module took out of its mailbox is there as it was sent.
    assert_eq!(
        topics["/driver/notes"],
        json!({ "schema": topics["/sensor/count"]["schema"], "count": 3, "value": { "value": 2 } })
    );
}

/// Frames that a client receives, with these modules.
fn frames(name: &str, modules: &str, topics: &[&str]) -> Json {
    let agent = Running::start_with(name, &format!("{CONFIGURATION}\n[console]\nport = 0\n{modules}"));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/console/foxglove-frames.cjs");
    let output = run(
        Command::new("node")
            .arg(script)
            .args([&agent.address().to_string(), &agent.token("operator")])
            .args(topics)
            .env("NODE_PATH", packages().join("node_modules")),
        "the client is not content",
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The received frames, each with its only parent.
fn parents(seen: &Json) -> BTreeMap<&str, &str> {
    let all = ["/tf", "/tf_static"].into_iter().flat_map(|topic| seen[topic].as_array().unwrap());
    let mut parents = BTreeMap::new();
    for own in all {
        let (child, parent) = (own["child"].as_str().unwrap(), own["parent"].as_str().unwrap());
        let before = parents.insert(child, parent);
        assert!(before.is_none_or(|before| before == parent), "{child} is in {parent} and {before:?}");
    }
    parents
}

#[test]
fn each_of_several_robots_has_its_own_frames_in_one_tree() {
    let modules = "[modules.r1]\nkind = \"rover\"\nparams.begin = 7.0\n[modules.r2]\nkind = \"rover\"\nparams.measures = 0.0\n";
    let topics = ["/r1/echo", "/r2/echo", "/r1/odometry", "/sensor/image", "/sensor/way"];
    let seen = frames("foxglove-robots", modules, &topics);
    let wanted = json!({
        "/r1/echo": ["r1/base_link", ""],
        "/r2/echo": ["r2/base_link", ""],
        "/r1/odometry": ["r1/odom", "r1/base_link"],
        "/sensor/image": ["map", ""],
        "/sensor/way": ["map", ""],
    });
    assert_eq!(seen["frames"], wanted);
    let wanted = [
        ("r1/base_link", "r1/odom"),
        ("r1/odom", "map"),
        ("r2/base_link", "map"),
        ("r1/camera", "r1/base_link"),
        ("r2/camera", "r2/base_link"),
    ];
    assert_eq!(parents(&seen), wanted.into());
    for own in seen["/tf"].as_array().unwrap() {
        assert!(own["told"].as_f64() >= own["time"].as_f64(), "{own}");
        // Its odometry began where the robot did.
        if own["child"] == "r1/odom" {
            assert_eq!((&own["x"], &own["y"]), (&json!(7), &json!(2)), "{own}");
        }
    }
}

#[test]
fn one_robot_has_the_frames_that_all_tools_know() {
    let topics = ["/r1/echo", "/r1/odometry", "/sensor/image"];
    let seen = frames("foxglove-robot", "[modules.r1]\nkind = \"rover\"\n", &topics);
    let wanted = json!({
        "/r1/echo": ["base_link", ""],
        "/r1/odometry": ["odom", "base_link"],
        "/sensor/image": ["base_link", ""],
    });
    assert_eq!(seen["frames"], wanted);
    assert_eq!(parents(&seen), [("base_link", "odom"), ("odom", "map"), ("camera", "base_link")].into());
}

//! Recordings as ROS 2 has the messages, read by libraries of others.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value as Json, json};
use slate_record::bag::{Reader, Selection};
use slate_record::logs::{RosExport, export_ros, import};

use crate::files::{STRICT, folder, write};
use crate::python::{python, run};

const LOG: &str = "\
PARAM robot_name sam nohost 0
ODOM 1.5 -2.25 0.5 0.4 -0.1 0 10.5 host 0.1
FLASER 3 1.5 2.5 81.91 1.5 -2.25 0.5 1.5 -2.25 0.5 10.75 host 0.2
TRUEPOS 3 4 1.5707963267948966 1.5 -2.25 0.5 11.5 host 0.3
";

/// The types of the topics.
fn types(path: &Path) -> BTreeMap<String, String> {
    let mut reader = Reader::open(path).unwrap();
    while reader.next_message().unwrap().is_some() {}
    let named = |topic: &str| {
        let channel = reader.channels().find(|channel| channel.topic == topic).unwrap();
        reader.schema(channel).unwrap().name.clone()
    };
    let topics: Vec<_> = reader.channels().map(|channel| channel.topic.clone()).collect();
    topics.into_iter().map(|topic| (topic.clone(), named(&topic))).collect()
}

#[test]
fn others_read_the_messages_of_ros_and_the_transforms() {
    let folder = folder("ros");
    let own = folder.join("own.mcap");
    import(&write(&folder, "a.log", LOG), &own, &STRICT).unwrap();
    let before = types(&own);
    let pose = before
        .iter()
        .find(|(topic, name)| topic.ends_with("true_pose") && name.ends_with("/Pose2"))
        .unwrap()
        .0
        .clone();
    let out = folder.join("ros.mcap");
    let export = RosExport { pose: Some(&pose), ..RosExport::default() };
    let log = export_ros(&own, &Selection::default(), &export, &out).unwrap();
    assert_eq!((log.transforms, log.left_out.len(), log.unread.len()), (1, 0, 0));

    let after = types(&out);
    assert_eq!(after["/tf"], "tf2_msgs/msg/TFMessage");
    let named = |name: &str| after.iter().find(|(_, own)| *own == name).unwrap().0.clone();
    let (odometry, scan) = (named("nav_msgs/msg/Odometry"), named("sensor_msgs/msg/LaserScan"));
    assert_eq!(after[&pose], "geometry_msgs/msg/Pose2D");

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros/read.py");
    let output = run(Command::new(python()).arg(script).arg(&out), "others can't read the recording");
    let lines = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Json> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for reader in ["mcap", "rosbags"] {
        let value = |topic: &str| {
            let of = |line: &&Json| line["reader"] == reader && line["topic"] == topic;
            &lines.iter().find(of).unwrap_or_else(|| panic!("{reader}: {topic}"))["value"]
        };
        assert_eq!(value(&odometry)["header"]["frame_id"], "odom");
        assert_eq!(value(&odometry)["child_frame_id"], "base_link");
        assert_eq!(value(&odometry)["pose"]["pose"]["position"], json!({ "x": 1.5, "y": -2.25, "z": 0.0 }));
        assert_eq!(value(&scan)["header"]["frame_id"], "base_link");
        assert_eq!(value(&scan)["ranges"], json!([1.5, 2.5, 81.91_f32]));
        assert_eq!(value(&pose), &json!({ "x": 3.0, "y": 4.0, "theta": std::f64::consts::FRAC_PI_2 }));
        let transform = &value("/tf")["transforms"][0];
        assert_eq!(transform["header"]["stamp"], json!({ "sec": 11, "nanosec": 500_000_000 }));
        assert_eq!(
            (&transform["header"]["frame_id"], &transform["child_frame_id"]),
            (&json!("map"), &json!("base_link"))
        );
        assert_eq!(transform["transform"]["translation"], json!({ "x": 3.0, "y": 4.0, "z": 0.0 }));
        let turn = &transform["transform"]["rotation"];
        assert_eq!((&turn["x"], &turn["y"]), (&json!(0.0), &json!(0.0)));
        for part in ["z", "w"] {
            assert!((turn[part].as_f64().unwrap() - 0.5_f64.sqrt()).abs() < 1e-12, "{turn}");
        }
    }
}

#[test]
fn a_topic_without_poses_makes_no_transforms_and_no_file() {
    let folder = folder("ros-pose");
    let own = folder.join("own.mcap");
    import(&write(&folder, "a.log", LOG), &own, &STRICT).unwrap();
    let out = folder.join("ros.mcap");
    let export = RosExport { pose: Some("/nobody"), ..RosExport::default() };
    let error = export_ros(&own, &Selection::default(), &export, &out).unwrap_err().to_string();
    assert!(error.contains("own.mcap") && error.contains("`/nobody` has no poses"), "{error}");
    assert!(!out.exists());
}

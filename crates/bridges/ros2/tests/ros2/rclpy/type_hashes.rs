//! Hashes of types against those of ROS.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_ros_messages::{DefinitionFiles, WireFormat, message_definition};
use slate_ros2::{ActionType, RosExplorer, RosWireSettings, ServiceType, known_type_hash, type_hash};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::{Peer, python};

/// Packages of ROS in its own layout.
pub fn packages() -> PathBuf {
    python().parent().and_then(Path::parent).unwrap().join("share")
}

/// The hash that ROS computed for a message.
pub fn hash_of_ros(path: &Path, name: &str) -> String {
    let text = std::fs::read_to_string(path.with_extension("json")).unwrap();
    let all: Json = serde_json::from_str(&text).unwrap();
    let all = all["type_hashes"].as_array().unwrap();
    let own = all.iter().find(|own| own["type_name"] == name).unwrap();
    own["hash_string"].as_str().unwrap().to_owned()
}

#[test]
fn messages_of_files_have_the_hashes_of_ros() {
    let mut checked = 0;
    for package in std::fs::read_dir(packages()).unwrap() {
        let folder = package.unwrap().path().join("msg");
        let files = std::fs::read_dir(folder).into_iter().flatten().map(|file| file.unwrap().path());
        for path in files.filter(|path| path.extension().is_some_and(|own| own == "msg")) {
            let files = match DefinitionFiles::read(WireFormat::Cdr, &path, None) {
                Ok(files) => files,
                // Of which implementations of ROS disagree.
                Err(error) if error.to_string().contains("wstring") => continue,
                Err(error) => panic!("{error}"),
            };
            let definition = files.definition();
            assert_eq!(
                type_hash(definition).unwrap(),
                hash_of_ros(&path, &definition.name),
                "{}",
                definition.name
            );
            checked += 1;
        }
    }
    assert!(checked > 120, "{checked}");
}

#[test]
fn built_in_messages_have_the_hashes_of_ros() {
    for name in [
        "sensor_msgs/msg/LaserScan",
        "nav_msgs/msg/Odometry",
        "geometry_msgs/msg/Twist",
        "sensor_msgs/msg/Image",
    ] {
        let path = packages().join(name);
        assert_eq!(type_hash(&message_definition(name).unwrap()).unwrap(), hash_of_ros(&path, name));
    }
}

/// Messages of a package, each behind a line of `=`.
fn messages_of(package: &str) -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(packages().join(package).join("msg")).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|own| own == "msg") {
            let name = path.file_stem().unwrap().to_str().unwrap();
            let fields = std::fs::read_to_string(&path).unwrap();
            text += &format!("\n====\nMSG: {package}/{name}\n{fields}");
        }
    }
    text
}

#[test]
fn services_have_the_hashes_of_ros() {
    let mut checked = 0;
    for package in ["std_srvs", "rcl_interfaces", "lifecycle_msgs", "type_description_interfaces"] {
        let folder = packages().join(package).join("srv");
        for path in std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path()) {
            if path.extension().is_none_or(|own| own != "srv") {
                continue;
            }
            let name = format!("{package}/srv/{}", path.file_stem().unwrap().to_str().unwrap());
            let messages = messages_of(package);
            let text = std::fs::read_to_string(&path).unwrap() + &messages;
            let of = ServiceType::parse(WireFormat::Cdr, &name, &text).unwrap();
            assert_eq!(of.type_hash().unwrap(), hash_of_ros(&path, &name));
            checked += 1;
        }
    }
    assert!(checked >= 9, "{checked}");
}

#[test]
fn services_and_messages_of_actions_have_the_hashes_of_ros() {
    let name = "test_msgs/action/Fibonacci";
    let path = packages().join(name);
    let text = std::fs::read_to_string(path.with_extension("action")).unwrap();
    let of = ActionType::parse(name, &text).unwrap();
    for (hash, part) in [
        (of.send_goal().type_hash(), "_SendGoal"),
        (of.get_result().type_hash(), "_GetResult"),
        (of.feedback_message().type_hash(), "_FeedbackMessage"),
        (of.goal().type_hash(), "_Goal"),
    ] {
        assert_eq!(hash.unwrap(), hash_of_ros(&path, &format!("{name}{part}")));
    }
    let common = packages().join("action_msgs");
    let cancel = ActionType::cancel_goal().unwrap();
    assert_eq!(cancel.type_hash().unwrap(), hash_of_ros(&common.join("srv/CancelGoal"), cancel.name()));
    let status = ActionType::status().unwrap();
    assert_eq!(status.type_hash().unwrap(), hash_of_ros(&common.join("msg/GoalStatusArray"), status.name()));
}

#[test]
fn hashes_of_others_are_seen_and_compared() {
    alone("ros2::rclpy::type_hashes::hashes_of_others_are_seen_and_compared", |domain| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-hashes/geometry_msgs/msg");
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("WrenchStamped.msg");
        std::fs::write(&file, "Header header\nWrench wrench\n").unwrap();
        std::fs::write(folder.join("Wrench.msg"), "Vector3 torque\nVector3 force\n").unwrap();
        std::fs::write(folder.join("Vector3.msg"), "float64 x\nfloat64 y\nfloat64 z\n").unwrap();
        let mut peer = Peer::start("sensor", domain);
        peer.advertise("/load", "geometry_msgs/msg/WrenchStamped", json!({}));
        peer.advertise("/scan", "sensor_msgs/msg/LaserScan", json!({}));
        let agent = Running::of(&format!(
            "agent.name = \"arm\"\n[modules.wrist]\n[modules.driver]\n[ros2]\ndomain = {domain}\n\
             read.\"wrist/load\" = {{ topic = \"/load\", definition = {file:?} }}\nread.\"driver/scan\" = \"/scan\""
        ));
        let name = "geometry_msgs/msg/WrenchStamped";
        let theirs = hash_of_ros(&packages().join(name), name);
        let ours = known_type_hash(name, Some(&file)).unwrap();
        let line = format!("/load: a publisher defines {name} differently (type hash {theirs}, here {ours})");
        eventually("the difference", || agent.has_logged(&line));
        eventually("the scan's publisher", || agent.bridge().topics()[0].others == Some(1));
        assert_eq!(agent.logged("differently"), 1);
        let mut explorer = RosExplorer::join(domain, &RosWireSettings::Dds, false).unwrap();
        eventually("the publisher", || {
            explorer.discover(Duration::from_millis(100));
            let topics = explorer.topics();
            let found = topics.get("/load").and_then(|topic| topic.publishers.first());
            found.and_then(|own| own.type_hash.as_ref()) == Some(&theirs)
        });
    });
}

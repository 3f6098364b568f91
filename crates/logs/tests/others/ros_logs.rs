//! Recordings as ROS 2 has the messages, read by libraries of others.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value as Json, json};
use slate_bag::{Channel, Compression, Header, Reader, Schema, Selection, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_interfaces::{Echo, Odometry, Pose2, PoseEstimate, Position, Quaternion, Transform, Twist2};
use slate_logs::{RosExport, export_ros, import};
use slate_module::math;
use slate_ros_messages as ros;
use slate_ros_messages::Followed;

use crate::files::{STRICT, folder, write};
use crate::python::{python, run};

const LOG: &str = "\
PARAM robot_name sam nohost 0
ODOM 1.5 -2.25 0.5 0.4 -0.1 0 10.5 host 0.1
FLASER 3 1.5 2.5 81.91 1.5 -2.25 0.5 1.5 -2.25 0.5 10.75 host 0.2
TRUEPOS 3 4 1.5707963267948966 1.5 -2.25 0.5 11.5 host 0.3
";

/// What libraries of others find in a file.
fn read(path: &Path) -> Vec<Json> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../ros_messages/tests/others/read.py");
    let output = run(Command::new(python()).arg(script).arg(path), "others can't read the recording");
    let lines = String::from_utf8(output.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

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
    assert_eq!((log.transforms, log.left_out.len(), log.unread.len()), (2, 0, 0));

    let after = types(&out);
    assert_eq!(after["/tf"], "tf2_msgs/msg/TFMessage");
    let named = |name: &str| after.iter().find(|(_, own)| *own == name).unwrap().0.clone();
    let (odometry, scan) = (named("nav_msgs/msg/Odometry"), named("sensor_msgs/msg/LaserScan"));
    assert_eq!(after[&pose], "geometry_msgs/msg/Pose2D");

    let lines = read(&out);
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
        let all = transforms(&lines, reader, "/tf");
        let [moved, place] = &all[..] else { panic!("{all:?}") };
        assert_eq!((moved.parent.as_str(), moved.child.as_str(), moved.time), ("odom", "base_link", 10.5));
        assert_eq!((place.parent.as_str(), place.child.as_str(), place.time), ("map", "odom", 11.5));
        assert_eq!(moved.place, [1.5, -2.25, 0.5]);
        // By both it is where it truly was.
        is_near(&place.of(moved.place), [3.0, 4.0, std::f64::consts::FRAC_PI_2]);
    }
}

/// Where a frame is in its parent, in the plane.
#[derive(Debug)]
struct Told {
    time: f64,
    parent: String,
    child: String,
    place: [f64; 3],
}

impl Told {
    /// What is there in the child's frame, in that of the parent.
    fn of(&self, [x, y, theta]: [f64; 3]) -> [f64; 3] {
        let (sine, cosine) = (math::sin(self.place[2]), math::cos(self.place[2]));
        let [left, up, turn] = self.place;
        [left + cosine * x - sine * y, up + sine * x + cosine * y, turn + theta]
    }
}

fn is_near(found: &[f64; 3], wanted: [f64; 3]) {
    assert!(found.iter().zip(wanted).all(|(one, other)| (one - other).abs() < 1e-12), "{found:?} {wanted:?}");
}

/// The transforms that a reader has seen, in order.
fn transforms(lines: &[Json], reader: &str, topic: &str) -> Vec<Told> {
    let messages = lines.iter().filter(|line| line["reader"] == reader && line["topic"] == topic);
    let all = messages.flat_map(|line| line["value"]["transforms"].as_array().unwrap());
    let told = all.map(|own| {
        let number = |path: &str| own.pointer(path).unwrap().as_f64().unwrap();
        let text = |path: &str| own.pointer(path).unwrap().as_str().unwrap().to_owned();
        assert_eq!((number("/transform/rotation/x"), number("/transform/rotation/y")), (0.0, 0.0));
        let half = [number("/transform/rotation/z"), number("/transform/rotation/w")];
        let [x, y] = ["x", "y"].map(|axis| number(&format!("/transform/translation/{axis}")));
        Told {
            time: number("/header/stamp/sec") + number("/header/stamp/nanosec") * 1e-9,
            parent: text("/header/frame_id"),
            child: text("/child_frame_id"),
            place: [x, y, 2.0 * math::atan2(half[0], half[1])],
        }
    });
    told.collect()
}

/// Values of interfaces in a recording.
struct Values {
    writer: Writer<Vec<u8>>,
    channels: BTreeMap<String, u16>,
}

impl Values {
    fn new(path: &Path) -> Self {
        let header = Header { profile: "ros2".into(), library: "test".into() };
        let writer = Writer::new(Vec::new(), path, &header, Compression::None).unwrap();
        Self { writer, channels: BTreeMap::new() }
    }

    fn add<T: Interface + Copy>(&mut self, topic: &str, time: u64, value: &T) {
        let next = self.channels.len() as u16 + 1;
        let id = *self.channels.entry(topic.into()).or_insert(next);
        if id == next {
            let definition = ros::definition(T::DESCRIPTOR);
            let (name, data) = (definition.name, definition.text.into_bytes());
            self.writer.schema(&Schema { id, name, encoding: "ros2msg".into(), data }).unwrap();
            let (topic, encoding) = (topic.into(), "cdr".into());
            let (schema_id, metadata) = (id, [].into());
            self.writer
                .channel(&Channel { id, schema_id, topic, message_encoding: encoding, metadata })
                .unwrap();
        }
        let mut data = Vec::new();
        ros::encode(T::DESCRIPTOR, View::of(&mut { *value }).bytes(), &mut data).unwrap();
        self.writer.message(id, 0, time, time, &data).unwrap();
    }
}

/// Each frame has one parent, and all begin at the map.
fn check_tree(all: &[Told]) -> BTreeMap<&str, &str> {
    let mut parents: BTreeMap<&str, &str> = BTreeMap::new();
    for own in all {
        let before = parents.insert(&own.child, &own.parent);
        assert!(before.is_none_or(|before| before == own.parent), "{own:?} and {before:?}");
    }
    for child in parents.keys() {
        let up = std::iter::successors(Some(*child), |frame| parents.get(frame).copied());
        assert_eq!(up.take(10).last(), Some("map"), "{parents:?}");
    }
    parents
}

#[test]
fn each_of_several_robots_keeps_its_frames_and_poses() {
    let folder = folder("ros-robots");
    let own = folder.join("own.mcap");
    let mut values = Values::new(&own);
    let pose = |x: f64, theta: f64| Pose2 { x, y: 2.0 * x, theta };
    let mount = Transform {
        time: 0,
        parent: "base_link".into(),
        child: "camera".into(),
        translation: Position { x: 0.1, y: 0.0, z: 0.3 },
        rotation: Quaternion::IDENTITY,
        fixed: true.into(),
    };
    values.add("/r2/camera/mount", 0, &mount);
    // Beside a sensor's topic: its values are in that frame.
    let mount = Transform { child: "range".into(), ..mount };
    values.add("/simulator/r2/range_mount", 0, &mount);
    values.add("/simulator/r2/range", 0, &Echo { range: 1.5, ..Echo::default() });
    let echo = Echo { range: 1.5, ..Echo::default() };
    for step in 0..20 {
        let (time, far) = (step * 100_000_000, step as f64 * 0.1);
        // What is of one cycle is in no order.
        values.add("/simulator/r1/truth", time, &pose(1.0 + far, far));
        let moved = Odometry { pose: pose(far, 0.5 * far), twist: Twist2 { linear: 1.0, angular: 0.5 } };
        values.add("/simulator/r1/odometry", time, &moved);
        values.add("/simulator/r2/truth", time, &pose(-far, 0.0));
        for robot in ["r1", "r2"] {
            let estimate = PoseEstimate { pose: pose(far, 0.0), covariance: [0.0; 9] };
            values.add(&format!("/{robot}/localizer/estimate"), time, &estimate);
            values.add(&format!("/{robot}/echo"), time, &echo);
        }
        values.add("/referee/echo", time, &echo);
    }
    std::fs::write(&own, values.writer.finish().unwrap()).unwrap();
    let out = folder.join("ros.mcap");
    let followed = |name: &str| Followed {
        name: name.into(),
        pose: format!("/simulator/{name}/truth"),
        ..Followed::default()
    };
    let robots = [followed("r1"), followed("r2")];
    let export = RosExport { pose: Some("/referee/pose"), ..RosExport::default() };
    let error = export_ros(&own, &Selection::default(), &export, &out).unwrap_err().to_string();
    assert!(error.contains("`/referee/pose` names none of its robots: r1, r2"), "{error}");
    // They need no names where their true poses are recorded.
    for robots in [&robots[..], &[]] {
        let export = RosExport { robots, ..RosExport::default() };
        let log = export_ros(&own, &Selection::default(), &export, &out).unwrap();
        assert_eq!((log.transforms, log.left_out.len(), log.unread.len()), (62, 0, 0));
        let lines = read(&out);
        for reader in ["mcap", "rosbags"] {
            let of = |topic: &str| {
                let of = |line: &&Json| line["reader"] == reader && line["topic"] == topic;
                lines.iter().find(of).unwrap_or_else(|| panic!("{reader}: {topic}"))["value"].clone()
            };
            let odometry = of("/simulator/r1/odometry");
            assert_eq!(
                (&odometry["header"]["frame_id"], &odometry["child_frame_id"]),
                (&json!("r1/odom"), &json!("r1/base_link"))
            );
            for (topic, frame) in [
                ("/r1/echo", "r1/base_link"),
                ("/r2/echo", "r2/base_link"),
                ("/referee/echo", "map"),
                ("/simulator/r2/range", "r2/range"),
                ("/r2/localizer/estimate", "map"),
            ] {
                assert_eq!(of(topic)["header"]["frame_id"], frame, "{reader}: {topic}");
            }
            let mut all = transforms(&lines, reader, "/tf");
            let fixed = transforms(&lines, reader, "/tf_static");
            assert_eq!(fixed.len(), 2);
            for step in 0..20 {
                let far = step as f64 * 0.1;
                let at = |child: &str| {
                    let mut all =
                        all.iter().filter(|own| own.child == child && (own.time - far).abs() < 1e-9);
                    all.next().unwrap_or_else(|| panic!("{child} at {far}"))
                };
                is_near(&at("r1/odom").of(at("r1/base_link").place), [1.0 + far, 2.0 * (1.0 + far), far]);
                is_near(&at("r2/base_link").place, [-far, -2.0 * far, 0.0]);
            }
            all.extend(fixed);
            let parents = check_tree(&all);
            let wanted = [
                ("r1/base_link", "r1/odom"),
                ("r1/odom", "map"),
                ("r2/base_link", "map"),
                ("r2/camera", "r2/base_link"),
                ("r2/range", "r2/base_link"),
            ];
            assert_eq!(parents, wanted.into());
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

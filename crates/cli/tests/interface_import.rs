//! Interfaces with the fields of `.msg` files.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use slate::blackboard::interface::{Descriptor, Interface, Sequence, Text, View};
use slate::ros_messages::{DefinitionFiles, WireFormat};

use crate::common;
use common::Running;

#[path = "imported/skin.rs"]
mod skin;
#[path = "imported/state.rs"]
mod state;

use skin::Skin;
use state::{Finger, Header, State, StateError, StateMode, Time};

const MESSAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/imported");

/// A folder with the packages of the test.
fn packages(name: &str) -> Running {
    let running = Running::new(name);
    for file in [
        "arm_msgs/msg/State.msg",
        "arm_msgs/msg/Skin.msg",
        "arm_msgs/msg/Load.msg",
        "hand_msgs/msg/Grip.msg",
        "hand_msgs/msg/Finger.msg",
    ] {
        write(&running, file, &fs::read_to_string(Path::new(MESSAGES).join(file)).unwrap());
    }
    running
}

fn write(running: &Running, file: &str, text: &str) {
    let path = running.folder().join(file);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn files(file: &str) -> DefinitionFiles {
    DefinitionFiles::read(WireFormat::Cdr, &Path::new(MESSAGES).join(file), None).unwrap()
}

#[test]
fn imported_interfaces_compile_with_the_layout_that_check_shows() {
    let running = packages("import");
    for (file, out, source, descriptor) in [
        ("State", "state.rs", include_str!("imported/state.rs"), State::DESCRIPTOR),
        ("Skin", "skin.rs", include_str!("imported/skin.rs"), Skin::DESCRIPTOR),
    ] {
        let message = format!("arm_msgs/msg/{file}.msg");
        let printed = running.done(&["interface", "import", &message]);
        assert_eq!(printed, source);
        running.done(&["interface", "import", &message, "--out", out]);
        running.fails(2, &["interface", "import", &message, "--out", out], &["exists already"]);
        let checked = running.done(&["interface", "check", out, "--json"]);
        let checked: Value = serde_json::from_str(&checked).unwrap();
        let own = checked["interfaces"].as_array().unwrap().last().unwrap();
        assert_eq!(own["schema"], format!("{:016x}", descriptor.hash), "{own}");
        assert_eq!(descriptor.ros, format!("arm_msgs/msg/{file}"));
    }
    let book = include_str!("../../../book/src/27-command-line.md");
    assert!(book.contains(&running.done(&["interface", "import", "arm_msgs/msg/Load.msg"])));
}

/// The bytes of a value as message of a file, read by the definition of the file alone, and back.
fn there_and_back(files: &DefinitionFiles, descriptor: &'static Descriptor, value: &[u8]) -> String {
    let standard = files.standard(descriptor).unwrap();
    // So topics have the type and the hash of the file.
    assert_eq!(standard.definition(), files.definition());
    assert_eq!(standard.check_decodable(), Ok(()));
    let mut message = Vec::new();
    standard.encode(value, 5_000_000_006, "wrist", &mut message).unwrap();
    assert_eq!(standard.decode(&message).unwrap(), value);
    files.schema().unwrap().decode(&message).unwrap().to_string()
}

#[test]
fn every_field_of_a_message_is_one_of_its_imported_interface() {
    let finger = |number: i32| Finger {
        header: Header {
            stamp: Time { sec: number, nanosec: 7 },
            frame_id: Text::new(&format!("finger{number}")),
        },
        tip: state::Point32 { x: 0.5, y: 0.0, z: number as f32 },
    };
    let mut value = State {
        mode: StateMode::HELD_BY_HAND,
        error: StateError::OVERHEATED,
        moved: Time { sec: -3, nanosec: 4 },
        uptime: state::Duration { sec: 9, nanosec: 1 },
        name: Text::new("left"),
        brakes: Sequence::new(&[true.into(), false.into()]),
        joints: Sequence::new(&[Text::new("shoulder"), Text::new("")]),
        thumbs: [finger(1), finger(2)],
        r#type: 1 << 40,
        temperatures: Sequence::new(&[20.5]),
        tag: *b"arm1",
        ..State::default()
    };
    value.tool.position.y = 2.0;
    value.tool.orientation.w = 1.0;
    value.grip.width = 0.25;
    value.grip.fingers = Sequence::new(&[finger(3)]);
    let bytes = View::of(&mut value).bytes().to_vec();
    let seen = there_and_back(&files("arm_msgs/msg/State.msg"), State::DESCRIPTOR, &bytes);
    for words in [
        "header = { stamp = { sec = 5, nanosec = 6 }, frame_id = \"wrist\" }, mode = 2, error = -7",
        "moved = { sec = -3, nanosec = 4 }, uptime = { sec = 9, nanosec = 1 }",
        "tool = { position = { x = 0, y = 2, z = 0 }, orientation = { x = 0, y = 0, z = 0, w = 1 } }",
        "grip = { width = 0.25, fingers = [{ header = { stamp = { sec = 3, nanosec = 7 }, frame_id = \"finger3\" }, \
         tip = { x = 0.5, y = 0, z = 3 } }] }, name = \"left\"",
        "joints = [\"shoulder\", \"\"], thumbs = [{ header = { stamp = { sec = 1, nanosec = 7 }, frame_id = \"finger1\" }",
        "type = 1099511627776",
    ] {
        assert!(seen.contains(words), "{words}\n{seen}");
    }
    assert_eq!((State::MODE_2D, State::MAX_SPEED, State::VENDOR), (3, 1.5, "Arms # 1"));
    // A head of 8 bytes, and three numbers.
    let mut skin = [2_u32.to_ne_bytes(), [0; 4]].concat();
    skin.truncate(Skin::DESCRIPTOR.size);
    skin.extend([1.0_f32, -2.0, 0.5].iter().flat_map(|number| number.to_ne_bytes()));
    let seen = there_and_back(&files("arm_msgs/msg/Skin.msg"), Skin::DESCRIPTOR, &skin);
    assert!(seen.contains("columns = 2, pressures = [1, -2, 0.5]"), "{seen}");
}

#[test]
fn invalid_interface_is_refused_with_file_and_line() {
    let running = packages("import-wrong");
    let refused = |file: &str, more: &[&str], words: &[&str]| {
        running.fails(2, &[&["interface", "import", file], more].concat(), words)
    };
    let wrong = |text: &str, words: &[&str]| {
        write(&running, "a/msg/A.msg", text);
        refused("a/msg/A.msg", &[], words)
    };
    wrong("int8 x\nwstring y\n", &["a/msg/A.msg:2: a `wstring` can't be read"]);
    wrong("int8 x\nA[] y\n", &["a/msg/A.msg:2: a message can't contain itself: a/A > a/A"]);
    wrong("int8 x\nB y\n", &["a/msg/A.msg:2: unknown type `B`", "a/msg/B.msg"]);
    wrong("Header header\n", &["a/msg/A.msg:1: a message without fields beside its header"]);
    wrong("int8 x\nNone[] y\n===\nMSG: a/None\n", &["a/msg/A.msg:2: `a/None` has no fields"]);
    wrong(
        "\nint8 X=300\nint8 x\n",
        &["a/msg/A.msg:2: `300` is not a value of X: expected a number from -128 to 127"],
    );
    wrong("float64[131073] x\n", &["a/msg/A.msg:1: up to here a value takes 1048584 bytes", "--items"]);
    wrong("Big[] x\nint8 y\n===\nMSG: a/Big\nuint8[65536] x\n", &["a/msg/A.msg:1: up to here", "--items"]);
    running.done(&["interface", "import", "a/msg/A.msg", "--items", "4"]);
    wrong("int8 9x\n", &["a/msg/A.msg:1: `9x` can't be the name of a field"]);
    wrong("int8 x\n\nint8 super\n", &["a/msg/A.msg:3: `super` can't be the name of a field"]);
    wrong("int8 x\nint8 x\n", &["a/msg/A.msg:1", "two fields `x`"]);
    wrong("int8 x\nint8 9X=1\n", &["a/msg/A.msg:2: `9X` is not the name of a constant"]);
    wrong("int8 x\nint8 X=1\nint8 X=2\n", &["a/msg/A.msg:3: there are two constants `X`"]);
    wrong(
        "int8 x\nfloat32 X=1e300\n",
        &["a/msg/A.msg:2: `1e300` is not a value of X: expected a finite number"],
    );
    wrong("int8 x\nbool X=yes\n", &["a/msg/A.msg:2: `yes` is not a value of X: expected true or false"]);
    refused("a/msg/A.msg", &["--items", "0"], &["--items"]);
    refused("a/msg/B.msg", &[], &["a/msg/B.msg: the file can't be read"]);
    write(&running, "A.msg", "int8 x\n");
    refused("A.msg", &[], &["A.msg: the type is not known from the path", "PACKAGE/msg/NAME.msg"]);
    let source = running.done(&["interface", "import", "A.msg", "--type", "own_msgs/msg/Quaternion"]);
    for line in [
        "definition = \"A.msg\", type = \"own_msgs/msg/Quaternion\" }",
        "#[interface(ros = \"own_msgs/msg/Quaternion\")]",
        // Slate has a Quaternion already.
        "pub struct OwnMsgsQuaternion {",
    ] {
        assert!(source.contains(line), "{line}\n{source}");
    }
    write(&running, "a/srv/A.srv", "int8 x\n---\n");
    refused("a/srv/A.srv", &[], &["a/srv/A.srv: expected the definition of a message"]);
}

#[test]
fn messages_of_ros_1_have_times_and_another_header() {
    let running = Running::new("import-ros1");
    write(&running, "old/msg/Sample.msg", "Header header\ntime taken\nduration[] pauses\nHeader[] others\n");
    running.fails(2, &["interface", "import", "old/msg/Sample.msg"], &["Sample.msg:2: unknown type `time`"]);
    let source = running.done(&["interface", "import", "old/msg/Sample.msg", "--ros1"]);
    for line in [
        "// old/Sample, for topics of ROS 1 such as",
        "#[interface(ros = \"old/msg/Sample\")]",
        "pub taken: Time,",
        "pub pauses: Sequence<Duration, 16>,",
        "pub seq: u32,",
        "pub others: Sequence<Header, 16>,",
    ] {
        assert!(source.contains(line), "{line}\n{source}");
    }
    assert!(!source.contains("pub header"), "{source}");
}

#[cfg(feature = "external-tools")]
#[test]
fn messages_of_ros_are_imported_but_for_those_without_values() {
    let python = slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")));
    let share = python.parent().and_then(Path::parent).unwrap().join("share");
    let running = Running::new("import-ros");
    let (mut imported, mut refused) = (0, Vec::new());
    let folders = fs::read_dir(share).unwrap().map(|package| package.unwrap().path().join("msg"));
    for path in folders.filter(|folder| folder.is_dir()).flat_map(|folder| fs::read_dir(folder).unwrap()) {
        let path = path.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "msg") {
            continue;
        }
        let output = running.call(&["interface", "import", path.to_str().unwrap()]);
        if output.status.success() {
            imported += 1;
        } else {
            refused.push(common::text(&output.stderr));
        }
    }
    assert!(imported > 120, "{imported} {refused:?}");
    let is_known = |said: &String| {
        ["`wstring`", "without fields", "has no fields"].iter().any(|reason| said.contains(reason))
            && said.contains(".msg")
    };
    assert!(refused.iter().all(is_known), "{refused:?}");
}

//! Definitions from files.

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use slate_interfaces::Position;
use slate_module::blackboard::interface::{Interface, View};
use slate_module::{Sequence, Text, interface};
use slate_ros_messages::{DefinedCount, DefinedItem, DefinitionFiles, WireFormat};

/// A force and a torque at a point.
#[interface]
#[derive(PartialEq)]
struct Load {
    force: Position,
    torque: Position,
}

/// A number.
#[interface]
#[derive(PartialEq)]
struct Number {
    value: f64,
}

/// An empty folder with these files.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("definitions").join(name);
    let _ = fs::remove_dir_all(&folder);
    for (path, text) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

fn read(folder: &Path, file: &str) -> Result<DefinitionFiles, String> {
    let folder_text = format!("{}/", folder.display());
    DefinitionFiles::read(WireFormat::Cdr, &folder.join(file), None)
        .map_err(|error| error.to_string().replace(&folder_text, ""))
}

#[test]
fn nested_messages_are_found_beside_and_in_other_packages() {
    let folder = folder(
        "nested",
        &[
            (
                "arm_msgs/msg/State.msg",
                "# A state.\nuint8 IDLE=0\nHeader header\nLoad load\nhand_msgs/Grip[] grips\n",
            ),
            ("arm_msgs/msg/Load.msg", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque # N m\n"),
            ("hand_msgs/msg/Grip.msg", "float64 width\nFinger[2] fingers\n"),
            ("hand_msgs/msg/Finger.msg", "string<=8 name \"thumb\"\n"),
        ],
    );
    let files = read(&folder, "arm_msgs/msg/State.msg").unwrap();
    assert_eq!(files.definition().name, "arm_msgs/msg/State");
    let inside: Vec<_> = files.definition().text.lines().filter(|line| line.starts_with("MSG: ")).collect();
    let expected =
        ["std_msgs/Header", "arm_msgs/Load", "geometry_msgs/Vector3", "hand_msgs/Grip", "hand_msgs/Finger"];
    assert_eq!(inside, expected.map(|name| format!("MSG: {name}")));
    assert_eq!(files.schema().unwrap().field_names().collect::<Vec<_>>(), ["header", "load", "grips"]);
}

#[test]
fn one_file_may_have_all_messages() {
    let text = "Load load\n===\nMSG: own/Load\nfloat64 force\n";
    let folder = folder("one", &[("own.msg", text)]);
    let own = DefinitionFiles::read(WireFormat::Cdr, &folder.join("own.msg"), Some("own/msg/State")).unwrap();
    assert_eq!(own.schema().unwrap().field_names().collect::<Vec<_>>(), ["load"]);
    let error = read(&folder, "own.msg").unwrap_err();
    assert!(error.starts_with("own.msg: the type is not known from the path"), "{error}");
}

/// Several messages of a file.
#[interface]
#[derive(PartialEq)]
struct Mixed {
    moved: Moment,
    names: Sequence<Text<8>, 4>,
    places: [Position; 2],
    tags: [Text<4>; 2],
    last: Ends,
}

#[interface]
#[derive(PartialEq)]
struct Moment {
    sec: i32,
    nanosec: u32,
}

#[interface]
#[derive(PartialEq)]
struct Ends {
    angle_max: f32,
}

#[test]
fn lists_of_texts_fixed_lists_and_times_of_its_own_are_fields() {
    let text = "builtin_interfaces/Time moved\nbuiltin_interfaces/Time written\nstring[] names\n\
                geometry_msgs/Point[2] places\nstring[2] tags\nNone none\nsensor_msgs/LaserScan last\n\
                ===\nMSG: own/None\n";
    let folder = folder("mixed", &[("own/msg/Mixed.msg", text)]);
    let files = read(&folder, "own/msg/Mixed.msg").unwrap();
    let standard = files.standard(Mixed::DESCRIPTOR).unwrap();
    assert_eq!(standard.check_decodable(), Ok(()));
    let place = |x| Position { x, y: 0.0, z: -x };
    let mut value = Mixed {
        moved: Moment { sec: -1, nanosec: 5 },
        names: Sequence::new(&[Text::new("left"), Text::new("")]),
        places: [place(1.0), place(2.0)],
        tags: [Text::new("a"), Text::new("four")],
        last: Ends { angle_max: 1.5 },
    };
    let bytes = View::of(&mut value).bytes().to_vec();
    let mut message = Vec::new();
    standard.encode(&bytes, 3_000_000_004, "", &mut message).unwrap();
    let seen = files.schema().unwrap().decode(&message).unwrap().to_string();
    for words in [
        "moved = { sec = -1, nanosec = 5 }, written = { sec = 3, nanosec = 4 }, names = [\"left\", \"\"]",
        "places = [{ x = 1, y = 0, z = -1 }, { x = 2, y = 0, z = -2 }], tags = [\"a\", \"four\"]",
        "angle_max = 1.5",
    ] {
        assert!(seen.contains(words), "{words}\n{seen}");
    }
    assert_eq!(standard.decode(&message).unwrap(), bytes);
    let text = text.replace("string[2] tags", "string[3] tags");
    fs::write(folder.join("own/msg/Mixed.msg"), text).unwrap();
    let error = read(&folder, "own/msg/Mixed.msg").unwrap().standard(Mixed::DESCRIPTOR).unwrap_err();
    assert!(error.to_string().contains("Mixed.msg:5: the type of this field does not fit `tags`"), "{error}");
}

#[test]
fn comments_and_constants_of_a_message_are_read() {
    let text = "# A state.\n# Of an arm.\n\n# Modes.\nuint8 IDLE=0 # without power\nstring NAME=a # b\n\n# lost\n\n\
                # Above.\nHeader header\nfloat32[<=4] x  # behind [m]\n                # and on\nstring<=8[] names\n";
    let folder = folder("comments", &[("own/msg/State.msg", text)]);
    let files = read(&folder, "own/msg/State.msg").unwrap();
    let messages = files.messages().unwrap();
    assert_eq!(
        messages.iter().map(|own| own.key.as_str()).collect::<Vec<_>>(),
        ["own/State", "std_msgs/Header"]
    );
    let own = &messages[0];
    assert_eq!(own.doc, ["A state.", "Of an arm."]);
    let constants: Vec<_> =
        own.constants.iter().map(|own| (own.line, own.name, own.value, &own.doc[..])).collect();
    assert_eq!(constants, [(5, "IDLE", "0", &["Modes.", "without power"][..]), (6, "NAME", "a # b", &[])]);
    let fields: Vec<_> = own.fields.iter().map(|own| (own.line, own.name, own.count, &own.doc[..])).collect();
    let expected = [
        (11, "header", DefinedCount::One, &["Above."][..]),
        (12, "x", DefinedCount::Bounded(4), &["behind [m]", "and on"]),
        (14, "names", DefinedCount::Any, &[]),
    ];
    assert_eq!(fields, expected);
    assert_eq!(own.fields[0].item, DefinedItem::Message("std_msgs/Header".into()));
    assert_eq!(own.fields[2].item, DefinedItem::Text(Some(8)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_file_has_messages_or_is_refused(
        text in "(int8|string|bool|Header|Own|A|x|y|=|3|-|#|\"|<=|\\[|\\]| |\n|MSG: |===\n|a/|é){0,40}",
    ) {
        let folder = folder("any", &[("a/msg/A.msg", &text)]);
        if let Ok(files) = read(&folder, "a/msg/A.msg")
            && let Ok(messages) = files.messages()
        {
            let lines = files.definition().text.lines().count();
            for message in &messages {
                prop_assert!(message.fields.iter().all(|field| (1..=lines).contains(&field.line)));
                prop_assert!(message.constants.iter().all(|constant| (1..=lines).contains(&constant.line)));
            }
            let schema = files.schema().unwrap();
            let names: Vec<_> = messages[0].fields.iter().map(|field| field.name).collect();
            prop_assert_eq!(schema.field_names().collect::<Vec<_>>(), names);
        }
    }
}

#[test]
fn invalid_definitions_are_named_with_file_and_line() {
    let cases = [
        (
            &[("a/msg/A.msg", "bool on\nB b\n"), ("a/msg/B.msg", "\nC[] c\n"), ("a/msg/C.msg", "A a\n")][..],
            "a/msg/C.msg:1: a message can't contain itself: a/A > a/B > a/C > a/A",
        ),
        (&[("a/msg/A.msg", "A[] inner\n")], "a/msg/A.msg:1: a message can't contain itself: a/A > a/A"),
        (
            &[("a/msg/A.msg", "float32 x\nfloat y\n")],
            "a/msg/A.msg:2: unknown type `float`: expected a primitive type, a built-in message, or a file a/msg/float.msg",
        ),
        (&[("a/msg/A.msg", "b/B b\n")], "a/msg/A.msg:1: unknown type `b/B`"),
        (
            &[("a/msg/A.msg", "b/B b\n"), ("b/msg/B.msg", "bool on\nbool\n")],
            "b/msg/B.msg:2: expected a type and a name, not `bool`",
        ),
        (&[("a/msg/A.msg", "int32[x] b\n")], "a/msg/A.msg:1: `x` is not a number of items"),
        (&[("a/msg/A.msg", "wstring b\n")], "a/msg/A.msg:1: a `wstring` can't be read"),
        (&[("a/msg/A.msg", "bool a\n=====\nbool b\n")], "a/msg/A.msg:3: expected `MSG: package/Name`"),
        (&[], "a/msg/A.msg: the file can't be read"),
    ];
    for (number, (files, words)) in cases.into_iter().enumerate() {
        let folder = folder(&format!("wrong{number}"), files);
        let error = read(&folder, "a/msg/A.msg").unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

#[test]
fn values_become_messages_of_files_and_come_back() {
    let folder = folder(
        "wrench",
        &[
            (
                "own/msg/Wrench.msg",
                "std_msgs/Header header\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\nstring frame\n",
            ),
            ("own/msg/Level.msg", "Header header\nfloat32 data\n"),
        ],
    );
    let mut load =
        Load { force: Position { x: 1.0, y: 2.0, z: 3.0 }, torque: Position { x: -1.0, y: 0.0, z: 0.5 } };
    let value = View::of(&mut load).bytes().to_vec();
    for format in [WireFormat::Cdr, WireFormat::Ros1] {
        let read =
            |file: &str, name: &str| DefinitionFiles::read(format, &folder.join(file), Some(name)).unwrap();
        let files = read("own/msg/Wrench.msg", "own/Wrench");
        let standard = files.standard(Load::DESCRIPTOR).unwrap();
        assert_eq!(standard.check_decodable(), Ok(()));
        let mut message = Vec::new();
        standard.encode(&value, 2_000_000_003, "wrist", &mut message).unwrap();
        let seen = files.schema().unwrap().decode_in(format, &message).unwrap();
        assert_eq!(seen.at("force").unwrap().to_string(), "{ x = 1, y = 2, z = 3 }");
        assert_eq!(seen.at("header/frame_id").unwrap().as_str(), Some("wrist"));
        assert_eq!(standard.decode(&message).unwrap(), value);
        // The only fields of both are the same whatever their names.
        let level = read("own/msg/Level.msg", "own/Level").standard(Number::DESCRIPTOR).unwrap();
        assert_eq!(level.check_decodable(), Ok(()));
        let mut message = Vec::new();
        level.encode(&2.5_f64.to_ne_bytes(), 0, "", &mut message).unwrap();
        assert_eq!(level.decode(&message).unwrap(), 2.5_f64.to_ne_bytes());
    }
}

#[test]
fn a_message_that_does_not_fit_is_named_with_its_line() {
    let folder = folder(
        "misfit",
        &[
            ("own/msg/A.msg", "string note\nWrong force\n"),
            ("own/msg/Wrong.msg", "float64 x\nstring y\n"),
            ("own/msg/None.msg", "bool on\nbool off\n"),
            ("own/msg/Half.msg", "geometry_msgs/Vector3 force\nbool on\n"),
        ],
    );
    let refused = |file: &str| {
        let files = read(&folder, file).unwrap();
        let found = files.standard(Load::DESCRIPTOR);
        let error =
            found.and_then(|own| own.check_decodable().map_err(|reason| files_error(&reason))).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.display()), "")
    };
    assert_eq!(
        refused("own/msg/A.msg"),
        "own/msg/Wrong.msg:2: the type of this field does not fit `force/y` of Load, f64"
    );
    assert_eq!(
        refused("own/msg/None.msg"),
        "own/msg/None.msg:1: no field of own/None is one of Load, which has force, torque"
    );
    assert!(refused("own/msg/Half.msg").contains("Load can't be read from own/msg/Half"));
}

fn files_error(reason: &str) -> slate_ros_messages::FileError {
    slate_ros_messages::FileError { location: String::new(), reason: reason.into() }
}

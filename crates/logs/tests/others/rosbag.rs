//! Recordings of ROS 1 and ROS 2 that a library of others has written.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use proptest::prelude::*;
use serde_json::{Value as Json, json};
use slate_bag::{Error, Selection, Value};
use slate_logs as logs;
use slate_logs::{Format, import};
use slate_ros_messages as ros;

use crate::files::{self, LENIENT, STRICT, folder, messages, write};
use crate::python::{python, run};

/// What the library has written, and a line for each message.
fn written() -> &'static (PathBuf, Vec<Json>) {
    static WRITTEN: OnceLock<(PathBuf, Vec<Json>)> = OnceLock::new();
    WRITTEN.get_or_init(|| {
        let folder = folder("rosbags");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/others/write_rosbags.py");
        let output = run(Command::new(python()).arg(script).arg(&folder), "others can't write recordings");
        let lines = String::from_utf8(output.stdout).unwrap();
        (folder, lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
    })
}

/// A value as JSON, as the script prints it.
fn tree(value: &ros::Value) -> Json {
    match value {
        ros::Value::Single(number) => float(f64::from(*number)),
        ros::Value::Double(number) => float(*number),
        ros::Value::Numbers(numbers) => numbers.iter().map(|number| tree(&number)).collect(),
        ros::Value::List(items) => items.iter().map(tree).collect(),
        ros::Value::Map(map) => {
            Json::Object(map.iter().map(|(name, value)| (name.into(), tree(value))).collect())
        }
        other => serde_json::to_value(other).unwrap(),
    }
}

fn float(number: f64) -> Json {
    if number.is_finite() { json!(number) } else { json!(number.to_string().to_lowercase()) }
}

/// The messages of a log are those that were written to it.
fn compare(bag: &str) {
    let (folder, lines) = written();
    let path = folder.join(bag);
    let mut found: Vec<_> = messages(&path)
        .into_iter()
        .map(|(time, topic, value)| match value {
            Value::Message(value) => (time, topic, tree(&value)),
            other => panic!("{topic}: {other}"),
        })
        .collect();
    let expected = lines.iter().filter(|line| line["bag"] == bag);
    let mut expected: Vec<_> = expected
        .map(|line| {
            (
                line["time"].as_u64().unwrap(),
                line["topic"].as_str().unwrap().to_owned(),
                line["value"].clone(),
            )
        })
        .collect();
    assert!(expected.len() >= 5, "{bag}: {}", expected.len());
    for messages in [&mut found, &mut expected] {
        messages.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
    }
    assert_eq!(found.len(), expected.len(), "{bag}");
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found, expected, "{bag}");
    }
}

#[test]
fn messages_of_all_types_of_ros_1_are_read_as_others_wrote_them() {
    for bag in ["none.bag", "bz2.bag", "lz4.bag"] {
        assert_eq!(logs::recognize(&written().0.join(bag)).unwrap(), Some(Format::Rosbag1), "{bag}");
        compare(bag);
    }
}

#[test]
fn a_folder_of_ros_2_is_one_recording_and_others_are_refused() {
    compare("bag2");
    let (folder, _) = written();
    assert_eq!(logs::recognize(&folder.join("bag2")).unwrap(), Some(Format::Rosbag2));
    let error = logs::open(folder.join("sqlite")).err().unwrap().to_string();
    assert!(
        error.contains("metadata.yaml`: its messages are kept as `sqlite3`")
            && error.contains("ros2 bag convert"),
        "{error}"
    );
    let hostile = files::folder("rosbag2-hostile");
    let about = |paths: &str| {
        write(
            &hostile,
            "metadata.yaml",
            format!(
                "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n{paths}"
            ),
        );
        logs::open(&hostile).err().unwrap().to_string()
    };
    for path in ["../secret.mcap", "/etc/passwd"] {
        let error = about(&format!("    - {path}\n"));
        assert!(error.contains(&format!("the file `{path}` is not in the folder")), "{error}");
    }
    assert!(about("    - missing.mcap\n").contains("missing.mcap` can't be read"));
    assert!(about("").contains("it names no files"));
    assert!(about("    - a.mcap\n  compression_mode: FILE\n").contains("packed as a whole"));
}

#[test]
fn a_damaged_recording_names_the_byte_and_is_read_on_request() {
    let (folder, _) = written();
    let bytes = std::fs::read(folder.join("none.bag")).unwrap();
    let own = files::folder("rosbag-damaged");
    let all = messages(&folder.join("none.bag")).len();
    // In the only chunk, and in the indexes behind it.
    for (cut, least) in [(bytes.len() / 3, 0), (bytes.len() - 10, all)] {
        let path = write(&own, "cut.bag", &bytes[..cut]);
        let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err();
        assert!(matches!(error, Error::Damaged { .. }), "{error}");
        assert!(error.to_string().contains("cut.bag` is damaged at byte"), "{error}");
        if least == 0 {
            // Of its only chunk nothing can be read.
            let error = import(&path, &own.join("x.mcap"), &LENIENT).unwrap_err().to_string();
            assert!(error.contains("cut.bag`: as a log of format rosbag1 it has no message"), "{error}");
            assert!(!own.join("x.mcap").exists());
            continue;
        }
        let (imported, messages) = files::import(&path, &LENIENT);
        assert!(imported.wrong == 1 && messages.len() >= least, "{imported:?}");
    }
    for text in ["#ROSBAG V1.2\n", "#ROSBAG V2.0"] {
        let path = write(&own, "old.bag", text);
        let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
        assert!(error.contains("old.bag`"), "{error}");
    }
}

#[test]
fn a_recording_cut_between_records_is_not_taken_for_whole() {
    let (folder, _) = written();
    let whole = std::fs::read(folder.join("none.bag")).unwrap();
    let own = files::folder("rosbag-unfinished");
    let length = |at: usize| 4 + u32::from_le_bytes(whole[at..at + 4].try_into().unwrap()) as usize;
    let mut ends = vec![13];
    while *ends.last().unwrap() < whole.len() {
        let at = *ends.last().unwrap();
        ends.push(at + length(at) + length(at + length(at)));
    }
    assert_eq!(ends.pop(), Some(whole.len()));
    let index = whole.windows(10).position(|part| part == b"index_pos=").unwrap() + 10;
    let index = index..index + 8;
    let begins = u64::from_le_bytes(whole[index.clone()].try_into().unwrap()) as usize;
    for end in ends.into_iter().filter(|end| *end <= begins) {
        let path = write(&own, "cut.bag", &whole[..end]);
        let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
        assert!(error.contains(&format!("damaged at byte {end}")), "{end}: {error}");
    }
    // As it is while it is written.
    let mut unfinished = whole[..begins].to_vec();
    unfinished[index].fill(0);
    let path = write(&own, "active.bag", &unfinished);
    let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
    assert!(error.contains("it was not closed"), "{error}");
    let (imported, found) = files::import(&path, &LENIENT);
    assert_eq!((imported.wrong, found.len()), (1, messages(&folder.join("none.bag")).len()));
}

#[test]
fn reading_goes_on_at_the_next_chunk_after_a_wrong_length() {
    let (folder, _) = written();
    let whole = std::fs::read(folder.join("none.bag")).unwrap();
    let own = files::folder("rosbag-resume");
    // The first record behind the head of the file, which has a length of its own, says a length that can't be.
    let head = 13;
    let length = |at: usize| 4 + u32::from_le_bytes(whole[at..at + 4].try_into().unwrap()) as usize;
    let first = head + length(head) + length(head + length(head));
    let chunk = &whole[first..];
    let twice = [&whole[..first], &[0xff, 0xff, 0xff, 0x7f], &[7; 300], chunk].concat();
    let path = write(&own, "resumed.bag", &twice);
    let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
    let next = first + 304;
    assert!(error.contains(&format!("a chunk that can be read begins at byte {next}")), "{error}");
    let (imported, found) = files::import(&path, &LENIENT);
    assert_eq!(imported.wrong, 1, "{imported:?}");
    assert_eq!(found.len(), messages(&folder.join("none.bag")).len());
    // Where no chunk follows, that is said.
    let path = write(&own, "lost.bag", [&whole[..first], &[0xff, 0xff, 0xff, 0x7f], &[7; 300]].concat());
    let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
    assert!(error.contains("nothing behind it can be read"), "{error}");
}

#[test]
fn a_recording_of_ros_becomes_a_log_of_carmen() {
    let (folder, _) = written();
    let path = folder.join("none.bag");
    let out = files::folder("rosbag-carmen").join("a.log");
    let told = logs::export_carmen(&path, &Selection::default(), &out).unwrap();
    assert_eq!((told.scans, told.odometry), (2, 2));
    let said = std::fs::read_to_string(&out).unwrap();
    assert!(said.lines().filter(|line| line.starts_with("ODOM ")).count() == 2, "{said}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn no_damage_makes_it_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        static SMALL: OnceLock<Vec<u8>> = OnceLock::new();
        let small = SMALL.get_or_init(|| std::fs::read(written().0.join("none.bag")).unwrap());
        let mut bytes = small.clone();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()).max(20));
        }
        let path = write(&files::folder("rosbag-any"), "a.bag", &bytes);
        let out = path.with_extension("mcap");
        match import(&path, &out, &LENIENT) {
            Ok(imported) => prop_assert_eq!(messages(&out).len() as u64, imported.messages),
            Err(error) => prop_assert!(error.to_string().contains("a."), "{}", error),
        }
    }
}

//! Files of the blackboard logger of Fawkes, written as a C compiler lays values out.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use proptest::prelude::*;
use slate_bag::Value;
use slate_logs as logs;
use slate_logs::{Format, import};

use crate::files::{self, LENIENT, STRICT, folder, lines, messages, write};
use crate::python::run;

fn written() -> &'static PathBuf {
    static WRITTEN: OnceLock<PathBuf> = OnceLock::new();
    WRITTEN.get_or_init(|| {
        let folder = folder("bblogger");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/others/write_bblogs.py");
        run(Command::new("python3").arg(script).arg(&folder), "this test needs Python");
        folder
    })
}

#[test]
fn values_of_either_byte_order_are_read() {
    for order in ["little", "big"] {
        let path = written().join(format!("motor-{order}.log"));
        assert_eq!(logs::recognize(&path).unwrap(), Some(Format::Bblogger));
        let said = lines(&messages(&path)).join("\n");
        for words in [
            "1300000000.750000000 /MotorInterface/Robotino { timestamp_sec = 1300000000, timestamp_usec = 7, motor_state = 0",
            "right_rpm = -7, rear_rpm = 0",
            "vy = 0.75",
            "controller_thread_name = \"Käthe\" }",
            "/MotorInterface/Robotino/odometry { pose = { x = 1.5, y = -2.5, theta = 0.25 }, twist = { linear = 0.5, angular = -0.125 } }",
        ] {
            assert!(said.contains(words), "{order}: `{words}` is missing in {said}");
        }
        for align in [4, 8] {
            let said = lines(&messages(&written().join(format!("place-{order}-{align}.log")))).join("\n");
            for words in [
                "frame = \"map\", visibility_history = -3, rotation = [0, 0, 0.6, 0.8], translation = [1, 2, 3], covariance = [0,",
                "parent = \"map\", child = \"ball\", translation = { x = 1, y = 2, z = 3 }, rotation = { x = 0, y = 0, z = 0.6, w = 0.8 }",
            ] {
                assert!(said.contains(words), "{order} {align}: `{words}` is missing in {said}");
            }
        }
    }
}

#[test]
fn sweeps_go_counter_clockwise_whichever_way_the_laser_turns() {
    for order in ["little", "big"] {
        let messages = messages(&written().join(format!("laser-{order}.log")));
        let scans: Vec<&Value> = messages
            .iter()
            .filter(|(_, topic, _)| topic == "/Laser360Interface/Laser front/scan")
            .map(|(_, _, value)| value)
            .collect();
        let at = |scan: &Value, beam: usize| scan.number(&format!("ranges/{beam}")).unwrap();
        assert_eq!(scans.len(), 2);
        // Nothing was seen in the first direction.
        assert_eq!([at(scans[0], 0), at(scans[0], 1), at(scans[0], 359)], [f64::INFINITY, 0.25, 89.75]);
        assert_eq!([at(scans[1], 0), at(scans[1], 1), at(scans[1], 359)], [f64::INFINITY, 89.75, 0.25]);
        assert!((scans[0].number("angle_increment").unwrap() - 0.017453292519943295).abs() < 1e-15);
    }
}

#[test]
fn unknown_interface_is_kept_as_bytes_and_reported() {
    let (imported, messages) = files::import(&written().join("own.log"), &STRICT);
    assert_eq!(imported.unread.keys().collect::<Vec<_>>(), ["the fields of OwnInterface, kept as bytes"]);
    // Its number is behind the time.
    assert_eq!(messages[0].2.number("data/16"), Some(7.0));
}

#[test]
fn a_cut_or_miscounting_file_is_refused_and_read_on_request() {
    let own = folder("bblogger-damaged");
    let bytes = std::fs::read(written().join("uncounted.log")).unwrap();
    assert_eq!(messages(&written().join("uncounted.log")).len(), 6);
    for (name, bytes, words, left) in [
        ("cut.log", &bytes[..bytes.len() - 1], "the file ends in a value", 4),
        (
            "counted.log",
            &std::fs::read(written().join("counted.log")).unwrap()[..],
            "it should have 5 values, and has 3",
            6,
        ),
    ] {
        let path = write(&own, name, bytes);
        let error = import(&path, &own.join("x.mcap"), &STRICT).unwrap_err().to_string();
        assert!(error.contains(&format!("{name}` is damaged at byte")) && error.contains(words), "{error}");
        let (imported, messages) = files::import(&path, &LENIENT);
        assert_eq!((imported.wrong, messages.len()), (1, left), "{name}");
    }
    for (place, byte, words) in
        [(7, 9, "it is of version 9"), (8, 3, "its byte order is"), (179, 0xff, "its values have")]
    {
        let mut wrong = bytes.clone();
        wrong[place] = byte;
        let path = write(&own, "head.log", &wrong);
        for options in [STRICT, LENIENT] {
            let error = import(&path, &own.join("x.mcap"), &options).unwrap_err().to_string();
            assert!(error.contains("head.log` is damaged at byte 0") && error.contains(words), "{error}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn no_damage_makes_it_panic(
        changes in prop::collection::vec((0..400_usize, any::<u8>()), 0..8),
        cut in 4..700_usize,
    ) {
        let mut bytes = std::fs::read(written().join("uncounted.log")).unwrap();
        for (place, byte) in changes {
            bytes[place.max(4)] = byte;
        }
        bytes.truncate(cut);
        let path = write(&folder("bblogger-any"), "a.log", &bytes);
        let out = path.with_extension("mcap");
        match import(&path, &out, &LENIENT) {
            Ok(imported) => prop_assert_eq!(messages(&out).len() as u64, imported.messages),
            Err(error) => prop_assert!(error.to_string().contains("a.log"), "{}", error),
        }
    }
}

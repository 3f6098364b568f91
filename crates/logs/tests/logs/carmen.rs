use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use proptest::prelude::*;
use slate_bag::{Selection, Value};
use slate_logs::{Format, export_carmen};

use crate::logs::files::{LENIENT, STRICT, folder, import, lines, messages, write};

/// A line of each kind, as CARMEN's own documentation lays them out.
const LOG: &str = "\
# CARMEN Logfile
# file format is one message per line
PARAM robot_frontlaser_offset 0.25 nohost 0
PARAM logger_note two words 1134863807.658747 b21 0.000001
SYNC start 1134863807.700000 b21 0.05
ODOM 1.5 -2.25 0.5 0.4 -0.1 0.01 1134863807.750000 b21 0.1
TRUEPOS 1.5 2.5 0.25 1.25 2.75 0.5 1134863807.760000 b21 0.11
FLASER 3 1.09 81.91 2.5 0.1 0.2 0.3 0.4 0.5 0.6 1134863807.800000 b21 0.15
RLASER 1 4.25 0 0 0 0 0 0 1134863807.800001 b21 0.15
LASER3 2 0.5 0.75 1134863807.850000 b21 0.2
RAWLASER1 0 -1.5707963 3.1415927 0.017453293 80 0.01 0 2 1.5 2 1 99.5 1134863807.900000 b21 0.25
ROBOTLASER1 2 -2.0 4.0 2.0 5.6 0.001 1 3 0.5 5.6 0.75 2 10 20 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1.1 1.2 1134863807.950000 b21 0.3
NEFF 14.5
";

fn number(value: &Value, path: &str) -> f64 {
    value.number(path).unwrap_or_else(|| panic!("{value} has no {path}"))
}

#[test]
fn each_line_of_a_log_becomes_the_values_that_it_says() {
    let folder = folder("carmen");
    let (imported, messages) = import(&write(&folder, "a.log", LOG), &STRICT);
    assert_eq!((imported.format, imported.wrong), (Format::Carmen, 0));
    assert_eq!(imported.unread.into_iter().collect::<Vec<_>>(), [("NEFF".to_owned(), 1)]);
    let said = lines(&messages).join("\n");
    for words in [
        "1134863807.658747000 /param { name = \"robot_frontlaser_offset\", value = \"0.25\" }",
        "1134863807.658747000 /param { name = \"logger_note\", value = \"two words\" }",
        "/transforms/laser_front { time = 1134863807658747000, parent = \"base_link\", child = \"laser_front\", \
         translation = { x = 0.25, y = 0, z = 0 }",
        "1134863807.700000000 /sync { tag = \"start\" }",
        "1134863807.750000000 /odom { pose = { x = 1.5, y = -2.25, theta = 0.5 }, twist = { linear = 0.4, angular = -0.1 } }",
        "1134863807.750000000 /odom/acceleration { acceleration = 0.01 }",
        "1134863807.760000000 /truepos/true_pose { x = 1.5, y = 2.5, theta = 0.25 }",
        "1134863807.760000000 /truepos/odometry_pose { x = 1.25, y = 2.75, theta = 0.5 }",
        "1134863807.800000000 /flaser/laser_pose { x = 0.1, y = 0.2, theta = 0.3 }",
        "1134863807.800000000 /flaser/robot_pose { x = 0.4, y = 0.5, theta = 0.6 }",
        "range_max = 80, ranges = [1.09, 81.91, 2.5] }",
        "1134863807.850000000 /laser3/scan",
        "1134863807.900000000 /rawlaser1/scan { angle_min = -1.5707963, angle_increment = 0.017453293, range_min = 0, \
         range_max = 80, ranges = [1.5, 2] }",
        "1134863807.900000000 /rawlaser1/device { laser_type = 0, field_of_view = 3.1415927, accuracy = 0.01, \
         remission_mode = 0, remissions = [99.5] }",
        "1134863807.950000000 /robotlaser1/scan { angle_min = -2, angle_increment = 2, range_min = 0, range_max = 5.6, \
         ranges = [0.5, 5.6, 0.75] }",
        "1134863807.950000000 /robotlaser1/motion { tv = 0.7, rv = 0.8, forward_safety_distance = 0.9, \
         side_safety_distance = 1.1, turn_axis = 1.2 }",
    ] {
        assert!(said.contains(words), "`{words}` is missing in\n{said}");
    }
}

/// Where the beams of a laser of the front go: the first one, the angle between two, and the longest range.
fn geometry(parameters: &str, beams: usize) -> (f64, f64, f64) {
    let folder = folder(&format!("carmen-geometry-{beams}-{}", parameters.len()));
    let ranges = "1 ".repeat(beams);
    let log = format!("{parameters}FLASER {beams} {ranges}0 0 0 0 0 0 5.5 host 0\n");
    let (_, messages) = import(&write(&folder, "a.log", log), &STRICT);
    let (_, _, scan) = messages.iter().find(|(_, topic, _)| topic == "/flaser/scan").unwrap();
    (number(scan, "angle_min"), number(scan, "angle_increment"), number(scan, "range_max"))
}

#[test]
fn fields_missing_in_old_lines_come_from_beams_and_parameters() {
    let degree = PI / 180.0;
    let close = |found: (f64, f64, f64), expected: (f64, f64, f64)| {
        let off = (found.0 - expected.0).abs() + (found.1 - expected.1).abs() + (found.2 - expected.2).abs();
        assert!(off < 1e-12, "{found:?} is not {expected:?}");
    };
    close(geometry("", 181), (-FRAC_PI_2, degree, 80.0));
    close(geometry("", 180), (-FRAC_PI_2, degree, 80.0));
    close(geometry("", 361), (-FRAC_PI_2, degree / 2.0, 80.0));
    close(geometry("", 360), (-FRAC_PI_2, degree / 2.0, 80.0));
    close(geometry("", 401), (-50.0 * degree, degree / 4.0, 80.0));
    close(geometry("", 91), (-FRAC_PI_2, 2.0 * degree, 80.0));
    close(geometry("", 1), (-FRAC_PI_2, PI, 80.0));
    close(geometry("PARAM robot_front_laser_max 50 nohost 0\n", 181), (-FRAC_PI_2, degree, 50.0));
    close(geometry("PARAM robot_rear_laser_max 50 nohost 0\n", 181), (-FRAC_PI_2, degree, 80.0));
    close(
        geometry("PARAM laser_front_laser_resolution 0.5 nohost 0\n", 181),
        (-45.0 * degree, degree / 2.0, 80.0),
    );
    // It would go round more than once.
    close(geometry("PARAM laser_front_laser_resolution 90 nohost 0\n", 181), (-FRAC_PI_2, degree, 80.0));
}

#[test]
fn a_wrong_line_is_named_and_skipped_only_on_request() {
    let folder = folder("carmen-wrong");
    let good = "ODOM 1 2 3 0 0 0 1.5 host 1.5\n";
    for (line, words) in [
        ("ODOM 1 2 x 0 0 0 1.5 host 1.5", "`x` should be the pose, a number"),
        ("ODOM 1 2 3 0 0 0 1.5", "it ends where the host should stand"),
        ("ODOM 1 2 3 0 0 0 1.5 host 1.5 7", "`7` stands behind its end"),
        ("ODOM 1 2 3 0 0 0 -1.5 host 1.5", "`-1.5` should be the time at which it was sent, seconds from 0"),
        ("ODOM 1 2 3 0 0 0 1e300 host 1.5", "`1e300` should be the time"),
        ("FLASER 3 1 2", "it should have 3 ranges, and has 2"),
        ("FLASER 99999999999 1 2", "it should have 99999999999 ranges, and has 2"),
        ("FLASER -1 1 2", "`-1` should be how many ranges follow"),
        ("FLASER 2 1 two 0 0 0 0 0 0 1 host 1", "`two` should be number 1 of 2 ranges"),
        ("FLASER 2 1 1e40 0 0 0 0 0 0 1 host 1", "`1e40` should be number 1 of 2 ranges"),
        ("ODOM 1e400 0 0 0 0 0 1 host 1", "and is too large"),
        ("RAWLASER1 0 0 0 0 0 0 0 1 1.5 1 x 1 host 1", "`x` should be number 0 of 1 remissions"),
        ("PARAM lonely", "it should have a value, a host"),
        ("SYNC", "it ends where a tag should stand"),
    ] {
        let path = write(&folder, "a.log", format!("{good}# fine\n{line}\n{good}"));
        let error = slate_logs::import(&path, &folder.join("x.mcap"), &STRICT).unwrap_err().to_string();
        assert!(error.contains("a.log`, line 3: ") && error.contains(words), "{line}: {error}");
        assert!(!folder.join("x.mcap").exists());
        let (imported, messages) = import(&path, &LENIENT);
        assert_eq!((imported.wrong, messages.len()), (1, 4), "{line}");
        assert!(imported.wrongs[0].contains(words), "{line}: {:?}", imported.wrongs);
    }
    let path = write(&folder, "a.log", [good.as_bytes(), b"ODOM \xff\n", good.as_bytes()].concat());
    let (imported, _) = import(&path, &LENIENT);
    assert!(imported.wrongs[0].contains("line 2: it is not UTF-8 from byte 5 on"), "{:?}", imported.wrongs);
    let long = format!("{good}FLASER 1 {}\n{good}", "1 ".repeat(600_000));
    let (imported, messages) = import(&write(&folder, "a.log", long), &LENIENT);
    assert!(imported.wrongs[0].contains("line 2: it has more than 1048576 bytes"), "{:?}", imported.wrongs);
    assert_eq!(messages.len(), 4, "what follows a line that is too long is read");
}

fn exported(path: &Path) -> String {
    let out = path.with_extension("exported.log");
    export_carmen(path, &Selection::default(), &out).unwrap();
    std::fs::read_to_string(out).unwrap()
}

/// The lines of a log, without comments and without the time at which they were logged.
fn log_fields(log: &str) -> Vec<Vec<&str>> {
    let lines = log.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.rsplit_once(' ').unwrap().0.split(' ').collect()).collect()
}

#[test]
fn carmen_log_round_trips() {
    let folder = folder("carmen-again");
    let path = write(&folder, "a.log", LOG);
    let again = exported(&path);
    let mut expected: Vec<String> =
        LOG.lines().filter(|line| !line.starts_with("NEFF")).map(String::from).collect();
    // What the old form does not say is said.
    expected[2] = "PARAM robot_frontlaser_offset 0.25 1134863807.658747 b21 0".into();
    for line in &mut expected {
        *line =
            line.replace("LASER3 2 0.5 0.75", "RAWLASER3 2 0.5 0.75").replace(" -2.0 4.0 2.0 ", " -2 4 2 ");
    }
    let expected = expected.join("\n");
    let (expected, found) = (log_fields(&expected), log_fields(&again));
    for (expected, found) in expected.iter().zip(&found) {
        // Its line says more now.
        if expected[0] != "RAWLASER3" {
            assert_eq!(expected, found);
        }
    }
    assert_eq!(expected.len(), found.len(), "{again}");
    assert_eq!(
        messages(&path).len(),
        messages(&write(&folder, "b.log", &again)).len() - 1,
        "but for one device"
    );
}

#[test]
fn a_sweep_before_odometry_is_raw_and_keeps_its_laser_number() {
    let folder = folder("carmen-export");
    let path = write(&folder, "a.log", "LASER4 2 1.5 2.5 1.25 host 0\nODOM 1 2 3 0 0 0 1.5 host 1.5\n");
    let said = exported(&path);
    assert!(said.contains("\nRAWLASER4 99 -1.5707963267948966 3.141592653589793 3.141592653589793 80 0 0 2 1.5 2.5 0 1.250000 host 0.000000\n"), "{said}");
    assert!(said.contains("\nODOM 1 2 3 0 0 0 1.500000 host 0.250000\n"), "{said}");
}

fn decimal() -> impl Strategy<Value = f64> {
    prop_oneof![-1e6..1e6_f64, any::<f64>().prop_filter("a log has no such number", |n| n.is_finite())]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn numbers_survive_reading_and_writing(
        pose in prop::collection::vec(decimal(), 6),
        ranges in prop::collection::vec(prop_oneof![0.0..100.0_f32, any::<f32>().prop_filter("nor such a one", |n| n.is_finite())], 0..40),
        poses in prop::collection::vec(decimal(), 6),
        time in 0..u64::MAX / 2_000,
    ) {
        let folder = folder("carmen-numbers");
        let join = |numbers: &[f64]| numbers.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" ");
        let micro = format!("{}.{:06}", time / 1_000_000, time % 1_000_000);
        let seen: Vec<_> = ranges.iter().map(|n| n.to_string()).collect();
        let odometry = format!("ODOM {} {micro} host 0", join(&pose));
        let words = [vec!["FLASER".into(), ranges.len().to_string()], seen, vec![join(&poses), micro, "host 0\n".into()]].concat();
        let log = format!("{odometry}\n{}", words.join(" "));
        let path = write(&folder, "a.log", &log);
        let (_, messages) = import(&path, &STRICT);
        for (place, expected) in ["pose/x", "pose/y", "pose/theta", "twist/linear", "twist/angular"].iter().zip(&pose) {
            prop_assert_eq!(number(&messages[1].2, place), *expected);
        }
        for (i, range) in ranges.iter().enumerate() {
            prop_assert_eq!(number(&messages[4].2, &format!("ranges/{i}")), f64::from(*range));
        }
        prop_assert_eq!(messages[4].0, time * 1000);
        let again = exported(&path);
        prop_assert_eq!(log_fields(&again), log_fields(&log));
    }

    #[test]
    fn no_bytes_make_it_panic(lines in prop::collection::vec(
        ("(PARAM|ODOM|SYNC|TRUEPOS|[FR]LASER|RAWLASER1|ROBOTLASER2|LASER3|NEFF|#)", "( (-?[0-9]{1,3}(\\.[0-9])?|nan|inf|host|é|[ -~]{0,4})){0,16}"),
        0..12,
    )) {
        let folder = folder("carmen-any");
        let text: String = lines.iter().map(|(name, rest)| format!("{name}{rest}\n")).collect();
        // One line is right, as a log without a message is refused.
        let path = write(&folder, "a.log", format!("# CARMEN Logfile\nSYNC a 1 host 0\n{text}"));
        let (imported, messages) = import(&path, &LENIENT);
        let others: u64 = imported.unread.values().sum();
        prop_assert!(imported.wrong + others <= lines.len() as u64);
        prop_assert!(messages.len() as u64 + imported.wrong + others + text.matches('#').count() as u64 >= lines.iter().filter(|(name, _)| name != "#").count() as u64);
        exported(&path.with_extension("imported.mcap"));
    }
}

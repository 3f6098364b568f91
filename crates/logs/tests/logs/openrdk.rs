use crate::logs::files::{LENIENT, STRICT, folder, import, lines, write};

const LOG: &str = "\
ODOM 1.5 2.25 0.1 1.4 2.2 0.11 86399900 rescue 86399905
FLASER 3 1.5 2 80 1.5 2.25 0.1 1.4 2.2 0.11 86399950 rescue 86399955
VICTIM 1 2
PANTILT 0.5 -0.25 1.5 2.25 0.1 1.4 2.2 0.11 50 rescue 55
";

#[test]
fn lines_become_values_and_a_run_goes_on_over_midnight() {
    let folder = folder("openrdk");
    let (imported, messages) = import(&write(&folder, "a.log", LOG), &STRICT);
    assert_eq!(imported.unread.into_iter().collect::<Vec<_>>(), [("VICTIM".to_owned(), 1)]);
    let said = lines(&messages).join("\n");
    for words in [
        "86399.900000000 /odom/odometry_pose { x = 1.5, y = 2.25, theta = 0.1 }",
        "86399.900000000 /odom/estimated_pose { x = 1.4, y = 2.2, theta = 0.11 }",
        "86399.950000000 /flaser/scan { angle_min = -0.026179938779914945, angle_increment = 0.017453292519943295, \
         range_min = 0.02, range_max = 80, ranges = [1.5, 2, 80] }",
        "86400.050000000 /pantilt { pan = 0.5, tilt = -0.25 }",
    ] {
        assert!(said.contains(words), "`{words}` is missing in\n{said}");
    }
}

#[test]
fn a_wrong_line_is_named_and_skipped_only_on_request() {
    let folder = folder("openrdk-wrong");
    for (line, words) in [
        (
            "ODOM 1 2 3 4 5 6 86400001 host 0",
            "`86400001` should be the time of the values, milliseconds after midnight",
        ),
        ("ODOM 1 2 3 4 5 6 1.5 host 0", "`1.5` should be the time of the values"),
        ("PANTILT 1 2 3", "it ends where the pose by odometry should stand"),
        ("FLASER 2 1 2 3 4 5 6 7 8 9 10 host 11", "`host` should be the time at which they were sent"),
    ] {
        // Enough lines before it that the log is known by them.
        let good = LOG.lines().next().unwrap();
        let path = write(&folder, "a.log", format!("{}{line}\n", format!("{good}\n").repeat(60)));
        let error = slate_logs::import(&path, &folder.join("x.mcap"), &STRICT).unwrap_err().to_string();
        assert!(error.contains("a.log`, line 61: ") && error.contains(words), "{line}: {error}");
        let (imported, messages) = import(&path, &LENIENT);
        assert_eq!((imported.wrong, messages.len()), (1, 120), "{line}");
    }
}

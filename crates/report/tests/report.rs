//! The report of a run on the disk, and its summary.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use common::{scene, summary, trajectory};
use slate_report::{Error, Outcome, Report, Route, Summary};
use std::{fs, path::PathBuf};

const FILES: [&str; 7] = [
    "animation.svg",
    "scene.json",
    "scene.svg",
    "summary.json",
    "timeline.svg",
    "trajectory.csv",
    "trajectory.svg",
];

/// An empty place for one test.
fn place(name: &str) -> PathBuf {
    let place = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("record-{name}"));
    if place.exists() {
        fs::remove_dir_all(&place).unwrap();
    }
    fs::create_dir_all(&place).unwrap();
    place
}

fn write(summary: &Summary, directory: &std::path::Path) -> Result<(), Error> {
    let trajectory = trajectory(&[Some(Route::Deliberative), Some(Route::Reactive)]);
    Report { summary, scene: &scene(), trajectory: &trajectory }.write(directory)
}

fn names(directory: &std::path::Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn report_makes_the_directory_and_replaces_what_is_there() {
    let directory = place("replace").join("runs/exp1-1");
    write(&summary(1), &directory).unwrap();
    write(&Summary { outcome: Outcome::TimedOut, ..summary(2) }, &directory).unwrap();
    assert_eq!(names(&directory), FILES);
    let text = fs::read_to_string(directory.join("summary.json")).unwrap();
    let read: Summary = serde_json::from_str(&text).unwrap();
    assert_eq!(read, Summary { outcome: Outcome::TimedOut, ..summary(2) });
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let file = place("unwritable").join("file");
    fs::write(&file, "in the way").unwrap();
    let directory = file.join("exp1-1");
    let error = write(&summary(1), &directory).unwrap_err();
    assert!(matches!(&error, Error::Write { path, .. } if *path == directory));
    let message = error.to_string();
    assert!(message.starts_with(&format!("cannot write {}: ", directory.display())), "{message}");
}

#[test]
fn a_file_that_cannot_be_replaced_is_named_and_left_whole() {
    let directory = place("blocked");
    fs::create_dir_all(directory.join("trajectory.csv/in the way")).unwrap();
    let error = write(&summary(1), &directory).unwrap_err();
    assert!(matches!(&error, Error::Write { path, .. } if path.ends_with("trajectory.csv")), "{error}");
    assert_eq!(names(&directory), ["trajectory.csv"]);
}

/// Every write to `/dev/full` fails like one to a full disk.
#[cfg(target_os = "linux")]
#[test]
fn full_disk_is_reported_and_earlier_report_stays() {
    let directory = place("full");
    write(&summary(1), &directory).unwrap();
    let before = fs::read(directory.join("trajectory.svg")).unwrap();
    std::os::unix::fs::symlink("/dev/full", directory.join("timeline.svg.partial")).unwrap();
    let changed = Summary { outcome: Outcome::Failed, ..summary(9) };
    let error = write(&changed, &directory).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("timeline.svg") && message.contains("No space left"), "{message}");
    assert_eq!(names(&directory), FILES);
    assert_eq!(fs::read(directory.join("trajectory.svg")).unwrap(), before);
}

#[test]
fn summary_is_one_line_of_json_with_the_promised_fields() {
    let line = summary(3).json_line().unwrap();
    assert!(!line.contains('\n'));
    let value: serde_json::Value = serde_json::from_str(&line).unwrap();
    for field in [
        "example",
        "seed",
        "mode",
        "conditions",
        "outcome",
        "sim_time_s",
        "wall_time_s",
        "path_length_m",
        "shortest_path_m",
        "collisions",
        "collisions_caused",
        "min_clearance_m",
        "route_switches",
        "reflexes",
        "ticks",
        "digest",
    ] {
        assert!(!value[field].is_null(), "{field}");
    }
    assert_eq!(value["outcome"], "goal_reached");
    let nothing_near = Summary { min_clearance_m: None, ..summary(3) };
    let read: Summary = serde_json::from_str(&nothing_near.json_line().unwrap()).unwrap();
    assert_eq!(read, nothing_near);
}

#[test]
fn summary_tells_what_happened_first_then_figures_with_units() {
    let failed =
        Summary { outcome: Outcome::Failed, message: Some("module planner hangs".to_owned()), ..summary(3) };
    let text = failed.to_string();
    assert_eq!(text.lines().next(), Some("exp1, seed 3: failed after 20.0 s: module planner hangs"));
    assert!(text.contains("2.00 m") && text.contains("0.200 m") && text.contains("400.0 times real time"));
    // Aligned: every value starts in the same column.
    assert!(text.lines().skip(1).all(|line| &line[17..18] == " " && &line[18..19] != " "), "{text}");
}

#[test]
fn a_summary_shows_each_figure_with_its_unit() {
    let run = Summary {
        figures: [("gap_in_band".to_owned(), 0.9714), ("corners_reached".to_owned(), 4.0)].into(),
        robots: [("r3".to_owned(), [("path_length".to_owned(), 12.5)].into())].into(),
        units: [("path_length".to_owned(), "m".to_owned())].into(),
        ..summary(1)
    };
    let text = run.to_string();
    for line in ["gap in band     0.971", "corners reached 4", "r3: path length 12.500 m"] {
        assert!(text.lines().any(|shown| shown.trim() == line), "{line} is missing: {text}");
    }
    let read: Summary = serde_json::from_str(&run.json_line().unwrap()).unwrap();
    assert_eq!(read, run);
    assert!(!summary(1).json_line().unwrap().contains("figures"), "there is nothing to say of none");
}

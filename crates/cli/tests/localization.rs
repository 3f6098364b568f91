//! The robot that drives by a map in which it finds its pose.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::fs;
use std::path::Path;

use common::{folder, json, slate};
use serde_json::Value;
use slate::module::math;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/localization/localization.toml");

/// A run that ends when the robot is at its goal.
fn run(folder: &Path, report: &str, more: &[&str]) -> Value {
    let mut all = vec!["run", EXAMPLE, "--headless", "--json", "--set", "until=goal", "--out", report];
    all.extend(more);
    let output = slate(folder, &all);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    json(&output)
}

/// Time, x and y of the robot in a report.
fn trajectory(file: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(file).unwrap();
    let rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|row| row[1] == "r2");
    rows.map(|row| [row[0], row[2], row[3]].map(|number| number.parse().unwrap())).collect()
}

#[test]
fn a_robot_drives_by_a_pose_within_10_cm_of_its_true_one() {
    let folder = folder("localization");
    let first = run(&folder, "true", &[]);
    assert_eq!(first["collisions"], 0, "{first}");
    // The same run with its estimates in the report, and with threads.
    let estimated = ["--set", "report.robots.r2.pose=/r2/amcl/change/pose", "--workers", "2"];
    let again = run(&folder, "estimated", &estimated);
    assert_eq!(first["digest"], again["digest"]);
    let [truth, estimates] =
        ["true", "estimated"].map(|report| trajectory(&folder.join(report).join("trajectory.csv")));
    // The initial pose is approximate; the first scans correct it.
    let mut count = 0;
    for [time, x, y] in truth.iter().filter(|[time, ..]| *time > 2.0) {
        if let Some([_, other_x, other_y]) = estimates.iter().find(|[other, ..]| other == time) {
            assert!(math::hypot(x - other_x, y - other_y) < 0.1, "at {time} s");
            count += 1;
        }
    }
    assert!(count > 500, "{count}");
}

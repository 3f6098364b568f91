//! Algorithms are measured on data in files.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;

use serde_json::Value;

use crate::common::{Running, text};

const MAP: &str = "type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n";

#[test]
fn a_planner_that_misses_a_goal_is_told_by_figures_and_exit_code() {
    let running = Running::new("evaluate");
    let data = running.folder().join("data");
    fs::create_dir(&data).unwrap();
    fs::write(data.join("tiny.map"), MAP).unwrap();
    // The shortest path has 4 steps.
    fs::write(data.join("tiny.map.scen"), "version 1\n0\ttiny.map\t3\t2\t0\t1\t2\t1\t3.5\n").unwrap();
    let output = running.call(&["evaluate", "planning", "--data", "data"]);
    assert_eq!(output.status.code(), Some(7), "{output:?}");
    let lines = text(&output.stdout);
    assert!(lines.starts_with("tiny (3 x 2 cells)\n"), "{lines}");
    let wrong = lines.lines().find(|line| line.contains("lengths that are not the file's")).unwrap();
    assert!(wrong.ends_with("1  (at most 0, NOT reached)"), "{wrong}");
    let output = running.call(&["evaluate", "planning", "--data", "data", "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["schema"], "slate.evaluation/1");
    let figure = &document["evaluations"][0]["figures"][1];
    assert_eq!((&figure["value"], &figure["goal"]["at_most"]), (&1.0.into(), &0.0.into()));
    running.fails(2, &["evaluate", "planning", "--data", "nowhere"], &["nowhere: can't be read"]);
}

//! Algorithms are measured on data in files.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;

use serde_json::Value;

use crate::common::{Running, text};

const MAP: &str = "type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n";

#[test]
fn a_planner_that_misses_a_goal_gets_figures_and_an_exit_code() {
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

#[test]
fn a_local_planner_is_measured_in_worlds_of_cylinders() {
    let running = Running::new("evaluate_local");
    let data = running.folder().join("data");
    fs::create_dir(&data).unwrap();
    // Beside the straight path.
    fs::write(data.join("cylinders.csv"), "world,x,y\n3,-1.4,6.0\n3,-3.1,9.0\n").unwrap();
    fs::write(data.join("path_lengths.json"), r#"{"3": 10.0}"#).unwrap();
    let evaluate = ["evaluate", "local_planning", "--data", "data", "--planner", "mppi"];
    let output = running.call(&evaluate);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let lines = text(&output.stdout);
    assert!(lines.starts_with("MPPI in BARN worlds, own physics\n"), "{lines}");
    let success = lines.lines().find(|line| line.contains("success")).unwrap();
    assert!(success.ends_with("1  (at least 0.95)"), "{success}");
    // Four walls around the start.
    let walls: String = (-12..=12)
        .map(|k| 0.1 * f64::from(k))
        .flat_map(|k| [[k, 1.2], [k, -1.2], [1.2, k], [-1.2, k]])
        .map(|[x, y]| format!("3,{},{}\n", x - 2.25, y + 3.0))
        .collect();
    fs::write(data.join("cylinders.csv"), format!("world,x,y\n{walls}")).unwrap();
    let output = running.call(&["evaluate", "local_planning", "--data", "data", "--planner", "dwa"]);
    assert_eq!(output.status.code(), Some(7), "{output:?}");
    let lines = text(&output.stdout);
    assert!(lines.contains("NOT reached") && lines.contains("world 3: "), "{lines}");
    assert!(!lines.contains("NaN"), "{lines}");
    running.fails(2, &["evaluate", "local_planning", "--data", "nowhere"], &["can't be read"]);
}

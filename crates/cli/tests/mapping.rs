//! The robot that maps and goes by its map.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;

use common::{Running, folder, json, slate};
use serde_json::Value;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/mapping/mapping.toml");

/// A run that ends when the robot is at its goal.
fn run(folder: &Path, more: &[&str]) -> Value {
    let mut all = vec!["run", EXAMPLE, "--headless", "--json", "--out", "report"];
    all.extend(["until=goal"].iter().chain(more).flat_map(|set| ["--set", set]));
    let output = slate(folder, &all);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    json(&output)
}

#[test]
fn the_robot_circles_the_mapped_box_and_runs_repeat() {
    let folder = folder("mapping");
    let first = run(&folder, &[]);
    assert_eq!(first["collisions"], 0, "{first}");
    let again = run(&folder, &[]);
    assert!(first["digest"].as_str().unwrap().len() == 16 && first["digest"] == again["digest"], "{again}");
    let other = run(&folder, &["agent.seed=7"]);
    assert_ne!(first["digest"], other["digest"]);
}

#[test]
fn without_a_mission_it_says_that_it_runs_until_it_is_stopped() {
    let mut running = Running::new("mapping-open");
    running.start("mapping", &["run", EXAMPLE, "--headless", "--rate", "1"]);
    running.interrupt();
    let output = running.finish();
    let said = common::text(&output.stderr);
    assert!(said.contains("has no [mission]: the agent runs until Ctrl-C"), "{said}");
}

#[test]
fn messages_are_checked_before_sending_and_then_answered() {
    let mut running = Running::new("send");
    running.start("mapping", &["run", EXAMPLE, "--headless", "--rate", "1"]);
    let url = "/r2/occupancy_mapper/strokes";
    let stroke = r#"{"width": 0.1, "mark": "OCCUPIED", "points": [{"x": 1.0, "y": 1.0}]}"#;
    let undo = r#"{"width": 0.1, "mark": "UNDO", "points": []}"#;
    let nothing = ["refuses the message: invalid stroke: no stroke left to undo", "one that it takes"];
    running.fails(5, &["send", url, undo], &nothing);
    assert_eq!(running.done(&["send", url, stroke, "--dry-run"]), "the message is valid\n");
    running.fails(5, &["send", url, undo], &nothing);
    assert_eq!(running.done(&["send", url, stroke]), "done\n");
    let said: Value = serde_json::from_str(&running.done(&["send", url, undo, "--json"])).unwrap();
    assert_eq!((&said["schema"], &said["status"]), (&"slate.send/1".into(), &"done".into()));
    running.fails(5, &["send", url, undo], &nothing);
    let stroke_in_toml = r#"{ width = 0.1, mark = "OCCUPIED", points = [{ x = 1.0, y = 1.0 }] }"#;
    assert_eq!(running.done(&["send", url, stroke_in_toml, "--dry-run"]), "the message is valid\n");

    running.fails(5, &["send", url, r#"{"width": 0.1, "mark": "OCCUPIED"}"#], &["lacks points", "MapStroke"]);
    running.fails(5, &["send", url, &stroke.replace("0.1", "\"wide\"")], &["`MapStroke/width` is f64"]);
    running.fails(4, &["send", url, &stroke.replace("width", "widht")], &["`widht`", "width"]);
    running.fails(
        2,
        &["send", url, "{width}"],
        &["is not a message", "slate send /r2/occupancy_mapper/strokes '{ x = 1.0, y = 0.0 }'"],
    );
    running.fails(5, &["send", "/r2/occupancy_mapper/change", stroke], &["takes no messages", "slate set"]);
    running.fails(4, &["send", "/r2/occupancy_mapper/stroke", stroke], &["strokes"]);
}

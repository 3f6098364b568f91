//! The robot that maps and goes by its map.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use std::path::Path;

use common::{folder, json, slate};
use serde_json::Value;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/mapping/mapping.toml");

/// A run that ends when the robot is at its goal, or 40 s after its start.
fn run(folder: &Path, more: &[&str]) -> Value {
    let mut all = vec!["run", EXAMPLE, "--headless", "--json", "--out", "report"];
    let ends = ["modules.referee.params.tolerance=0.15", "modules.referee.params.time_limit=40.0"];
    all.extend(ends.iter().chain(more).flat_map(|set| ["--set", set]));
    let output = slate(folder, &all);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    json(&output)
}

#[test]
fn it_goes_round_the_box_that_it_has_mapped_and_each_run_is_the_same() {
    let folder = folder("mapping");
    let first = run(&folder, &[]);
    assert_eq!(first["collisions"], 0, "{first}");
    let again = run(&folder, &[]);
    assert!(first["digest"].as_str().unwrap().len() == 16 && first["digest"] == again["digest"], "{again}");
    let other = run(&folder, &["agent.seed=7"]);
    assert_ne!(first["digest"], other["digest"]);
}

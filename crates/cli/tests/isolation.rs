//! A whole robot out of processes: whether its modules are isolated changes nothing that it does.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::process::Command;

/// How a run of EXP1 ended, and its digest.
fn run(folder: &str, sets: &[String]) -> (Option<i32>, String) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    std::fs::create_dir_all(&folder).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_slate"))
        .args(["run", "exp1", "--headless", "--json"])
        .args(sets.iter().flat_map(|set| ["--set", set]))
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let summary: serde_json::Value = serde_json::from_str(text.lines().last().unwrap_or_default())
        .unwrap_or_else(|_| panic!("{output:?}"));
    (output.status.code(), summary["digest"].as_str().unwrap().to_owned())
}

#[test]
fn exp1_does_the_same_with_every_module_in_a_process_of_its_own() {
    let blocks = [
        "range_monitor",
        "position_monitor",
        "orientation_monitor",
        "pass_range",
        "pass_position",
        "pass_orientation",
        "knowledge",
        "planner",
        "avoid_obstacle",
        "execute",
    ];
    let mut sets: Vec<_> =
        blocks.iter().map(|block| format!("robots.r2.modules.{block}.isolated=true")).collect();
    sets.extend(["simulator", "referee"].map(|module| format!("modules.{module}.isolated=true")));
    let isolated = run("isolated", &sets);
    assert_eq!(isolated.0, Some(0));
    assert_eq!(isolated, run("linked-in", &[]));
}

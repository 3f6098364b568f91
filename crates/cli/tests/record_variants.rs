//! Recorded runs whose configuration has variants, or changes by itself, and which are made again.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::path::Path;

use crate::common::{Running, folder, slate, text};

const RECORD: [&str; 4] = ["--set", "record.enabled=true", "--out", "here"];

/// Repeats the recorded run, which must be identical.
#[track_caller]
fn is_identical(folder: &Path) {
    let output = slate(folder, &["replay", "--verify", "here/run.mcap"]);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(said.starts_with("identical, ") && output.status.code() == Some(0), "{said}");
}

#[test]
fn a_setting_above_a_variant_holds_when_the_run_is_made_again() {
    let folder = folder("record-variant");
    let speed = "modules.\"r2/planner\".params.max_linear_velocity=0.05";
    let limit = "modules.referee.params.time_limit=3";
    let run = ["run", "exp1", "--headless", "--set", "controller=rocs", "--set", speed, "--set", limit];
    slate(&folder, &[&run[..], &RECORD].concat());
    is_identical(&folder);
}

#[test]
fn a_variant_that_is_left_during_the_run_is_left_again() {
    let mut running = Running::new("record-variant-left");
    let run = ["run", "exp1", "--headless", "--set", "pace=robots", "--set", "controller=rocs"];
    let endless = [
        "--set",
        "modules.referee.params.time_limit=20.0",
        "--set",
        "modules.referee.params.goal_tolerance=0.0",
        "--rate",
        "4",
    ];
    running.start("exp1", &[&run[..], &RECORD, &endless].concat());
    running.done(&["config", "set", "pace=default", "controller=slate"]);
    running.finish();
    is_identical(running.folder());
}

#[test]
fn a_modules_request_in_the_last_cycle_is_replayed() {
    let folder = folder("record-last-change");
    let run = ["run", "suave", "--headless", "--rate", "max", "--set", "controller=random", "--seed", "3"];
    slate(&folder, &[&run[..], &RECORD].concat());
    is_identical(&folder);
}

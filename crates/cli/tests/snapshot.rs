//! A run that is frozen and continues in another process is the run that went straight through, bit for bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;

use common::{Running, exp1, folder, slate};
use serde_json::Value;

/// What a run has left: its summary but for the wall clock, and its files but for the picture of the timing.
fn left(folder: &Path, arguments: &[&str]) -> (Value, String, String) {
    let (mut summary, code) = exp1(folder, arguments);
    assert!(matches!(code, Some(0 | 1)), "{summary}");
    summary.as_object_mut().unwrap().remove("wall_time_s");
    let report = folder.join("runs/exp1-3");
    let read = |name: &str| std::fs::read_to_string(report.join(name)).unwrap();
    let written = (summary, read("trajectory.csv"), read("timeline.svg"));
    std::fs::remove_dir_all(folder.join("runs")).unwrap();
    written
}

const LIMIT: &str = "modules.referee.params.time_limit=60.0";

#[test]
fn sixty_seconds_are_thirty_and_thirty_in_another_process() {
    let folder = folder("snapshot-bits");
    // A mission that does not end before its time is up.
    let far = ["--seed", "3", "--set", LIMIT, "--set", "modules.referee.params.goal_tolerance=0.0"];
    let straight = left(&folder, &far);
    assert_eq!(straight.0["sim_time_s"].as_f64().map(f64::round), Some(60.0));
    for (at, workers) in [("20ms", "0"), ("1.7s", "0"), ("13.3s", "2"), ("30s", "0")] {
        let at = format!("snapshot.at=\"{at}\"");
        let mut arguments = far.to_vec();
        arguments.extend(["--set", &at, "--set", "snapshot.file=half.snapshot", "--workers", workers]);
        assert_eq!(left(&folder, &arguments), straight, "a snapshot changes nothing: {at}");
        let run = ["run", "--headless", "--json", "--resume", "half.snapshot", "--workers", workers];
        let output = slate(&folder, &run);
        let report = folder.join("runs/exp1-3");
        let mut summary = common::json(&output);
        summary.as_object_mut().unwrap().remove("wall_time_s");
        assert_eq!(summary, straight.0, "{at}");
        let read = |name: &str| std::fs::read_to_string(report.join(name)).unwrap();
        assert_eq!(read("trajectory.csv"), straight.1, "{at}");
        assert_eq!(read("timeline.svg"), straight.2, "{at}");
    }
}

#[test]
fn a_running_agent_is_frozen_and_goes_back() {
    let mut running = Running::new("snapshot");
    // In real time, so that it is still there.
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1", "--seed", "3"]);
    let ticks = |running: &Running| running.read("exp1", "/referee/timing/ticks").as_u64().unwrap_or(0);
    // It can be reached before its first cycle.
    common::wait_for("it runs", || ticks(&running) > 0);
    let said = running.done(&["snapshot", "save", "here.snapshot"]);
    assert!(said.contains("here.snapshot has agent exp1 at"), "{said}");
    let info: Value =
        serde_json::from_str(&running.done(&["snapshot", "info", "here.snapshot", "--json"])).unwrap();
    let cycle = info["cycle"].as_u64().unwrap();
    assert!(cycle > 0 && info["modules"].as_array().unwrap().len() > 10, "{info}");
    let text = running.done(&["snapshot", "info", "here.snapshot", "--configuration"]);
    assert!(text.contains("agent.seed = 3"), "{text}");
    // It has gone on meanwhile, and goes back.
    while ticks(&running) < cycle + 20 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let said = running.done(&["snapshot", "load", "here.snapshot"]);
    assert!(said.contains(&format!("after cycle {cycle}")), "{said}");
    assert!(running.folder().join("here.snapshot").is_file());
    // What does not fit is refused, and the agent continues.
    let whole = std::fs::read(running.folder().join("here.snapshot")).unwrap();
    std::fs::write(running.folder().join("half.snapshot"), &whole[..whole.len() / 2]).unwrap();
    running.fails(
        5,
        &["snapshot", "load", "half.snapshot"],
        &["half.snapshot", "not a complete snapshot", "help"],
    );
    running.fails(
        5,
        &["snapshot", "save", "no-folder/x.snapshot"],
        &["no-folder/x.snapshot", "folder that exists"],
    );
    running.fails(2, &["snapshot", "info", "missing.snapshot"], &["missing.snapshot"]);
    running.fails(
        2,
        &["run", "exp1", "--headless", "--seed", "4", "--resume", "here.snapshot"],
        &["agent.seed is 4 here and 3 in it", "--set 'agent.seed=3'"],
    );
    running.fails(
        2,
        &["run", "--headless", "--resume", "here.snapshot", "--set", "controller = rocs"],
        &["`--set controller = rocs` has no effect"],
    );
    running.fails(2, &["run", "--headless", "--resume", "half.snapshot"], &["half.snapshot"]);
    let state = running.done(&["module", "list"]);
    assert!(state.contains("WORKING"), "{state}");
}

/// A headless run's digest and when its simulated time ended.
fn digest(folder: &Path, arguments: &[&str]) -> (Value, Value) {
    let output = slate(folder, &[&["run", "--headless", "--json"], arguments].concat());
    let summary = common::json(&output);
    (summary["digest"].clone(), summary["sim_time_s"].clone())
}

#[test]
fn adaptation_resumed_takes_back_what_it_had_changed() {
    let folder = folder("snapshot-adaptation");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/adaptation/adaptation.toml");
    // It gives up the sonar at about 3 s, and goes back to it at about 9 s.
    let run = [file, "--seed", "1", "--set", "modules.referee.params.time_limit=11.0"];
    let straight = digest(&folder, &run);
    assert!(straight.0.is_string(), "{straight:?}");
    for at in ["3s", "4s", "5s", "6s"] {
        let at = format!("snapshot.at=\"{at}\"");
        let frozen = [&run[..], &["--set", &at, "--set", "snapshot.file=one.snapshot"]].concat();
        assert_eq!(digest(&folder, &frozen), straight, "a snapshot changes nothing: {at}");
        assert_eq!(digest(&folder, &["--resume", "one.snapshot"]), straight, "{at}");
    }
}

#[test]
fn config_diff_and_revert_work_after_a_resume() {
    let mut running = Running::new("snapshot-layers");
    let speed = "robots.r2.modules.planner.params.careful_linear_velocity";
    let run = [
        "run",
        "exp1",
        "--headless",
        "--rate",
        "1",
        "--seed",
        "3",
        "--set",
        "robots.r2.modules.planner.params.max_linear_velocity=0.3",
    ];
    running.start("exp1", &run);
    running.done(&["config", "set", &format!("{speed}=0.1")]);
    let before = running.done(&["config", "diff"]);
    assert!(before.contains("careful_linear_velocity = 0.1"), "{before}");
    running.done(&["snapshot", "save", "here.snapshot"]);
    running.kill();
    running.start("exp1", &["run", "--headless", "--rate", "1", "--resume", "here.snapshot"]);
    assert_eq!(lines(&running.done(&["config", "diff"])), lines(&before));
    let reverted = running.done(&["config", "revert"]);
    assert!(reverted.contains("careful_linear_velocity: 0.1 -> "), "{reverted}");
    assert!(!running.done(&["config", "diff"]).contains("careful_linear_velocity"));
}

/// Report without its source: a resumed run has no files.
#[test]
fn a_snapshot_of_another_variant_is_refused_naming_its_own() {
    let mut running = Running::new("snapshot-variant");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1", "--set", "controller=rocs"]);
    running.done(&["snapshot", "save", "here.snapshot"]);
    running.done(&["config", "set", "controller=slate"]);
    running.fails(
        5,
        &["snapshot", "load", "here.snapshot"],
        &["`controller` is `slate` here", "slate config set controller=rocs"],
    );
    running.done(&["config", "set", "controller=rocs"]);
    running.done(&["snapshot", "load", "here.snapshot"]);
}

fn lines(told: &str) -> Vec<String> {
    told.lines().map(|line| line.split("  #").next().unwrap().trim().to_owned()).collect()
}

#[test]
fn device_is_no_snapshot() {
    let running = Running::new("snapshot-device");
    running.fails(2, &["snapshot", "info", "/dev/zero"], &["/dev/zero", "it is not a file"]);
    let big = std::fs::File::create(running.folder().join("big.snapshot")).unwrap();
    // Of which the disk has nothing, and which is more than any memory.
    big.set_len(1 << 40).unwrap();
    running.fails(2, &["snapshot", "info", "big.snapshot"], &["something else is in it"]);
}

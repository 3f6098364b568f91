//! A run that is frozen and goes on in another process is the run that went straight through, bit for bit.
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
    let far = ["--seed", "3", "--set", LIMIT, "--set", "modules.referee.params.tolerance=0.0"];
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
    let said = running.done(&["snapshot", "save", "here.snapshot"]);
    assert!(said.contains("here.snapshot has agent exp1 at"), "{said}");
    let info: Value =
        serde_json::from_str(&running.done(&["snapshot", "info", "here.snapshot", "--json"])).unwrap();
    let cycle = info["cycle"].as_u64().unwrap();
    assert!(cycle > 0 && info["modules"].as_array().unwrap().len() > 10, "{info}");
    let text = running.done(&["snapshot", "info", "here.snapshot", "--configuration"]);
    assert!(text.contains("agent.seed = 3"), "{text}");
    // It has gone on meanwhile, and goes back.
    let ticks = |running: &Running| running.read("exp1", "/referee/timing/ticks").as_u64().unwrap();
    while ticks(&running) < cycle + 20 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let said = running.done(&["snapshot", "load", "here.snapshot"]);
    assert!(said.contains(&format!("after cycle {cycle}")), "{said}");
    assert!(running.folder().join("here.snapshot").is_file());
    // What does not fit is refused, and the agent goes on.
    let whole = std::fs::read(running.folder().join("here.snapshot")).unwrap();
    std::fs::write(running.folder().join("half.snapshot"), &whole[..whole.len() / 2]).unwrap();
    running.fails(5, &["snapshot", "load", "half.snapshot"], &["half.snapshot", "no whole snapshot", "help"]);
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

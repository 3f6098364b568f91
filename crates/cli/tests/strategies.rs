//! A robot that remembers, run after run: each is a process of its own, and nothing but the memory is between them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;
use std::process::Output;

use common::{folder, json, slate, text};
use serde_json::Value;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/strategies/strategies.toml");
const REMEMBERS: &str = "robots.r2.modules.knowledge.memory=r2.memory";
/// What the summary says of it.
const MEMORY: &str = "memory of r2/knowledge";

fn run(folder: &Path, sets: &[&str]) -> Output {
    let mut all = vec!["run", EXAMPLE, "--headless", "--json", "--out", "report"];
    all.extend(sets.iter().flat_map(|set| ["--set", set]));
    slate(folder, &all)
}

/// The way of R2 in the last run: the x at which it was farthest in the west, and in the east.
fn extremes(folder: &Path) -> (f64, f64) {
    let rows = std::fs::read_to_string(folder.join("report/trajectory.csv")).unwrap();
    let x = rows.lines().filter_map(|row| {
        let cells: Vec<_> = row.split(',').collect();
        (cells[1] == "r2").then(|| cells[2].parse::<f64>().unwrap())
    });
    x.fold((0.0, 0.0), |(west, east): (f64, f64), x| {
        (if x < west { x } else { west }, if x > east { x } else { east })
    })
}

/// What a summary says of the memory that the run began with, and of all that it did.
fn prints(summary: &Value) -> (String, String) {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    (text(&summary["conditions"][MEMORY]), text(&summary["digest"]))
}

/// Before the plan for the east has brought it to its goal.
const TOO_SHORT: &str = "modules.referee.params.time_limit=32";

#[test]
fn a_failure_of_the_past_changes_the_plan_of_another_process() {
    let folder = folder("strategies_failure");
    let first = run(&folder, &[REMEMBERS, TOO_SHORT]);
    assert_eq!(first.status.code(), Some(1), "{first:?}");
    let (west, _) = extremes(&folder);
    assert!(west < -0.9, "it has tried the west: {west}");
    assert_eq!(prints(&json(&first)).0, "none");
    let second = run(&folder, &[REMEMBERS, TOO_SHORT]);
    assert_eq!(second.status.code(), Some(0), "{second:?}");
    let (west, east) = extremes(&folder);
    assert!(west > -0.2 && east > 0.9, "it has gone straight to the east: {west} {east}");
    let (began, _) = prints(&json(&second));
    assert_eq!(began.len(), 16, "a fingerprint: {began}");
    assert!(text(&second.stdout).contains(MEMORY), "who reads the summary sees it");
    assert!(!folder.join("r2.memory.part").exists());
}

#[test]
fn without_a_memory_every_run_is_the_first_one() {
    let folder = folder("strategies_off");
    let runs = [(); 2].map(|()| run(&folder, &[TOO_SHORT]));
    for run in &runs {
        assert_eq!(run.status.code(), Some(1), "{run:?}");
        assert_eq!(json(run)["conditions"].get(MEMORY), None);
    }
    assert_eq!(json(&runs[0])["digest"], json(&runs[1])["digest"]);
    let names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["report"]);
}

#[test]
fn the_memory_is_an_input_of_the_run() {
    let folder = folder("strategies_input");
    let file = folder.join("r2.memory");
    run(&folder, &[REMEMBERS, TOO_SHORT]);
    let one = std::fs::read(&file).unwrap();
    let mut told = Vec::new();
    for _ in 0..2 {
        std::fs::write(&file, &one).unwrap();
        let run = run(&folder, &[REMEMBERS]);
        told.push((prints(&json(&run)), std::fs::read(&file).unwrap()));
    }
    assert_eq!(told[0], told[1], "the same memory and seed: the same run, and the same memory after it");
    let other = run(&folder, &[REMEMBERS]);
    let (began, digest) = prints(&json(&other));
    assert!(began != told[0].0.0 && digest != told[0].0.1, "another memory, another run");
    // Runs of a batch all begin with it, and none of them changes it.
    let before = std::fs::read(&file).unwrap();
    let batch = slate(&folder, &["batch", EXAMPLE, "--runs", "2", "--json", "--set", REMEMBERS]);
    assert_eq!(batch.status.code(), Some(0), "{batch:?}");
    assert!(json(&batch)["conditions"][MEMORY].as_str().is_some_and(|hash| hash.len() == 16), "{batch:?}");
    assert_eq!(std::fs::read(&file).unwrap(), before);
}

#[test]
fn resuming_a_snapshot_keeps_the_beginning_of_its_run() {
    let folder = folder("strategies_resumed");
    let straight = run(&folder, &[REMEMBERS, "snapshot.at=35s", "snapshot.file=r2.snapshot"]);
    let after = std::fs::read(folder.join("r2.memory")).unwrap();
    let resumed = slate(&folder, &["run", "--resume", "r2.snapshot", "--headless", "--json"]);
    assert_eq!(prints(&json(&resumed)), prints(&json(&straight)), "the memory of the file came later");
    assert_eq!(prints(&json(&resumed)).0, "none");
    assert_eq!(std::fs::read(folder.join("r2.memory")).unwrap(), after);
}

#[test]
fn a_damaged_memory_starts_no_run() {
    let folder = folder("strategies_damaged");
    let file = folder.join("r2.memory");
    run(&folder, &[REMEMBERS, TOO_SHORT]);
    std::fs::remove_dir_all(folder.join("report")).unwrap();
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..20]).unwrap();
    let refused = run(&folder, &[REMEMBERS]);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    let told = text(&refused.stderr);
    for word in ["r2.memory", "r2/knowledge", "after byte 20", "move it away", "--set"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert!(!folder.join("report").exists(), "nothing was run");
    assert_eq!(std::fs::read(&file).unwrap(), whole[..20], "and nothing was changed");
}

#[test]
fn unwritable_memory_is_reported_and_kept() {
    let folder = folder("strategies_full");
    let file = folder.join("r2.memory");
    run(&folder, &[REMEMBERS, TOO_SHORT]);
    let before = std::fs::read(&file).unwrap();
    // A disk that is full behaves so: nothing can be written into a file, for this command alone.
    let command = format!(
        "trap '' XFSZ; ulimit -f 0; exec '{}' run '{EXAMPLE}' --headless --set {REMEMBERS} --out report",
        env!("CARGO_BIN_EXE_slate")
    );
    let full = std::process::Command::new("sh").args(["-c", &command]).current_dir(&folder).output().unwrap();
    assert_eq!(full.status.code(), Some(2), "{full:?}");
    let told = text(&full.stderr);
    for word in ["memory of `r2/knowledge`", "r2.memory", "make room on the disk"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert_eq!(std::fs::read(&file).unwrap(), before, "what was known is still known");
    assert!(!folder.join("r2.memory.part").exists());
}

#[test]
fn unsuitable_library_is_reported_once() {
    let inputs = "robots.r2.modules.knowledge.inputs";
    let role = format!("{inputs}.role={{ name = \"mesenger\" }}");
    let twice = "{ name = \"north\", role = \"messenger\" }";
    let plans = format!("{inputs}.library={{ plans = [{twice}, {twice}] }}");
    let no_plan = "no plan for the role `mesenger`; roles with plans: messenger";
    for (name, set, words) in [("role", &role, no_plan), ("twice", &plans, "two plans `north`")] {
        let output =
            run(&folder(&format!("strategies_{name}")), &[set, "modules.referee.params.time_limit=2"]);
        let log = text(&output.stderr);
        assert_eq!(log.matches(words).count(), 1, "{log}");
    }
}

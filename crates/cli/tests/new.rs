//! Projects written by `slate new`, from their tests to a run in the simulator.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, built_plugin, cargo, json, text};
use serde_json::Value;

/// Tests and builds a project, and returns what the simulator says of a run.
fn run(running: &Running, name: &str, passed: &str) -> Value {
    let folder = running.folder().join(name);
    let said = cargo(&folder, "test");
    assert!(said.contains(passed), "{said}");
    cargo(&folder, "build");
    let library = format!("lib{}.so", name.replace('-', "_"));
    std::fs::create_dir_all(folder.join("target/debug")).unwrap();
    std::fs::copy(built_plugin(&library), folder.join("target/debug").join(library)).unwrap();
    let configuration = format!("{name}/{name}.toml");
    assert!(running.done(&["check", &configuration, "--strict"]).contains("is good"));
    let out = format!("{name}/out");
    let run = ["run", &configuration, "--headless", "--json", "--set", "record.enabled=true", "--out", &out];
    let summary = json(&running.call(&run));
    // Each of its modules has all inputs that it requires.
    let states = running.done(&["bag", "cat", &format!("{out}/run.mcap"), "/**/state"]);
    let last = |module: &str| states.lines().rfind(|line| line.contains(module)).unwrap().to_owned();
    for module in states.lines().filter_map(|line| line.split(' ').nth(1)).filter(|url| *url != "/loop/state")
    {
        assert!(last(module).contains("waiting_for = \"\""), "{module}: {states}");
    }
    summary
}

#[test]
fn a_new_mape_k_robot_passes_its_tests_and_reaches_its_target() {
    let running = Running::new("new-mapek");
    let said = running.done(&["new", "pathfinder-one"]);
    for step in [
        "cd pathfinder-one",
        "cargo test",
        "slate check pathfinder-one.toml",
        "slate run pathfinder-one.toml",
    ] {
        assert!(said.contains(step), "{step}: {said}");
    }
    assert_eq!(run(&running, "pathfinder-one", "2 passed")["outcome"], "goal_reached");
}

#[test]
fn a_library_runs_its_robot_as_the_program_does() {
    let running = Running::new("new-robot");
    running.done(&["new", "pathfinder-two"]);
    let configured = run(&running, "pathfinder-two", "2 passed");
    let library = "pathfinder-two/target/debug/libpathfinder_two.so";
    assert!(running.done(&["check", library]).contains("is good"));
    let built = json(&running.call(&["run", library, "--headless", "--json", "--out", "built"]));
    assert_eq!(built["outcome"], "goal_reached");
    assert_eq!(built["digest"], configured["digest"]);
}

#[test]
fn a_new_module_runs_beside_the_blocks_of_a_robot() {
    let running = Running::new("new-module");
    let said = running.done(&["new", "nearest-thing", "--template", "module", "--json"]);
    let written: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(
        (&written["schema"], &written["files"][1]),
        (&"slate.new/1".into(), &"nearest-thing/src/lib.rs".into())
    );
    assert_eq!(run(&running, "nearest-thing", "3 passed")["outcome"], "goal_reached");
}

#[test]
fn a_project_overwrites_no_other_and_takes_no_taken_name() {
    let running = Running::new("new-taken");
    running.done(&["new", "rover", "-t", "plugin"]);
    running.fails(2, &["new", "rover"], &["exists already"]);
    // Its kinds of modules would be called as those of another plugin.
    running.fails(2, &["new", "differential"], &["a module of Slate has this name"]);
    running.fails(2, &["new", "Rover"], &["lower-case letters"]);
    running.fails(2, &["new", "pioneer"], &["configuration uses this name"]);
    running.fails(2, &["new", "other", "--template", "robot"], &["mapek, module, plugin"]);
    running.fails(2, &["new", "other", "--slate", "/nowhere"], &["not a checkout of Slate"]);
    assert!(!running.folder().join("other").exists());
}

#[test]
fn a_project_that_can_not_be_written_leaves_no_half_of_it() {
    let running = Running::new("new-full");
    let output = running.on_full_disk(&["new", "rover"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("File too large"), "{output:?}");
    assert!(!running.folder().join("rover").exists());
    running.done(&["new", "rover"]);
}

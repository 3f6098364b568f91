//! Names under which no tool would reach an agent, and checks of a configuration that has very many errors.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use serde_json::Value;

use crate::common::Running;

/// What `slate check` finds, as JSON.
fn findings(running: &Running, code: i32, arguments: &[&str]) -> Value {
    let output = running.call(&[arguments, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(code), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn name_that_tools_cannot_reach_is_refused() {
    let mut running = Running::new("check-name");
    let long = format!("agent.name={}", "a".repeat(120));
    for (set, words) in [("agent.name=\"a/b\"", "can't name an agent"), (&long, "at most 64 letters")] {
        let checked = findings(&running, 7, &["check", "exp1", "--set", set]);
        assert!(checked["findings"][0]["message"].as_str().unwrap().contains(words), "{checked}");
        running.fails(2, &["run", "exp1", "--headless", "--set", set], &[words]);
    }
    // A folder whose sockets would have paths that are too long, and one that can't be made.
    running.use_sockets(&running.folder().join("a".repeat(90)));
    let checked = findings(&running, 7, &["check", "exp1"]);
    assert!(checked["findings"][0]["message"].as_str().unwrap().contains("107 is the most"), "{checked}");
    running.fails(2, &["run", "exp1", "--headless"], &["can't be reached by tools", "XDG_RUNTIME_DIR"]);
    running.use_sockets(std::path::Path::new("/proc/none"));
    running.fails(2, &["run", "exp1", "--headless"], &["can't be reached by tools", "XDG_RUNTIME_DIR"]);
    assert_eq!(std::fs::read_dir(running.folder()).unwrap().count(), 0, "a run left something behind");
}

#[test]
fn many_errors_are_reported_in_bounded_time() {
    let running = Running::new("check-many");
    let keys: String = (0..20_000).map(|number| format!("nonsense_{number} = 1\n")).collect();
    std::fs::write(running.folder().join("many.toml"), format!("[world]\n{keys}\n[modules.a]\n{keys}"))
        .unwrap();
    let begin = std::time::Instant::now();
    let stderr = running.fails(7, &["check", "many.toml"], &["more errors"]);
    assert!(begin.elapsed().as_secs() < 20, "{:?}", begin.elapsed());
    assert!(stderr.len() < 1_000_000, "{}", stderr.len());
}

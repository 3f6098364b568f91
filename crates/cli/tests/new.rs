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
    assert!(running.done(&["check", &configuration, "--strict"]).contains("is valid"));
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
    assert!(running.done(&["check", library]).contains("is valid"));
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

/// Calls a tool in a folder, and returns what it prints.
#[cfg(feature = "external-tools")]
fn tool(folder: &std::path::Path, name: &str, arguments: &[&str]) -> String {
    let called = std::process::Command::new(name).args(arguments).current_dir(folder).output();
    let output = called.unwrap_or_else(|error| panic!("{name} is needed for this test: {error}"));
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(output.status.success(), "{name} {arguments:?}: {said}");
    said
}

/// Builds and tests a project in C or C++ as it says, and lets its robot reach the target.
#[cfg(feature = "external-tools")]
fn build_and_run(name: &str, language: &str, files: &[&str]) {
    let running = Running::new(name);
    let said = running.done(&["new", name, language]);
    for step in [
        "cmake -B build && cmake --build build",
        "ctest --test-dir build",
        &format!("slate run {name}.toml"),
        &format!("slate plugin reload {}", name.replace('-', "_")),
    ] {
        assert!(said.contains(step), "{step}: {said}");
    }
    let folder = running.folder().join(name);
    for file in files {
        assert!(folder.join(file).is_file(), "{file}");
    }
    assert!(!folder.join("Cargo.toml").exists());
    tool(&folder, "cmake", &["-B", "build", "-DSANITIZE=ON", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON"]);
    tool(&folder, "cmake", &["--build", "build"]);
    assert!(tool(&folder, "ctest", &["--test-dir", "build"]).contains("100% tests passed"));
    let kind = name.replace('-', "_");
    let info = running.done(&["plugin", "info", &format!("{name}/build/lib{kind}.so")]);
    assert!(info.contains(&format!("{kind} 0.1.0")) && info.contains("Turns to the target"), "{info}");
    let configuration = format!("{name}/{name}.toml");
    assert!(running.done(&["check", &configuration, "--strict"]).contains("is valid"));
    let summary = json(&running.call(&["run", &configuration, "--headless", "--json", "--seed", "1"]));
    assert_eq!(summary["outcome"], "goal_reached", "{summary}");
}

#[test]
#[cfg(feature = "external-tools")]
fn new_project_in_cpp_builds_is_tested_and_runs() {
    let files = ["src/cpp_rover.hpp", "src/interfaces.hpp", "include/slate.hpp", "include/slate/ports.hpp"];
    build_and_run("cpp-rover", "--cpp", &files);
}

#[test]
#[cfg(feature = "external-tools")]
fn new_project_in_c_builds_is_tested_and_runs() {
    let files = ["src/c_rover.c", "src/interfaces.h", "include/slate.h", "include/slate/testing.h"];
    build_and_run("c-rover", "--c", &files);
}

/// The tests of the Python package test and run such a project; here is no interpreter with the package.
#[test]
fn new_project_in_python_says_what_its_interpreter_needs() {
    let running = Running::new("new-python");
    let said = running.done(&["new", "py-rover", "--python"]);
    for step in [
        "python3 -m unittest",
        "slate plugin info py_rover.py",
        "slate run py-rover.toml",
        "slate plugin reload py_rover",
    ] {
        assert!(said.contains(step), "{step}: {said}");
    }
    let folder = running.folder().join("py-rover");
    for file in ["py_rover.py", "test_py_rover.py", "py-rover.toml", ".gitignore"] {
        let content = std::fs::read_to_string(folder.join(file)).unwrap();
        assert!(!content.contains("MODULE_KIND") && !content.contains("PROJECT_NAME"), "{file}: {content}");
    }
    assert!(!folder.join("Cargo.toml").exists() && !folder.join("target").exists());
    for (interpreter, reason) in [("/nowhere/python3", "No such file"), ("/bin/false", "exit code 1")] {
        let mut info = running.command(&["plugin", "info", "py-rover/py_rover.py"]);
        let output = info.env("SLATE_PYTHON", interpreter).output().unwrap();
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        for word in [reason, interpreter, "install the package slate-robotics", "SLATE_PYTHON"] {
            assert!(stderr.contains(word), "{word}: {stderr}");
        }
    }
}

#[test]
fn new_project_has_one_language_and_no_reserved_name() {
    let running = Running::new("new-languages");
    running.fails(2, &["new", "rover", "--python", "--cpp"], &["cannot be used with"]);
    running.fails(2, &["new", "random", "--python"], &["a keyword or a module of Python"]);
    running.fails(2, &["new", "rover", "--cpp", "--c"], &["cannot be used with"]);
    running.fails(2, &["new", "rover", "--c", "--template", "mapek"], &["cannot be used with"]);
    running.fails(2, &["new", "help", "--cpp"], &["reserved by CMake"]);
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

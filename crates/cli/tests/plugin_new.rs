//! A crate written by `slate plugin new`, from its test to a reload while it drives.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, built_plugin, cargo, folder, json, slate, text};

#[test]
fn a_new_plugin_is_tested_built_run_and_exchanged_as_it_says() {
    let mut running = Running::new("new");
    let said = running.done(&["plugin", "new", "wall-follower"]);
    for step in ["cd wall-follower", "cargo test", "libwall_follower.so", "slate run wall-follower.toml"] {
        assert!(said.contains(step), "{step}: {said}");
    }
    let crate_folder = running.folder().join("wall-follower");
    assert!(crate_folder.join(".gitignore").is_file());
    assert!(cargo(&crate_folder, "test").contains("4 passed"));
    cargo(&crate_folder, "build");
    let built = built_plugin("libwall_follower.so");
    let built = built.to_str().unwrap();
    let info = running.done(&["plugin", "info", built]);
    for words in ["wall-follower 0.1.0", "wall_follower (Act)", "command  wheels", "WheelSpeeds"] {
        assert!(info.contains(words), "{words}: {info}");
    }

    let place = crate_folder.join("target/debug");
    std::fs::create_dir_all(&place).unwrap();
    let library = place.join("libwall_follower.so");
    std::fs::copy(built, &library).unwrap();
    let configuration = "wall-follower/wall-follower.toml";
    let output = running.call(&["run", configuration, "--headless", "--json"]);
    assert_eq!(json(&output)["outcome"], "goal_reached", "{output:?}");

    // Slowly, so that there is time to exchange it.
    let slow = "modules.wall_follower.params.max_linear_velocity=0.05";
    running.start("wall-follower", &["run", configuration, "--headless", "--rate", "1", "--set", slow]);
    let source = crate_folder.join("src/lib.rs");
    let code = std::fs::read_to_string(&source).unwrap();
    // The new code goes backwards.
    let changed =
        code.replace("let wheel = |speed: f64| speed / params", "let wheel = |speed: f64| -speed / params");
    assert_ne!(code, changed);
    std::fs::write(&source, changed).unwrap();
    cargo(&crate_folder, "build");
    std::fs::copy(built, &library).unwrap();
    let said = running.done(&["plugin", "reload", "wall-follower"]);
    assert!(said.contains("keeps its state"), "{said}");
    let backwards = (0..400).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(25));
        running.read("wall-follower", "/wheels/command/left").as_f64() < Some(0.0)
    });
    assert!(backwards, "the new code does not run");
    running.done(&["plugin", "unload", "wall-follower"]);
    let said = running.done(&["plugin", "load", library.to_str().unwrap()]);
    assert!(said.contains("wall_follower"), "{said}");
}

#[test]
fn a_struct_is_a_state_with_its_line_in_the_manifest() {
    let folder = folder("new_state");
    assert!(slate(&folder, &["plugin", "new", "keeper"]).status.success());
    let edit = |file: &str, edits: &[(&str, &str)]| {
        let path = folder.join("keeper").join(file);
        let mut text = std::fs::read_to_string(&path).unwrap();
        for (old, new) in edits {
            assert!(text.contains(old), "{old}: {text}");
            text = text.replace(old, new);
        }
        std::fs::write(path, text).unwrap();
    };
    edit("Cargo.toml", &[("# serde = ", "serde = ")]);
    let state =
        "#[derive(Default, serde::Serialize, serde::Deserialize)]\npub struct Kept {\n    steps: u64,\n}\n";
    edit(
        "src/lib.rs",
        &[
            ("/// Module;", &format!("{state}\n/// Module;")),
            ("type State = ();", "type State = Kept;"),
            ("fn tick(_: &mut (), ", "fn tick(kept: &mut Kept, "),
            ("-> Outcome {\n", "-> Outcome {\n        kept.steps += 1;\n"),
        ],
    );
    assert!(cargo(&folder.join("keeper"), "test").contains("4 passed"));
}

#[test]
fn impossible_plugin_names_and_existing_folders_are_refused() {
    let folder = folder("new_refused");
    for name in ["Follower", "2d", "a b", "", "../x", "fn", "slate-plugin", "slate-module", "käfer"] {
        let output = slate(&folder, &["plugin", "new", name]);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(text(&output.stderr).contains("wall-follower"), "{output:?}");
    }
    std::fs::create_dir(folder.join("taken")).unwrap();
    let output = slate(&folder, &["plugin", "new", "taken"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let said = text(&output.stderr);
    assert!(said.contains("`taken` exists already"), "{said}");
    assert!(said.contains("help: choose another name"), "{said}");
    for (name, reason) in [
        ("2d", "a letter first"),
        ("fn", "reserved by Rust"),
        ("slate", "Slate's own packages"),
        ("slate-plugin", "Slate's own packages"),
        ("simulator", "uses this name"),
    ] {
        let said = text(&slate(&folder, &["plugin", "new", name]).stderr);
        assert!(said.contains(&format!("`{name}` can't be the name")) && said.contains(reason), "{said}");
    }
    let output = slate(&folder, &["plugin", "new", "follower", "--slate", "."]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("crates/plugin"), "{output:?}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
}

//! Recordings in viewers of other projects.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use super::{fails, recorded, write};
use crate::common::text;

/// Puts a program into `bin` that keeps its arguments and the file that it is given.
fn install(folder: &Path, name: &str, code: i32) {
    let file = folder.join("bin").join(name);
    std::fs::create_dir_all(folder.join("bin")).unwrap();
    let script = format!(
        "#!/bin/sh\necho \"$@\" >given\nfor last; do :; done\ncp \"$last\" shown.mcap\nexit {code}\n"
    );
    std::fs::write(&file, script).unwrap();
    std::fs::set_permissions(file, std::fs::Permissions::from_mode(0o755)).unwrap();
}

/// Opens the recording with the installed viewers alone.
fn open(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slate"));
    command.current_dir(folder).args(["bag", "open", "run.mcap"]).args(arguments);
    let path = std::env::join_paths([folder.join("bin"), "/usr/bin".into(), "/bin".into()]).unwrap();
    command.env("PATH", path).output().unwrap()
}

#[test]
fn recording_opens_in_the_viewer_that_is_installed() {
    let folder = recorded("bag-open");
    install(&folder, "rerun", 0);
    let output = open(&folder, &[]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let given = std::fs::read_to_string(folder.join("given")).unwrap();
    assert!(given.trim_end().ends_with("/run.mcap"), "{given}");
    // The viewer had a recording with ROS's messages, of which nothing is left.
    let info = super::done(&folder, &["info", "shown.mcap"]);
    assert!(info.contains("ros2") && info.contains("/r2/range"), "{info}");
    assert!(!Path::new(given.trim_end()).exists(), "{given}");
}

#[test]
fn viewer_of_foxglove_gets_a_layout() {
    let folder = recorded("bag-open-layout");
    install(&folder, "lichtblick", 0);
    let output = open(&folder, &["--with", "lichtblick", "--out", "view"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stdout).contains("view/layout.json is its layout"), "{output:?}");
    let layout = std::fs::read(folder.join("view/layout.json")).unwrap();
    let layout: Value = serde_json::from_slice(&layout).unwrap();
    // Each panel that is placed is configured.
    let mut placed = vec![&layout["layout"]];
    let mut panels = 0;
    while let Some(part) = placed.pop() {
        match part.as_str() {
            Some(panel) => {
                panels += 1;
                assert!(layout["configById"][panel].is_object(), "{panel}: {layout}");
            }
            None => placed.extend([&part["first"], &part["second"]]),
        }
    }
    assert_eq!(panels, layout["configById"].as_object().unwrap().len());
    assert!(folder.join("view/run.mcap").is_file());
    let again = open(&folder, &["--with", "lichtblick", "--out", "view"]);
    assert_eq!(again.status.code(), Some(2), "{again:?}");
    assert_eq!(open(&folder, &["--with", "lichtblick", "--out", "view", "--force"]).status.code(), Some(0));
}

#[test]
fn viewer_that_fails_or_is_missing_is_named() {
    let folder = recorded("bag-open-missing");
    install(&folder, "plotjuggler", 3);
    let output = open(&folder, &["--with", "plotjuggler"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(text(&output.stderr).contains("plotjuggler ended with exit status: 3"), "{output:?}");
    let given = std::fs::read_to_string(folder.join("given")).unwrap();
    assert!(given.starts_with("--datafile "), "{given}");
    let output = open(&folder, &["--with", "foxglove"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let stderr = text(&output.stderr);
    assert!(stderr.contains("no viewer is installed: PATH has no foxglove-studio"), "{stderr}");
    assert!(stderr.contains("pip install rerun-sdk"), "{stderr}");
    write(&folder, "text.mcap", b"no recording");
    fails(
        &folder,
        2,
        &["open", "text.mcap", "--with", "word"],
        &["rerun, foxglove, lichtblick, plotjuggler"],
    );
}

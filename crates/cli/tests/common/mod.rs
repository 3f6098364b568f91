//! The command as a user calls it, from a folder of its own.
#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A fresh folder that a test works in.
pub fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Calls the command in a folder.
pub fn slate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slate")).args(arguments).current_dir(folder).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The last line of stdout, which is JSON.
pub fn json(output: &Output) -> Value {
    let stdout = text(&output.stdout);
    serde_json::from_str(stdout.lines().last().unwrap_or_default()).unwrap_or_else(|_| panic!("{output:?}"))
}

/// The summary of a headless run of EXP1, and the exit code.
pub fn exp1(folder: &Path, arguments: &[&str]) -> (Value, Option<i32>) {
    let mut all = vec!["run", "exp1", "--headless", "--json"];
    all.extend(arguments);
    let output = slate(folder, &all);
    (json(&output), output.status.code())
}

//! Programs of others, from PyPI.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, PoisonError};

/// Read by these, of which others are made.
const PACKAGES: [&str; 3] = ["mcap==1.6.0", "mcap-ros2-support==0.6.0", "rosbags==0.11.9"];

/// Runs a command that ends well, or tells `advice`.
pub fn run(command: &mut Command, advice: &str) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => panic!("{advice}\n{command:?}\n{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => panic!("{advice}\n{command:?}: {error}"),
    }
}

/// A Python that has the packages.
pub fn python() -> PathBuf {
    // Made once, though tests run beside each other.
    static MAKING: Mutex<()> = Mutex::new(());
    let _making = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros-python");
    let python = folder.join("bin/python");
    let marker = folder.join("packages");
    let wanted = PACKAGES.join("\n");
    let works =
        || Command::new(&python).arg("--version").output().is_ok_and(|output| output.status.success());
    if std::fs::read_to_string(&marker).is_ok_and(|found| found == wanted) && works() {
        return python;
    }
    run(
        Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder),
        "this test needs Python with virtual environments: apt-get install python3-venv",
    );
    run(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
            .args(PACKAGES),
        "this test needs packages of PyPI, so it needs a network the first time",
    );
    std::fs::write(&marker, wanted).unwrap();
    python
}

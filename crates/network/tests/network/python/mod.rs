//! A program in Python with its own Zenoh: `cargo test -p slate-network --features external-tools`.

use std::path::{Path, PathBuf};
use std::process::Command;

use slate_test_tools::run;

use crate::network::agent::{Running, ports};

const PACKAGES: [&str; 1] = ["eclipse-zenoh==1.10.2"];

/// A Python that has the packages.
fn python() -> PathBuf {
    slate_test_tools::python(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("zenoh-python"), &PACKAGES)
}

#[test]
fn a_program_in_python_reads_sets_and_is_read() {
    let [port] = ports();
    let table = format!(
        "listen = [\"tcp/127.0.0.1:{port}\"]\nset = [\"sensor/params\", \"driver/goal\"]\n\
         read.\"driver/ambient\" = \"zenoh:demo/temperature\""
    );
    let agent = Running::start("snake", &table);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/network/python/program.py");
    let output =
        run(Command::new(python()).arg(script).arg(port.to_string()).arg("snake"), "the program has failed");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "done");
    assert_eq!(agent.number("sensor/params/step"), 1.5);
    assert_eq!(agent.number("driver/seen/value"), 28.5);
}

//! A program in Python with its own Zenoh: `cargo test -p slate-network --features external-tools`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::network::agent::{Running, ports};

const PACKAGES: [&str; 1] = ["eclipse-zenoh==1.10.2"];

/// Runs a command that ends well, or tells `advice`.
fn run(command: &mut Command, advice: &str) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => panic!("{advice}\n{command:?}\n{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => panic!("{advice}\n{command:?}: {error}"),
    }
}

/// A Python that has the packages.
fn python() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("zenoh-python");
    let (python, marker) = (folder.join("bin/python"), folder.join("packages"));
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

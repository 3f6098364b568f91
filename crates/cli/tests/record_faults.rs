//! Recordings of a process that is killed, and on disks without room.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;
use crate::record::{LONG, ON, readable, verify};

use std::process::Stdio;
use std::time::Duration;

use common::{Running, exp1, folder, slate, text};
use mcap::read::{LinearReader, Options};

#[test]
fn closed_chunks_survive_a_kill() {
    let running = Running::new("record-kill");
    for round in 0..4_u64 {
        let name = format!("run{round}");
        let run = ["run", "exp1", "--headless", "--seed", "6", "--out", &name];
        let mut command = running.command(&[&run[..], &ON, &LONG].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let file = running.folder().join(&name).join("run.mcap");
        common::wait_for("the file begins", || {
            std::fs::metadata(&file).is_ok_and(|file| file.len() > 100_000)
        });
        std::thread::sleep(Duration::from_millis(37 * round));
        let before = readable(&std::fs::read(&file).unwrap()).0;
        child.kill().unwrap();
        child.wait().unwrap();
        let file = std::fs::read(&file).unwrap();
        // What can be read at any moment can be read for good.
        let (after, is_whole) = readable(&file);
        assert!(before > 100 && after >= before && !is_whole, "{before}, then {after}");
        assert!(
            LinearReader::new_with_options(&file, Options::IgnoreEndMagic.into()).unwrap().next().is_some()
        );
        let (said, code) = verify(running.folder(), &format!("{name}/run.mcap"));
        assert!(
            said.contains("identical, ") && said.contains("up to where the recording was cut off"),
            "{said}"
        );
        assert_eq!(code, Some(0));
    }
}

#[test]
fn a_full_disk_ends_the_recording_and_not_the_run() {
    let folder = folder("record-full");
    let (without, _) = exp1(&folder, &["--seed", "7"]);
    for (file, words) in [("/dev/full", "No space left"), ("/proc/nowhere/run.mcap", "No such file")] {
        let place = format!("record.file={file}");
        let output = slate(
            &folder,
            &[&["run", "exp1", "--headless", "--json", "--seed", "7", "--set", &place], &ON[..]].concat(),
        );
        let said = text(&output.stderr);
        assert!(said.contains(&format!("the recording {file} ")) && said.contains(words), "{said}");
        assert_eq!(common::json(&output)["digest"], without["digest"]);
        assert_eq!(output.status.code(), Some(2), "what was asked for is not there");
    }
}

#[test]
fn a_file_at_its_size_limit_ends_the_recording_and_not_the_run() {
    let folder = folder("record-limit");
    let (without, _) = exp1(&folder, &["--seed", "7", "--out", "there"]);
    // A limit of the size of files, which fails like a disk that is full.
    let run = "trap '' XFSZ; ulimit -f 600; exec \"$@\"";
    let arguments = ["run", "exp1", "--headless", "--json", "--seed", "7", "--out", "here"];
    let output = std::process::Command::new("sh")
        .args(["-c", run, "sh", env!("CARGO_BIN_EXE_slate")])
        .args([&arguments[..], &ON].concat())
        .current_dir(&folder)
        .output()
        .unwrap();
    let said = text(&output.stderr);
    assert!(
        said.contains("the recording here/run.mcap ends here, and the agent continues without it"),
        "{said}"
    );
    assert_eq!(said.matches("ends here").count(), 1, "it is said once: {said}");
    assert_eq!(common::json(&output)["digest"], without["digest"]);
    assert_eq!(output.status.code(), Some(2), "what was asked for is not there");
    assert!(slate(&folder, &["bag", "repair", "here/run.mcap"]).status.success());
    let (said, code) = verify(&folder, "here/run.mcap");
    assert!(said.contains("identical, ") && said.contains("cut off"), "{said}");
    assert_eq!(code, Some(0));
}

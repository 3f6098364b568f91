//! Arming and stopping.
#![allow(clippy::unwrap_used, reason = "a test's folder can be made")]

use crate::common;

use std::fs;
use std::path::PathBuf;

use common::*;
use slate_module::Priority::{Plan, Reflex};
use slate_safety::{Gate, GateMode, Reason, RefusalReason, StopLatch, Verdict};

const MOVE: Wheels = Wheels { left: 1.0, right: 1.0 };
const SAFE: Wheels = Wheels { left: 0.0, right: 0.0 };

fn offer(gate: &mut Gate) -> Verdict {
    gate.offer(BUMPER, Reflex, bytes(&MOVE), 0)
}

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder =
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("stop-{}-{test}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn a_gate_begins_disarmed() {
    let mut gate = Gate::new(configuration());
    assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Disarmed));
    assert_eq!(given(&mut gate, 0), SAFE);
    assert_eq!(gate.output(0).state.mode, GateMode::DISARMED);
    gate.arm().unwrap();
    assert_eq!(given(&mut gate, 0), SAFE, "what was refused stays refused");
    assert_eq!(offer(&mut gate), Verdict::Passed);
    assert_eq!(given(&mut gate, 0), MOVE);
}

#[test]
fn disarming_ends_the_command() {
    let mut gate = armed(configuration());
    offer(&mut gate);
    gate.disarm();
    assert_eq!(given(&mut gate, 0), SAFE);
    gate.arm().unwrap();
    assert_eq!(given(&mut gate, 0), SAFE, "arming brings no old command back");
}

#[test]
fn arming_an_armed_gate_changes_nothing() {
    let mut gate = armed(configuration());
    offer(&mut gate);
    gate.arm().unwrap();
    assert_eq!(given(&mut gate, 0), MOVE);
}

#[test]
fn a_stop_of_the_gate_needs_a_reset_and_an_arming() {
    let mut gate = armed(configuration());
    offer(&mut gate);
    gate.stop("bumper pressed");
    gate.stop("a later reason");
    assert_eq!(given(&mut gate, 0), SAFE);
    assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Stopped));
    assert_eq!(gate.output(0).state.mode, GateMode::STOPPED);
    assert_eq!(gate.stop_reason().as_deref(), Some("bumper pressed"));
    let refused = gate.arm().unwrap_err();
    assert_eq!(refused.to_string(), "gate `drive` is stopped (bumper pressed): reset the stop first");
    gate.disarm();
    assert_eq!(gate.output(0).state.mode, GateMode::STOPPED, "disarming resets no stop");
    gate.reset();
    assert_eq!(gate.output(0).state.mode, GateMode::DISARMED);
    assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Disarmed));
    assert_eq!(gate.stop_reason(), None);
    gate.arm().unwrap();
    assert_eq!(offer(&mut gate), Verdict::Passed);
}

#[test]
fn the_latch_stops_all_its_gates_at_once() {
    let latch = StopLatch::in_memory();
    let mut left = armed(configuration().stop_latch(&latch));
    let mut right = armed(configuration().stop_latch(&latch));
    let mut other = armed(configuration());
    for gate in [&mut left, &mut right, &mut other] {
        offer(gate);
    }
    latch.stop("operator").unwrap();
    for gate in [&mut left, &mut right] {
        assert_eq!(given(gate, 0), SAFE);
        assert_eq!(offer(gate), Verdict::Refused(Reason::Stopped));
        assert_eq!(gate.output(0).state.mode, GateMode::STOPPED);
        assert_eq!(gate.output(0).state.last_refusal, RefusalReason::STOPPED);
        assert_eq!(gate.arm().unwrap_err().reason, "operator");
        gate.reset();
        assert_eq!(offer(gate), Verdict::Refused(Reason::Stopped), "a gate can't reset the agent");
    }
    assert_eq!(given(&mut other, 0), MOVE);
}

#[test]
fn a_reset_of_the_latch_alone_does_not_arm() {
    let latch = StopLatch::in_memory();
    let mut gate = armed(configuration().stop_latch(&latch));
    offer(&mut gate);
    latch.stop("operator").unwrap();
    assert_eq!(given(&mut gate, 0), SAFE);
    latch.reset().unwrap();
    assert_eq!(given(&mut gate, 0), SAFE);
    assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Disarmed));
    gate.arm().unwrap();
    assert_eq!(offer(&mut gate), Verdict::Passed);
}

#[test]
fn a_stop_reset_before_the_next_output_still_disarms() {
    let latch = StopLatch::in_memory();
    let mut gate = armed(configuration().stop_latch(&latch));
    offer(&mut gate);
    latch.stop("operator").unwrap();
    latch.reset().unwrap();
    assert_eq!(given(&mut gate, 0), SAFE);
    assert_eq!(gate.output(0).state.mode, GateMode::DISARMED);
    gate.arm().unwrap();
    offer(&mut gate);
    latch.stop("operator").unwrap();
    latch.reset().unwrap();
    gate.arm().unwrap();
    assert_eq!(given(&mut gate, 0), SAFE, "arming brings no old command back");
}

#[test]
fn a_reset_of_a_latch_that_is_not_stopped_changes_nothing() {
    let latch = StopLatch::in_memory();
    let mut gate = armed(configuration().stop_latch(&latch));
    offer(&mut gate);
    latch.reset().unwrap();
    assert_eq!(given(&mut gate, 0), MOVE);
}

#[test]
fn a_stop_survives_a_restart_until_it_is_reset() {
    let path = folder("restart").join("state/stop");
    let latch = StopLatch::open(&path).unwrap();
    assert!(!latch.is_stopped());
    assert_eq!(latch.reason(), None);
    latch.stop("operator: smoke").unwrap();
    latch.stop("a later reason").unwrap();
    drop(latch);

    let latch = StopLatch::open(&path).unwrap();
    assert!(latch.is_stopped());
    assert_eq!(latch.reason().as_deref(), Some("operator: smoke"));
    let mut gate = Gate::new(configuration().stop_latch(&latch));
    assert!(gate.arm().is_err());
    latch.reset().unwrap();
    assert!(!latch.is_stopped() && !path.exists());
    assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Disarmed));

    assert!(!StopLatch::open(&path).unwrap().is_stopped());
    latch.stop("once more").unwrap();
    assert_eq!(StopLatch::open(&path).unwrap().reason().as_deref(), Some("once more"));
}

#[test]
fn a_file_of_any_content_means_stopped() {
    let folder = folder("content");
    for (name, content) in [("empty", &b""[..]), ("binary", &[0xff, 0, 0xfe]), ("long", &[b'x'; 100_000])] {
        let path = folder.join(name);
        fs::write(&path, content).unwrap();
        let latch = StopLatch::open(&path).unwrap();
        assert!(latch.is_stopped(), "{name}");
        assert!(latch.reason().unwrap().len() < 10_000);
    }
}

#[test]
fn a_stop_holds_even_if_its_file_cannot_be_written() {
    let folder = folder("unwritable").join("state");
    let latch = StopLatch::open(folder.join("stop")).unwrap();
    let mut gate = armed(configuration().stop_latch(&latch));
    offer(&mut gate);
    fs::remove_dir(&folder).unwrap();
    assert!(latch.stop("operator").is_err());
    assert!(latch.is_stopped());
    assert_eq!(given(&mut gate, 0), SAFE);
    assert_eq!(latch.reason().as_deref(), Some("operator"));
    latch.reset().unwrap();
    assert!(!latch.is_stopped(), "there is no file to remove");

    assert!(latch.stop("operator").is_err());
    fs::create_dir(&folder).unwrap();
    latch.stop("again").unwrap();
    assert!(StopLatch::open(folder.join("stop")).unwrap().is_stopped(), "a later stop tries the file again");
}

#[cfg(target_os = "linux")]
#[test]
fn a_stop_holds_even_if_the_disk_is_full() {
    let path = folder("full").join("stop");
    let latch = StopLatch::open(&path).unwrap();
    std::os::unix::fs::symlink("/dev/full", &path).unwrap();
    assert_eq!(latch.stop("operator").unwrap_err().kind(), std::io::ErrorKind::StorageFull);
    assert!(latch.is_stopped());
    assert!(StopLatch::open(&path).unwrap().is_stopped());
    latch.reset().unwrap();
    assert!(!latch.is_stopped());
}

#[cfg(unix)]
#[test]
fn a_stop_takes_effect_while_its_file_hangs() {
    let path = folder("hangs").join("stop");
    let latch = StopLatch::open(&path).unwrap();
    let mut gate = armed(configuration().stop_latch(&latch));
    offer(&mut gate);
    // Writing to a pipe waits for a reader.
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    std::thread::scope(|scope| {
        let stopping = scope.spawn(|| latch.stop("operator"));
        while !latch.is_stopped() {
            std::thread::yield_now();
        }
        assert_eq!(given(&mut gate, 0), SAFE);
        assert_eq!(offer(&mut gate), Verdict::Refused(Reason::Stopped));
        assert!(!stopping.is_finished());
        assert_eq!(fs::read(&path).unwrap(), b"operator");
    });
    assert!(StopLatch::open(&path).unwrap().is_stopped(), "opening waits for no pipe");
}

#[cfg(unix)]
#[test]
fn a_link_to_nothing_means_stopped_too() {
    let path = folder("link").join("stop");
    std::os::unix::fs::symlink("nothing", &path).unwrap();
    assert!(StopLatch::open(&path).unwrap().is_stopped());
}

#[test]
fn a_reset_that_cannot_remove_the_file_leaves_the_agent_stopped() {
    let path = folder("unremovable").join("stop");
    fs::create_dir(&path).unwrap();
    let latch = StopLatch::open(&path).unwrap();
    assert!(latch.is_stopped());
    assert!(latch.reset().is_err());
    assert!(latch.is_stopped());
}

#[test]
fn a_folder_that_cannot_be_made_is_an_error() {
    let file = folder("file").join("file");
    fs::write(&file, "").unwrap();
    assert!(StopLatch::open(file.join("stop")).is_err());
}

#[test]
fn concurrent_stops_and_resets_keep_flag_and_file_equal() {
    let path = folder("threads").join("stop");
    let latch = StopLatch::open(&path).unwrap();
    for _ in 0..50 {
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| latch.stop("one of many").unwrap());
                scope.spawn(|| latch.reset().unwrap());
            }
        });
        assert_eq!(latch.is_stopped(), path.exists());
        assert_eq!(latch.is_stopped(), latch.reason().is_some());
    }
}

#[test]
fn a_stop_holds_against_concurrent_commands() {
    let latch = StopLatch::in_memory();
    let mut gate = armed(configuration().stop_latch(&latch));
    std::thread::scope(|scope| {
        let stopping = scope.spawn(|| latch.stop("operator"));
        while !stopping.is_finished() {
            gate.offer(PLANNER, Plan, bytes(&MOVE), 0);
            gate.output(0);
        }
        assert_eq!(given(&mut gate, 0), SAFE);
    });
}

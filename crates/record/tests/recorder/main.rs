//! Promises of a recording to the robot and to readers, with slow, full and failing files.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod disk;
mod places;
mod support;

use std::path::Path;

use slate_blackboard::interface::Value;
use slate_runtime::Agent;
use support::{Bytes, LOCKSTEP, agent, numbers, read};

#[test]
fn every_write_is_recorded_also_before_the_file_is_open() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    let set = |agent: &Agent, value: f64| {
        agent.board().write("counter/params/step", &Value::Float(value), agent.now()).unwrap();
    };
    set(&agent, 2.0);
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
    agent.step();
    (3..8).for_each(|value| set(&agent, value.into()));
    agent.step();
    recorder.end(&mut agent).unwrap();
    let file = bytes.0.lock().unwrap().clone();
    assert_eq!(numbers(&file, "/counter/params"), (1..=7).collect::<Vec<_>>());
    assert_eq!(numbers(&file, "/counter/number"), [1, 2]);
}

#[test]
fn a_recorder_gets_all_of_a_value_written_on_demand() {
    for (extra, is_watched) in
        [("", true), ("select = \"/counter/number\"", false), ("exclude = \"/**/half\"", false)]
    {
        let (mut agent, recorder, _) = agent(LOCKSTEP, extra);
        let bytes = Bytes::default();
        recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
        agent.step();
        // The last seconds are kept all the time, and nothing is computed for them.
        assert_eq!(agent.board().find("counter/half").unwrap().0.is_watched(), is_watched, "{extra}");
        agent.step();
        recorder.end(&mut agent).unwrap();
        let file = bytes.0.lock().unwrap().clone();
        assert_eq!(numbers(&file, "/counter/half"), if is_watched { vec![1, 2] } else { vec![] }, "{extra}");
    }
}

/// A recording of a run, as it is on the disk.
fn reference() -> Vec<u8> {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "chunk = \"2KiB\"");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
    (0..200).for_each(|_| assert!(agent.step()));
    recorder.end(&mut agent).unwrap();
    bytes.0.lock().unwrap().clone()
}

#[test]
fn a_cut_or_damaged_recording_is_an_error_and_never_wrong() {
    let file = reference();
    let whole = read(&file).unwrap();
    assert!(whole.len() > 200);
    // A sample: all places are tried with the smaller files of the tests of `bag`.
    for place in (0..file.len()).step_by(97) {
        assert!(read(&file[..place]).is_err(), "cut at {place}");
        let mut flipped = file.clone();
        flipped[place] ^= 1 << (place % 8);
        match read(&flipped) {
            Err(error) => assert!(error.to_string().contains("here"), "{error}"),
            Ok(all) => assert!(all == whole, "bit {} of byte {place} changes what is read", place % 8),
        }
    }
}

#[test]
fn a_fault_saves_the_seconds_before_it_and_no_fault_saves_none() {
    let extra = "flight = { keep = \"100ms\", trigger = [\"fault\"] }";
    for (limit, name) in [(1e9, "without"), (400.0, "with")] {
        let (mut agent, recorder, _) = agent(LOCKSTEP, extra);
        agent.board().write("counter/params/limit", &Value::Float(limit), 0).unwrap();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-fault").join(name);
        let _ = std::fs::remove_dir_all(&folder);
        recorder.attach(&agent, &folder);
        (0..410).for_each(|_| assert!(agent.step()));
        recorder.end(&mut agent).unwrap();
        let saved = folder.join("flight-fault-1.mcap");
        assert_eq!(saved.exists(), limit < 1e9);
        if !saved.exists() {
            continue;
        }
        let all = read(&std::fs::read(saved).unwrap()).unwrap();
        let own = all.iter().filter(|(topic, ..)| topic == "/counter/number");
        let numbers: Vec<_> = own.map(|(_, number, ..)| *number).collect();
        assert!(numbers.contains(&399) && numbers[0] > 1, "{numbers:?}");
        assert!(all.iter().any(|(topic, ..)| topic == "/counter/params"), "which was set long before");
        assert!(!folder.join("flight-fault-2.mcap").exists(), "it panics on, but that is no news for 10 s");
    }
}

#[test]
fn a_value_too_large_for_the_last_seconds_is_still_recorded() {
    let extra = "flight = { keep = \"100ms\", trigger = [\"fault\"], largest = \"100B\" }";
    let (mut agent, recorder, _) = agent(LOCKSTEP, extra);
    agent.board().write("counter/params/limit", &Value::Float(400.0), 0).unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-largest");
    let _ = std::fs::remove_dir_all(&folder);
    recorder.attach(&agent, &folder);
    (0..410).for_each(|_| assert!(agent.step()));
    recorder.end(&mut agent).unwrap();
    let count = |file: &str, wanted: &str| {
        let all = read(&std::fs::read(folder.join(file)).unwrap()).unwrap();
        all.iter().filter(|(topic, ..)| topic == wanted).count()
    };
    assert!(count("run.mcap", "/counter/number") > 390);
    assert_eq!(count("flight-fault-1.mcap", "/counter/number"), 0);
    assert!(count("flight-fault-1.mcap", "/counter/params") > 0);
}

#[test]
fn a_recording_that_has_not_begun_has_no_end() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    assert!(recorder.end(&mut agent).unwrap_err().to_string().contains("has not begun"));
}

//! Recordings of agents that run, begun and ended by their user, and the last seconds that agents keep in memory.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::collections::BTreeMap;
use std::path::Path;

use common::{Running, text, wait_for};
use mcap::{MessageStream, Summary};
use serde_json::Value;

/// EXP1 in the pace of the world, without an end.
const RUN: [&str; 9] = [
    "run",
    "exp1",
    "--headless",
    "--rate",
    "1",
    "--set",
    "modules.referee.params.goal_tolerance=0.0",
    "--out",
    "here",
];

const FLIGHT: [&str; 2] = ["--set", "record.flight.enabled=true"];

/// Numbers and times of the values of each topic.
fn values(file: &Path) -> BTreeMap<String, Vec<(u32, u64)>> {
    let file = std::fs::read(file).unwrap();
    let mut values: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for message in MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        values.entry(message.channel.topic.clone()).or_default().push((message.sequence, message.log_time));
    }
    values
}

fn metadata(file: &Path, name: &str) -> BTreeMap<String, String> {
    let file = std::fs::read(file).unwrap();
    let summary = Summary::read(&file).unwrap().unwrap();
    let index = summary.metadata_indexes.iter().find(|index| index.name == name).unwrap();
    mcap::read::metadata(&file, index).unwrap().metadata
}

fn status(running: &Running) -> Value {
    serde_json::from_str(&running.done(&["record", "status", "--json"])).unwrap()
}

/// Waits until the agent's time has gone on by so many seconds.
fn wait(running: &Running, seconds: f64) {
    let cycles = || running.read("exp1", "/loop/state/cycles").as_u64().unwrap_or(0);
    let begin = cycles();
    let wanted = begin + (seconds / 0.02) as u64;
    wait_for("the agent goes on", || cycles() >= wanted);
}

#[test]
fn a_late_recording_begins_with_the_current_values() {
    let mut running = Running::new("live-all");
    running.start("exp1", &RUN);
    // Before the first cycle nothing has happened that the recording could miss.
    wait(&running, 0.1);
    let said = running.done(&["record", "start", "--out", "all.mcap"]);
    assert_eq!(said, "exp1 records into all.mcap\n");
    wait(&running, 1.0);
    let status = status(&running);
    let [entry] = &status["recordings"].as_array().unwrap()[..] else { panic!("{status}") };
    assert!(entry["values"].as_u64().unwrap() > 100 && entry["dropped"] == 0, "{status}");
    let said = running.done(&["record", "stop"]);
    assert!(said.contains("all.mcap has ") && said.contains(" values, "), "{said}");
    let file = running.folder().join("all.mcap");
    let all = values(&file);
    // A parameter that is never written again is there, at the time at which the recording begins.
    let (_, begin) = all["/r2/planner/params"][0];
    assert!(begin > 0);
    assert!(all["/simulator/r2/truth"].len() > 40);
    for (topic, values) in
        all.iter().filter(|(topic, _)| !["/log", "/record/change"].contains(&topic.as_str()))
    {
        let first = values[0].0;
        let numbers: Vec<_> = values.iter().map(|(number, _)| *number).collect();
        let whole: Vec<_> = (first..first + values.len() as u32).collect();
        assert_eq!(numbers, whole, "{topic}, which began at {begin}: {values:?}");
        assert!(values.iter().all(|(_, time)| *time >= begin), "{topic}: before {begin}: {values:?}");
    }
    assert_eq!(metadata(&file, "end")["stopped"], "by a tool");
    let said = running.done(&["bag", "verify", "all.mcap"]);
    assert!(said.contains("all.mcap is whole"), "{said}");
    running.fails(2, &["replay", "--verify", "all.mcap"], &[]);
    let output = running.call(&["replay", "--verify", "all.mcap"]);
    let said = text(&output.stdout);
    assert!(said.contains("not covered: the recording begins after cycle "), "{said}");
    assert!(
        said.contains("and not with it: what modules remembered then is not in it; `slate try"),
        "{said}"
    );
    running.fails(5, &["record", "stop"], &["nothing is recorded", "slate record start"]);
}

#[test]
fn patterns_rate_and_changes_choose_what_is_recorded() {
    let mut running = Running::new("live-some");
    running.start("exp1", &RUN);
    let slow = [
        "record",
        "start",
        "slate://exp1/simulator/r2/*",
        "--exclude",
        "/**/sonar",
        "--rate",
        "5",
        "--out",
        "slow.mcap",
    ];
    running.done(&slow);
    running.done(&[
        "record",
        "start",
        "/r2/*/state",
        "/simulator/r2/chassis",
        "--on-change",
        "--out",
        "new.mcap",
    ]);
    wait(&running, 2.0);
    running.fails(5, &["record", "stop"], &["several recordings", "slow.mcap", "new.mcap"]);
    running.fails(5, &["record", "stop", "other.mcap"], &["no recording goes into that file", "slow.mcap"]);
    running.done(&["record", "stop", "slow.mcap"]);
    running.done(&["record", "stop"]);
    let slow = values(&running.folder().join("slow.mcap"));
    let topics = slow.keys().filter(|topic| *topic != "/log");
    assert!(topics.clone().all(|topic| topic.starts_with("/simulator/r2/") && !topic.ends_with("/sonar")));
    let truth = &slow["/simulator/r2/truth"];
    assert!(truth.len() >= 9, "{truth:?}");
    let spans = truth.windows(2).skip(1).map(|pair| pair[1].1 - pair[0].1);
    assert!(spans.clone().all(|span| span >= 199_999_999), "{:?}", spans.collect::<Vec<_>>());
    let new = values(&running.folder().join("new.mcap"));
    assert!(new.contains_key("/r2/planner/state"));
    assert_eq!(new["/simulator/r2/chassis"].len(), 1, "what stays as it is stands there once");
}

#[test]
fn a_recording_that_can_not_begin_says_why_and_what_to_do() {
    let mut running = Running::new("live-refused");
    running.start("exp1", &[&RUN[..], &["--set", "record.flight.enabled=false"]].concat());
    std::fs::write(running.folder().join("there.mcap"), "").unwrap();
    let start = |more: &[&'static str]| [&["record", "start"], more].concat();
    running.fails(
        5,
        &start(&["--out", "there.mcap"]),
        &["there.mcap can't be made: File exists", "--out FILE"],
    );
    running.fails(5, &start(&["--out", "no/where.mcap"]), &["No such file", "a folder that exists"]);
    running.fails(5, &start(&["/nobody/**"]), &["no property of the agent", "slate list"]);
    running.fails(5, &start(&["/r2/["]), &["/r2/[", "slate list"]);
    for rate in ["0", "-3", "1e-4"] {
        running.fails(5, &start(&["--rate", rate]), &["`rate` is from 0.001", "--rate 5"]);
    }
    for rate in ["nan", "inf", "fast"] {
        running.fails(2, &start(&["--rate", rate]), &["expected Hz"]);
    }
    running.fails(5, &start(&["slate://exp1/nobody/*"]), &["no property of the agent", "slate list"]);
    running.fails(
        5,
        &["record", "snapshot"],
        &["keeps nothing of its last seconds", "record.flight.enabled=false"],
    );
    assert_eq!(running.done(&["record", "status"]).lines().next(), Some("nothing is recorded"));
}

#[test]
fn a_tools_recording_ends_well_with_its_agent() {
    let mut running = Running::new("live-ends");
    running.start("exp1", &[&RUN[..], &["--set", "record.enabled=true"]].concat());
    // The recording of the configuration begins with the run.
    wait(&running, 0.1);
    running.done(&["record", "start", "--out", "tool.mcap"]);
    wait(&running, 0.5);
    running.done(&["record", "stop", "here/run.mcap"]);
    let before = std::fs::metadata(running.folder().join("here/run.mcap")).unwrap().len();
    wait(&running, 0.5);
    running.interrupt();
    let output = running.finish();
    assert!(text(&output.stdout).contains("recording: here/run.mcap ("), "{output:?}");
    assert_eq!(std::fs::metadata(running.folder().join("here/run.mcap")).unwrap().len(), before);
    assert!(metadata(&running.folder().join("tool.mcap"), "end").contains_key("digest"));
    for file in ["tool.mcap", "here/run.mcap"] {
        running.done(&["bag", "verify", file]);
    }
    let verified = running.call(&["replay", "--verify", "here/run.mcap"]);
    assert!(text(&verified.stdout).contains("up to where the recording was cut off"), "{verified:?}");
}

#[test]
fn configuration_rules_select_values_and_show_errors() {
    let mut running = Running::new("live-rules");
    let rules = r#"record.rules=[{ select = "/simulator/**", rate = 10.0 }, { select = ["/r2/*/timing"], on_change = true }]"#;
    running.start("exp1", &[&RUN[..], &["--set", "record.enabled=true", "--set", rules]].concat());
    wait(&running, 1.0);
    running.interrupt();
    running.finish();
    let all = values(&running.folder().join("here/run.mcap"));
    // The Sensor passes on each measurement of the simulator.
    let (slow, whole) = (all["/simulator/r2/sonar"].len(), all["/r2/sonar/value"].len());
    assert!(slow > 5 && slow < whole / 4, "{slow} of {whole}");
    let verified = running.call(&["replay", "--verify", "here/run.mcap"]);
    assert!(text(&verified.stdout).contains("only a part of the values is recorded"));
    for (wrong, words) in [
        (r#"record.rules=[{ rate = 10.0 }]"#, "has no `select`"),
        (r#"record.rules=[{ select = "/r2/**" }]"#, "neither `rate` nor `on_change`"),
        (r#"record.rules=[{ select = "/r2/**", rate = 0.0 }]"#, "`rate` is from 0.001"),
        (r#"record.rules=["/r2/**"]"#, "`rules` takes a table"),
        (r#"record.flight.memory="1kB""#, "`memory` is from 1 MiB"),
        (r#"record.flight.trigger=["falt"]"#, "`trigger` can't be `falt`"),
        (r#"record.chunk="1TiB""#, "`chunk` can't be more than 256 MiB"),
        ("record.flight.files=0", "`files` is a whole number from 1"),
    ] {
        running.fails(2, &[&RUN[..], &["--set", wrong]].concat(), &[words]);
    }
}

#[test]
fn flight_recorder_saves_on_request() {
    let mut running = Running::new("live-flight");
    running.start("exp1", &[&RUN[..], &FLIGHT, &["--set", "record.flight.keep=1s"]].concat());
    wait(&running, 2.5);
    let said = running.done(&["record", "snapshot", "last.mcap"]);
    assert!(said.starts_with("last.mcap has the last "), "{said}");
    running.fails(5, &["record", "snapshot", "last.mcap"], &["last.mcap can't be written: File exists"]);
    running.done(&["bag", "verify", "last.mcap"]);
    let file = running.folder().join("last.mcap");
    let flight = metadata(&file, "flight");
    let number = |name: &str| flight[name].parse::<u64>().unwrap();
    let (from, to) = (number("from_ns"), number("to_ns"));
    assert_eq!(flight["trigger"], "a tool");
    assert!(to - from >= 1_000_000_000, "{flight:?}");
    let all = values(&file);
    let truth = &all["/simulator/r2/truth"];
    assert!(truth.len() >= 50 && truth.last().unwrap().1 == to, "{} until {to}", truth.len());
    let numbers: Vec<_> = truth.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, (numbers[0]..numbers[0] + numbers.len() as u32).collect::<Vec<_>>());
    // What was written long before holds all the same.
    assert_eq!(all["/r2/planner/params"], [(1, from)]);
    assert!(metadata(&file, "links").len() > 10 && metadata(&file, "run")["seed"] == "0");
}

#[test]
fn the_last_seconds_are_kept_by_default_and_not_written_unasked() {
    let mut running = Running::new("live-default");
    running.start("exp1", &RUN);
    wait(&running, 1.0);
    running.done(&["stop", "a test"]);
    running.done(&["record", "snapshot", "last.mcap"]);
    running.done(&["bag", "verify", "last.mcap"]);
    let all = values(&running.folder().join("last.mcap"));
    assert_eq!(all["/simulator/r2/truth"][0].0, 1, "from the beginning on");
    let status = status(&running);
    assert_eq!(status["flight"]["saved"], serde_json::json!([]), "{status}");
    running.interrupt();
    running.finish();
    let left = std::fs::read_dir(running.folder().join("here")).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert!(!left.iter().any(|name| name.ends_with(".mcap")), "{left:?}");
}

#[test]
fn a_recording_without_room_for_its_beginning_leaves_no_file() {
    let mut running = Running::new("live-full");
    // A limit of the size of files, which fails like a disk that is full.
    let own = running.command(&RUN);
    let mut limited = std::process::Command::new("sh");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 2; exec \"$@\"", "sh"]).arg(own.get_program());
    limited.args(own.get_args()).current_dir(running.folder()).env("XDG_RUNTIME_DIR", running.sockets());
    running.launch("exp1", limited);
    let words = ["full.mcap can't be made: File too large", "a disk with room"];
    running.fails(5, &["record", "start", "--out", "full.mcap"], &words);
    assert!(!running.folder().join("full.mcap").exists());
    // The last seconds stay in memory, for a disk with room.
    running.fails(5, &["record", "snapshot", "last.mcap"], &["last.mcap can't be written: "]);
    assert!(!running.folder().join("last.mcap").exists());
}

#[test]
fn a_trigger_saves_the_last_seconds_but_not_again_and_again() {
    let mut running = Running::new("live-trigger");
    // Long enough for the three commands of a second stop on a busy machine.
    let often = ["--set", "record.flight.every=3s", "--set", "record.flight.files=2"];
    running.start("exp1", &[&RUN[..], &FLIGHT, &often].concat());
    for round in 0..3 {
        running.done(&["stop", "a test"]);
        running.done(&["reset"]);
        running.done(&["arm"]);
        let (newest, oldest) = (round + 1, round as i64 - 1);
        let file = |number: i64| running.folder().join(format!("here/flight-stop-{number}.mcap"));
        wait_for("the file is there", || {
            let saved = status(&running)["flight"]["saved"].to_string();
            saved.contains(&format!("flight-stop-{newest}.mcap"))
        });
        assert!(oldest < 1 || !file(oldest).exists(), "two files are kept");
        // This one comes too soon.
        running.done(&["stop", "at once"]);
        running.done(&["reset"]);
        running.done(&["arm"]);
        wait(&running, 3.0);
    }
    let status = status(&running);
    assert_eq!(status["flight"]["skipped"].as_u64(), Some(3), "{status}");
    let file = running.folder().join("here/flight-stop-3.mcap");
    running.done(&["bag", "verify", "here/flight-stop-3.mcap"]);
    let flight = metadata(&file, "flight");
    assert_eq!((&*flight["trigger"], &*flight["property"]), ("stop", "/r2/wheels/gate"));
    let all = values(&file);
    let time: u64 = flight["time_ns"].parse().unwrap();
    assert!(all["/r2/wheels/gate"].iter().any(|(_, own)| *own == time), "what happened is in it");
    let log = running.done(&["log"]);
    assert!(
        log.contains("are saved in here/flight-stop-1.mcap, as /r2/wheels/gate reported a stop"),
        "{log}"
    );
}

#[test]
fn a_reflex_is_a_trigger_too() {
    let mut running = Running::new("live-triggers");
    let all = ["--set", r#"record.flight.trigger=["fault", "reflex"]"#, "--set", "world.layout=\"authors\""];
    running.start("exp1", &[&RUN[..], &FLIGHT, &all].concat());
    wait_for("a reflex is saved", || {
        status(&running)["flight"]["saved"].to_string().contains("flight-reflex-1")
    });
    let flight = metadata(&running.folder().join("here/flight-reflex-1.mcap"), "flight");
    assert_eq!(flight["property"], "/r2/execute/status");
}

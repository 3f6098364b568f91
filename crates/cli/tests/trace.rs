//! What modules do when, recorded from an agent that runs.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what it is about"
)]

mod common;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use common::Running;
use serde_json::Value;

/// The spans of each thread, by its name: what each is called, when it begins and how long it takes, in microseconds.
fn tracks(trace: &Value) -> BTreeMap<String, Vec<(String, f64, f64)>> {
    let events = trace["traceEvents"].as_array().unwrap();
    let of = |phase: &'static str| events.iter().filter(move |event| event["ph"] == phase);
    assert_eq!(of("M").count() + of("X").count(), events.len(), "only names and spans");
    let process = of("M").find(|event| event["name"] == "process_name").unwrap();
    assert_eq!(process["args"]["name"], "slate");
    let threads: BTreeMap<u64, String> = of("M")
        .filter(|event| event["name"] == "thread_name")
        .map(|event| (event["tid"].as_u64().unwrap(), event["args"]["name"].as_str().unwrap().into()))
        .collect();
    let mut tracks: BTreeMap<_, Vec<_>> = threads.values().map(|name| (name.clone(), Vec::new())).collect();
    for event in of("X") {
        assert_eq!(event["pid"], process["pid"]);
        let (start, duration) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
        assert!(start >= 0.0 && duration >= 0.0, "{event}");
        let thread = &threads[&event["tid"].as_u64().unwrap()];
        tracks.get_mut(thread).unwrap().push((event["name"].as_str().unwrap().into(), start, duration));
    }
    tracks
}

#[test]
fn a_trace_of_a_running_agent_opens_in_perfetto() {
    let mut running = Running::new("trace");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    for file in ["first.json", "again.json"] {
        let said = running.done(&["trace", "--seconds", "0.5", "--out", file]);
        let path = running.folder().join(file);
        assert!(said.contains(&path.display().to_string()) && said.contains("ui.perfetto.dev"), "{said}");
        let trace: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let tracks = tracks(&trace);
        let spans: usize = tracks.values().map(Vec::len).sum();
        assert!(said.starts_with(&format!("{spans} spans in ")), "{spans}: {said}");
        // At 20 ms a cycle there are about 25; a busy machine makes fewer.
        for module in ["simulator", "referee", "r2/range_monitor", "r2/planner", "r2/execute"] {
            let track = &tracks[module];
            assert!((3..200).contains(&track.len()), "{module}: {}", track.len());
            assert!(track.iter().all(|span| span.0 == module));
        }
        let main_loop = &tracks["main loop"];
        let cycles: Vec<_> = main_loop.iter().filter(|span| span.0 == "cycle").collect();
        assert!(cycles.len() >= 3 && main_loop.iter().any(|span| span.0 == "Act"), "{main_loop:?}");
        let (first, last) = (cycles[0], cycles[cycles.len() - 1]);
        assert!(last.1 - first.1 < 3e6, "only what was asked for");
        for (_, start, duration) in &tracks["r2/planner"] {
            let within = |cycle: &&&(String, f64, f64)| {
                *start >= cycle.1 - 0.002 && start + duration <= cycle.1 + cycle.2 + 0.002
            };
            // The last cycle may not have ended when the recording did.
            assert!(cycles.iter().any(|cycle| within(&cycle)) || *start > last.1, "{start} is in no cycle");
        }
    }
    // What was disturbed is nothing.
    assert!(running.done(&["module", "list"]).contains("WORKING"));
}

#[test]
fn a_trace_that_can_not_be_made_is_refused_before_it_is_recorded() {
    let mut running = Running::new("no_trace");
    running.fails(2, &["trace"], &["no agent runs here"]);
    for seconds in ["0", "-1", "nan", "inf", "3601", "soon"] {
        let seconds = format!("--seconds={seconds}");
        running.fails(2, &["trace", &seconds], &["more than 0 and at most 3600"]);
    }
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let start = Instant::now();
    for path in ["nowhere/trace.json", ".", "/dev/full"] {
        let words = ["can't be written", "name a file in a folder that exists"];
        running.fails(1, &["trace", "--seconds", "3600", "--out", path], &words);
    }
    assert!(start.elapsed() < Duration::from_secs(600));
    assert!(!running.folder().join("trace.json").exists());
    // It is not left recording.
    running.done(&["trace", "--seconds", "0.1"]);
    assert!(running.folder().join("trace.json").exists());
}

//! Activity of modules over time, recorded from an agent that runs.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what it is about"
)]

use crate::common;

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::DirBuilderExt;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::{Running, json, text, wait_for};
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
        let with_spans = tracks.values().filter(|track| !track.is_empty()).count();
        assert!(
            said.starts_with(&format!("{spans} spans of {with_spans} tracks over 0.5")),
            "{spans}: {said}"
        );
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
fn an_impossible_trace_is_refused_before_it_is_recorded() {
    let mut running = Running::new("no_trace");
    running.fails(3, &["trace"], &["no agent is running"]);
    for seconds in ["0", "-1", "nan", "inf", "3601", "soon"] {
        let seconds = format!("--seconds={seconds}");
        running.fails(2, &["trace", &seconds], &["more than 0 and at most 3600"]);
    }
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let start = Instant::now();
    for path in ["nowhere/trace.json", ".", "/dev/full"] {
        let words = ["can't be written", "name a file in a folder that exists"];
        running.fails(5, &["trace", "--seconds", "3600", "--out", path], &words);
    }
    assert!(start.elapsed() < Duration::from_secs(600));
    assert!(!running.folder().join("trace.json").exists());
    // It is not left recording.
    running.done(&["trace", "--seconds", "0.1"]);
    assert!(running.folder().join("trace.json").exists());
}

/// Records for an hour, and is under way.
fn recording(running: &Running, file: &str) -> Child {
    let mut command = running.command(&["trace", "--seconds", "3600", "--out", file]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let part = running.folder().join(format!("{file}.part"));
    wait_for("it begins", || part.exists());
    std::thread::sleep(Duration::from_millis(300));
    child
}

fn interrupt(child: Child) -> Output {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

/// How many cycles a file has.
fn cycles(file: &Path) -> usize {
    let trace: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    tracks(&trace)["main loop"].iter().filter(|span| span.0 == "cycle").count()
}

#[test]
fn an_interrupted_trace_is_kept_and_a_killed_one_leaves_nothing() {
    let mut running = Running::new("trace-interrupted");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let older = running.folder().join("killed.json");
    std::fs::write(&older, "older").unwrap();
    let mut killed = recording(&running, "killed.json");
    let output = interrupt(recording(&running, "kept.json"));
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stdout).contains("kept.json; open it"), "{output:?}");
    assert!(cycles(&running.folder().join("kept.json")) >= 3);
    killed.kill().unwrap();
    killed.wait().unwrap();
    wait_for("what was recorded is removed", || !running.folder().join("killed.json.part").exists());
    assert_eq!(std::fs::read_to_string(&older).unwrap(), "older");
    assert!(running.done(&["module", "list"]).contains("WORKING"));
}

#[test]
fn a_trace_ends_with_its_agent_and_is_kept() {
    let mut running = Running::new("trace_end");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let child = recording(&running, "trace.json");
    running.interrupt();
    let output = child.wait_with_output().unwrap();
    running.finish();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(
        text(&output.stderr).contains("the agent has ended; the trace is complete until then"),
        "{output:?}"
    );
    assert!(text(&output.stdout).contains(" tracks over "), "{output:?}");
    assert!(cycles(&running.folder().join("trace.json")) >= 3);
}

#[test]
fn a_trace_whose_agent_is_killed_leaves_nothing_and_says_so() {
    let mut running = Running::new("trace_killed");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let older = running.folder().join("trace.json");
    std::fs::write(&older, "older").unwrap();
    let child = recording(&running, "trace.json");
    running.kill();
    let output = child.wait_with_output().unwrap();
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("error: agent `exp1` ended before the trace was complete"), "{stderr}");
    assert!(stderr.contains("help: the incomplete file is removed"), "{stderr}");
    assert!(!running.folder().join("trace.json.part").exists());
    assert_eq!(std::fs::read_to_string(&older).unwrap(), "older");
}

#[test]
fn a_disk_without_room_ends_a_trace_in_words() {
    let mut running = Running::new("trace_full");
    // The agent may write no file of more than 32 KiB.
    let mut command = Command::new("sh");
    let limit = "trap '' XFSZ; ulimit -f 64; exec \"$0\" \"$@\"";
    command.args(["-c", limit, env!("CARGO_BIN_EXE_slate"), "run", "exp1", "--headless", "--rate", "1"]);
    command.current_dir(running.folder()).env("XDG_RUNTIME_DIR", running.sockets());
    running.launch("exp1", command);
    let file = running.folder().join("trace.json");
    std::fs::write(&file, "older").unwrap();
    let start = Instant::now();
    let words = ["trace.json can't be written", "large", "help: record for less time"];
    running.fails(5, &["trace", "--seconds", "3600"], &words);
    assert!(start.elapsed() < Duration::from_secs(600));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "older");
    assert!(!running.folder().join("trace.json.part").exists());
    assert!(running.done(&["module", "list"]).contains("WORKING"));
    running.interrupt();
    let log = text(&running.finish().stderr);
    let line = log.lines().find(|line| line.contains("the trace has failed")).unwrap_or(&log);
    assert!(line.contains(" error agent: "), "{line}");
}

/// An agent that answers so to each request.
fn say(listener: &UnixListener, answers: &[&str]) {
    let (mut stream, _) = listener.accept().unwrap();
    let mut reader = BufReader::new(stream.try_clone().unwrap());
    for answer in [r#"{"api":1,"name":"busy"}"#].iter().chain(answers) {
        let (mut line, mut length) = (String::new(), 0);
        while reader.read_line(&mut line).unwrap() > 2 {
            let header = line.to_ascii_lowercase();
            if let Some(value) = header.strip_prefix("content-length:") {
                length = value.trim().parse().unwrap();
            }
            line.clear();
        }
        std::io::copy(&mut reader.by_ref().take(length), &mut std::io::sink()).unwrap();
        let length = answer.len();
        write!(stream, "HTTP/1.1 200 OK\r\nContent-Length: {length}\r\n\r\n{answer}").unwrap();
    }
}

#[test]
fn missing_data_is_reported_without_failure() {
    let running = Running::new("trace_missing");
    let folder = running.sockets().join("slate");
    std::fs::DirBuilder::new().mode(0o700).create(&folder).unwrap();
    let listener = UnixListener::bind(folder.join("busy.sock")).unwrap();
    let entry = r#"{"file":"/x","ended":true,"from":1000000000,"to":1500000000,"tracks":[
        {"name":"main loop","spans":90,"missing":10},{"name":"r2/planner","spans":50,"missing":0},
        {"name":"r2/execute","spans":40,"missing":7}]}"#;
    let entry = entry.replace('\n', "");
    let under_way = entry.replace("true", "false");
    let answers = ["null", &under_way, &entry];
    let agent = std::thread::spawn({
        let answers = answers.map(str::to_owned);
        move || (0..2).for_each(|_| say(&listener, &answers.each_ref().map(String::as_str)))
    });
    let arguments = ["trace", "--agent", "busy", "--seconds", "0.1"];
    let output = running.call(&arguments);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stdout).starts_with("180 spans of 3 tracks over 0.50 s in "), "{output:?}");
    let warning = "warning: 17 spans are missing, as the disk was too slow: \
                   10 of main loop, 7 of r2/execute; the trace marks where";
    assert_eq!(text(&output.stderr).trim_end(), warning);
    let output = running.call(&[&arguments[..], &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let mut wanted: Value = serde_json::from_str(&entry).unwrap();
    wanted["schema"] = "slate.trace/1".into();
    assert_eq!(json(&output), wanted);
    assert_eq!(text(&output.stderr).trim_end(), warning);
    agent.join().unwrap();
}

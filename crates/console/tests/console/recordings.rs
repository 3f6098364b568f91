//! Recordings started and stopped by clients, and the flight recorder.

use std::io::{BufReader, Write};

use serde_json::{Value as Json, json};
use slate_bag as bag;

use crate::agent::Running;
use crate::client::reply;
use crate::modules::CONFIGURATION;

fn with_memory(name: &str) -> Running {
    Running::start_with(
        name,
        &format!("{CONFIGURATION}\n[console]\nport = 0\n[record.flight]\nkeep = \"60s\""),
    )
}

/// The values of a topic of a file: number and time.
fn values(file: &str, topic: &str) -> Vec<(u64, u64)> {
    let mut reader = bag::Reader::open(file).unwrap();
    let mut all = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        if message.channel.topic == topic {
            all.push((u64::from(message.sequence), message.publish_time));
        }
    }
    all
}

#[test]
fn a_recording_is_begun_shown_ended_and_listed() {
    let run = Running::start("record");
    let operator = run.client("operator");
    let none = run.get("/recordings").json();
    assert_eq!((&none["recordings"], &none["files"]), (&json!([]), &json!([])), "{none}");
    let wish = json!({ "select": ["/sensor/**"], "exclude": ["/**/image"] });
    let begun = operator.send("POST", "/recordings/mine", Some(&wish)).json();
    let file = begun["file"].as_str().unwrap().to_owned();
    assert!(file.ends_with("mine.mcap"), "{begun}");
    let going = || run.get("/recordings").json()["recordings"][0]["values"].as_u64().unwrap_or(0);
    // Of all its properties; the one that is looked at has its part of them.
    run.wait_for("values in the recording", || going() > 100);
    let ended = operator.send("POST", "/recordings/mine/stop", None).json();
    assert_eq!((&ended["file"], &ended["dropped"]), (&json!(file), &json!(0)));
    let counts = values(&file, "/sensor/count");
    assert!(counts.len() > 5 && counts.windows(2).all(|two| two[0].0 + 1 == two[1].0), "{counts:?}");
    assert!(values(&file, "/sensor/image").is_empty() && values(&file, "/driver/heard").is_empty());
    let listed = run.get("/recordings").json();
    assert_eq!(listed["recordings"], json!([]));
    let bytes = std::fs::metadata(&file).unwrap().len();
    assert_eq!(listed["files"], json!([{ "name": "mine", "bytes": bytes }]));
    let fetched = run.get("/recordings/mine");
    assert_eq!((fetched.status, fetched.header("content-type")), (200, "application/octet-stream"));
    assert!(fetched.body == std::fs::read(&file).unwrap(), "{} of {bytes} bytes", fetched.body.len());
    operator.send("POST", "/recordings/more", None).json();
    assert!(run.get("/recordings/more").problem(409).contains("still being recorded"));
    operator.send("POST", "/recordings/more/stop", None).json();
    run.get("/recordings/none").problem(404);
    run.get("/recordings/mine/stop").problem(405);
    // What is there stays, and what is not is not.
    assert!(operator.send("POST", "/recordings/mine", None).problem(409).contains("already"));
    assert!(
        operator.send("POST", "/recordings/mine/stop", None).problem(409).contains("nothing is recorded")
    );
    assert!(operator.send("POST", "/recordings/..%2fmine", None).problem(400).contains("letters"));
    let wrong = operator.send("POST", "/recordings/other", Some(&json!({ "rate": -1.0 })));
    assert!(wrong.problem(409).contains("rate"));
    assert!(
        operator
            .send("POST", "/recordings/other", Some(&json!({ "speed": 1 })))
            .problem(422)
            .contains("speed")
    );
    assert!(run.client("viewer").send("POST", "/recordings/other", None).problem(403).contains("viewer"));
    assert!(!run.folder.join("other.mcap").exists());
}

#[test]
fn the_last_seconds_are_saved_and_looked_at() {
    let run = with_memory("flight");
    let enough = || run.number("sensor/count/value") > 60.0;
    run.wait_for("some values", enough);
    let saved = run.client("operator").send("POST", "/recordings/last/snapshot", None).json();
    let file = saved["file"].as_str().unwrap();
    let (first, last) = {
        let kept = values(file, "/sensor/count");
        (kept[0], *kept.last().unwrap())
    };
    assert_eq!(first.0, 1, "all of it is in memory");
    let history = |query: &str| -> Json { run.get(&format!("/history/{}/{query}", run.name())).json() };
    // What held at a time is the last value until then, and a field of it is one of its own.
    let date = values(file, "/sensor/count")[30].1;
    let all = history("sensor/count/value");
    let kept = all["values"].as_array().unwrap();
    assert!(kept.len() as u64 >= last.0 && all["count"].as_u64().unwrap() == kept.len() as u64, "{all}");
    assert!(
        kept.iter()
            .zip(1..)
            .all(|(own, number)| own["sequence"] == number && own["value"] == f64::from(number))
    );
    let time = kept[30]["time"].as_u64().unwrap();
    assert!(date > time, "a file has dates");
    let then = history(&format!("sensor/count/value?to={}&limit=1", time + 1));
    assert_eq!(then["values"], json!([kept[30]]));
    assert_eq!(then["count"], 31);
    let part = history(&format!("sensor/count?from={}&to={time}&pointer=/value", kept[10]["time"]));
    assert_eq!(part["values"], json!(kept[10..=30]));
    // Few of many are spread over all.
    let few = history(&format!("sensor/count/value?to={time}&limit=4"));
    let told: Vec<_> =
        few["values"].as_array().unwrap().iter().map(|own| own["sequence"].as_u64().unwrap()).collect();
    assert_eq!(told, [7, 15, 23, 31]);
    assert!(run.get(&format!("/history/{}/sensor/cont", run.name())).problem(404).contains("sensor/count"));
    assert!(run.get(&format!("/history/{}/sensor/count/z", run.name())).problem(422).contains("value"));
    assert!(run.get(&format!("/history/{}/driver/notes", run.name())).problem(422).contains("messages"));
    assert!(run.get(&format!("/history/{}/sensor/count?limit=0", run.name())).problem(400).contains("limit"));
    for wrong in ["", "-1", "1:", ":1", "1:2:3", "now"] {
        let problem = run.get(&format!("/history/{}/sensor/count?from={wrong}", run.name())).problem(400);
        assert!(problem.contains("`from`") && problem.contains("nanoseconds"), "{problem}");
    }
    assert!(run.get("/history/other/sensor/count").problem(422).contains("other agent"));
}

#[test]
fn answer_of_the_past_is_bounded_and_says_where_to_continue() {
    let run = with_memory("flight-bound");
    let seen = || run.number("sensor/count/value");
    run.wait_for("more images than an answer may have", || seen() > 400.0);
    let history = |query: &str| -> Json { run.get(&format!("/history/{}/{query}", run.name())).json() };
    let to = history("sensor/image?limit=1")["to"].as_u64().unwrap();
    let whole = history(&format!("sensor/image/width?to={to}&limit=10000"));
    let number = |own: &Json| own["sequence"].as_u64().unwrap();
    let wanted: Vec<_> = whole["values"].as_array().unwrap().iter().map(number).collect();
    assert_eq!((&whole["left_out"], &whole["next"]), (&json!(0), &Json::Null), "numbers are small");
    let (mut told, mut from, mut answers) = (Vec::new(), "0".to_owned(), 0);
    loop {
        let part = history(&format!("sensor/image?from={from}&to={to}&limit=10000"));
        let bytes = part.to_string().len();
        assert!(bytes < 9 << 20, "{bytes} bytes");
        let values = part["values"].as_array().unwrap();
        assert_eq!(part["values"][0]["value"]["data"].as_array().unwrap().len(), 64 * 64 * 3);
        let left = part["left_out"].as_u64().unwrap();
        assert_eq!(part["count"].as_u64().unwrap(), left + values.len() as u64);
        told.extend(values.iter().map(number));
        answers += 1;
        match part["next"].as_str() {
            Some(next) => from = next.into(),
            None => break,
        }
        assert!(left > 0 && bytes > 7 << 20);
    }
    assert_eq!(told, wanted);
    assert!(answers > 1);
}

#[test]
fn omissions_of_flight_recorder_have_reason() {
    let text = "[record]\nexclude = [\"/sensor/place\"]\n[record.flight]\nlargest = \"1KiB\"";
    let run = Running::start_with("flight-largest", &format!("{CONFIGURATION}\n[console]\nport = 0\n{text}"));
    let ask = |path: &str| run.get(&format!("/history/{}/{path}", run.name()));
    let problem = ask("sensor/image").problem(409);
    assert!(
        problem.contains("/sensor/image") && problem.contains("record.flight.largest is 1024"),
        "{problem}"
    );
    let problem = ask("sensor/place").problem(409);
    assert!(problem.contains("/sensor/place, which [record] does not choose"), "{problem}");
    assert!(ask("sensor/count").json()["count"].as_u64() > Some(1));
}

#[test]
fn an_agent_that_keeps_nothing_says_how_it_would() {
    let run = Running::start_with(
        "no-flight",
        &format!("{CONFIGURATION}\n[console]\nport = 0\n[record.flight]\nenabled = false"),
    );
    let problem = run.get(&format!("/history/{}/sensor/count", run.name())).problem(409);
    assert!(problem.contains("record.flight.enabled=false"), "{problem}");
    let problem = run.client("operator").send("POST", "/recordings/x/snapshot", None).problem(409);
    assert!(problem.contains("record.flight.enabled=false"), "{problem}");
    assert!(!run.folder.join("x.mcap").exists());
    assert_eq!(run.get("/playback").json(), Json::Null);
    let problem = run.client("operator").send("POST", "/playback/pause", None).problem(409);
    assert!(problem.contains("plays no recording"), "{problem}");
}

#[test]
fn trace_over_tcp_is_kept_when_the_agent_ends() {
    let run = Running::start("trace-end");
    let developer = run.client("developer");
    let body = json!({ "file": "end" }).to_string();
    let head = developer.head("POST", "/api/v1/trace");
    let length = body.len();
    let request = format!("{head}Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}");
    let mut stream = developer.connect();
    stream.write_all(request.as_bytes()).unwrap();
    reply(&mut BufReader::new(stream.try_clone().unwrap())).json();
    let folder = run.folder.clone();
    drop(run);
    let files = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().file_name());
    let names: Vec<_> = files.map(|name| name.to_string_lossy().into_owned()).collect();
    assert!(names.iter().any(|name| name.contains("end") && name.ends_with(".json")), "{names:?}");
    drop(stream);
}

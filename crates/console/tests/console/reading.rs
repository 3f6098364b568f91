//! Readable properties, and their forms.

use std::io::{BufRead, BufReader, Write};

use serde_json::{Value as Json, json};

use crate::agent::Running;

#[test]
fn a_value_is_read_at_its_url() {
    let run = Running::start("read");
    let first = run.get(&run.at("sensor/count"));
    let body = first.json();
    assert!(body["value"]["value"].as_f64().unwrap() > 2.0, "{body}");
    assert_eq!(first.header("etag"), format!("\"{}\"", body["sequence"]));
    assert!(body["time"].as_u64().unwrap() > 0);
    assert_eq!(run.get(&run.at("sensor/place/x?bare")).json(), json!(1.5));
    assert_eq!(run.get(&run.at("sensor/place?bare")).json(), json!({ "x": 1.5, "y": null }), "NaN is null");
    // A slash may be written otherwise.
    assert_eq!(run.get(&run.at("sensor%2Fplace%2Fx?bare=true")).json(), json!(1.5));
    let text = run.client("viewer").with("Accept", "text/plain").send("GET", &run.at("sensor/place/x"), None);
    assert_eq!((text.text().as_str(), text.header("content-type")), ("1.5\n", "text/plain; charset=utf-8"));
}

#[test]
fn parts_of_a_value_are_selected_by_pointer_and_path() {
    let run = Running::start("select");
    let at = run.at("sensor/place");
    assert_eq!(run.get(&format!("{at}?pointer=/x&bare")).json(), json!(1.5));
    assert_eq!(run.get(&format!("{at}?select=$.*&bare")).json(), json!([1.5, null]));
    assert!(run.get(&format!("{at}?pointer=/z")).problem(404).contains("/z"));
    assert!(run.get(&format!("{at}?pointer=x")).problem(400).contains("slash"));
    assert_eq!(run.get(&format!("{at}?select=$[?@%20%3E%201]&bare")).json(), json!([1.5]));
    assert!(run.get(&format!("{at}?select=$[")).problem(400).contains("JSONPath: at position 1"));
    assert!(run.get(&format!("{at}?pointer=/x&select=$.x")).problem(400).contains("one of the two"));
}

#[test]
fn missing_name_is_reported_with_suggestion() {
    let run = Running::start("missing");
    assert!(run.get(&run.at("sensor/cont")).problem(404).contains("sensor/count"));
    assert!(run.get(&run.at("sensor/place/z")).problem(422).contains('x'));
    assert!(run.get("/slate/nobody/sensor/count").problem(404).contains("nobody"));
    assert!(run.get("/nothing").problem(404).contains("openapi"));
    assert!(run.get("/slate/x/../../etc").problem(404).contains("names"));
    assert!(run.get(&run.at("sensor/count?colour=red")).problem(400).contains("colour"));
    assert!(run.get(&run.at("driver/notes")).problem(422).contains("messages"));
    let wrong = run.client("viewer").with("Accept", "image/png").send("GET", &run.at("sensor/count"), None);
    assert!(wrong.problem(406).contains("no image"));
    let wrong = run.client("viewer").with("Accept", "video/mp4").send("GET", &run.at("sensor/count"), None);
    assert!(wrong.problem(406).contains("application/json"));
}

#[test]
fn an_image_is_a_picture() {
    let run = Running::start("image");
    let png = run.get(&run.at("sensor/image?format=png"));
    assert_eq!((png.status, png.header("content-type")), (200, "image/png"));
    assert!(png.body.starts_with(b"\x89PNG\r\n\x1a\n"));
    assert_eq!(png.body[16..24], [0, 0, 0, 64, 0, 0, 0, 64]);
    let jpeg = run.client("viewer").with("Accept", "image/avif,image/*,*/*;q=0.8").send(
        "GET",
        &run.at("sensor/image"),
        None,
    );
    assert_eq!(jpeg.header("content-type"), "image/jpeg");
    assert!(jpeg.body.starts_with(&[0xff, 0xd8]));
    let mut stream = run.client("viewer").connect();
    let head =
        run.client("viewer").head("GET", &format!("/api/v1{}", run.at("sensor/image?format=mjpeg&rate=50")));
    stream.write_all(format!("{head}\r\n").as_bytes()).unwrap();
    let pictures = BufReader::new(stream).split(b'\n').map_while(Result::ok);
    let mut times = Vec::new();
    let mut count = 0;
    for line in pictures {
        count += u32::from(line.starts_with(b"--slate-picture"));
        let text = String::from_utf8_lossy(&line);
        times.extend(text.strip_prefix("Slate-Time: ").and_then(|time| time.trim().parse::<u64>().ok()));
        if count == 4 {
            break;
        }
    }
    assert!(times.len() == 3 && times.is_sorted_by(|a, b| a < b), "each says when it was written: {times:?}");
}

#[test]
fn values_come_as_events() {
    let run = Running::start("events");
    let client = run.client("viewer").with("Accept", "text/event-stream");
    let mut stream = client.connect();
    let head = client.head("GET", &format!("/api/v1{}", run.at("sensor/count?rate=50")));
    stream.write_all(format!("{head}\r\n").as_bytes()).unwrap();
    let lines = BufReader::new(stream).lines().map_while(Result::ok);
    let values: Vec<_> = lines
        .filter_map(|line| {
            Some(serde_json::from_str::<serde_json::Value>(line.strip_prefix("data: ")?).unwrap())
        })
        .take(5)
        .collect();
    let sequences: Vec<_> = values.iter().map(|value| value["sequence"].as_u64().unwrap()).collect();
    assert!(sequences.is_sorted_by(|a, b| a < b), "{sequences:?}");
}

#[test]
fn a_queue_is_read_from_where_one_was() {
    let run = Running::start("queue");
    run.wait_for("some values", || run.number("sensor/count/value") > 6.0);
    let at = format!("/queues/{}/sensor/count", run.name());
    let first = run.get(&format!("{at}?limit=3&select=$.value")).json();
    let values = first["values"].as_array().unwrap();
    assert_eq!(values.len(), 3, "{first}");
    assert_eq!(first["next"], values[2]["sequence"]);
    let after = run.get(&format!("{at}?limit=1&after={}", first["next"])).json();
    let gone = after["lost"].as_u64().unwrap();
    assert_eq!(after["values"][0]["sequence"].as_u64().unwrap(), first["next"].as_u64().unwrap() + gone + 1);
}

#[test]
fn existing_items_are_listed() {
    let run = Running::start("lists");
    let found = run.get("/properties?pattern=sensor/*&values").json();
    let paths: Vec<_> =
        found.as_array().unwrap().iter().map(|entry| entry["path"].as_str().unwrap()).collect();
    assert!(paths.contains(&"sensor/count") && paths.contains(&"sensor/params"), "{paths:?}");
    let params = found.as_array().unwrap().iter().find(|entry| entry["path"] == "sensor/params").unwrap();
    assert_eq!(params["value"], json!({ "step": 1.0, "label": "robot" }));
    let schema = run.get("/interfaces/Place").json();
    assert_eq!(schema["properties"]["x"]["x-unit"], "m");
    assert!(run.get("/interfaces/Plac").problem(404).contains("Place"));
    assert_eq!(run.get("/documents/world").json(), json!({ "walls": [] }));
    let agent = run.client("viewer").send("GET", "/agent", None).json();
    assert_eq!((&agent["role"], &agent["name"]), (&json!("viewer"), &json!(run.name())));
    for path in [
        "/modules",
        "/plugins",
        "/links",
        "/graph",
        "/peers",
        "/settings",
        "/log",
        "/statistics",
        "/threads",
        "/actuators",
        "",
    ] {
        assert!(!run.get(path).json().is_null(), "{path}");
    }
    assert!(run.get("/metrics").text().contains("slate_module_ticks_total{module=\"sensor\"}"));
    let lines = run.get("/log?level=warn").json();
    assert!(lines.as_array().unwrap().iter().all(|line| line["level"] != "info"));
}

#[test]
fn graph_has_a_position_for_each_module_that_is_not_hidden() {
    let run = Running::start("graph");
    let names = |list: &Json| -> Vec<String> {
        list.as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap().to_owned()).collect()
    };
    let modules = names(&run.get("/modules").json());
    let graph = run.get("/graph?width=900&height=600").json();
    let drawn = names(&graph["nodes"]);
    assert!(modules.iter().all(|name| drawn.contains(name)), "{graph}");
    for node in graph["nodes"].as_array().unwrap() {
        let right = node["x"].as_f64().unwrap() + graph["node_width"].as_f64().unwrap();
        let bottom = node["y"].as_f64().unwrap() + graph["node_height"].as_f64().unwrap();
        assert!(right <= graph["width"].as_f64().unwrap() && bottom <= graph["height"].as_f64().unwrap());
    }
    let hidden = run.get("/graph?hide=nothing+sensor").json();
    assert!(names(&hidden["nodes"]).iter().all(|name| !name.contains("sensor")), "{hidden}");
    assert!(run.get("/graph?width=-1").problem(400).contains("width"));
}

#[test]
fn every_operation_is_in_the_document() {
    let run = Running::start("document");
    let document = run.get("/openapi.json").json();
    let index = run.get("").json();
    let operations = index["operations"].as_array().unwrap();
    assert!(operations.len() > 30);
    for operation in operations {
        let method = operation["method"].as_str().unwrap().to_lowercase();
        let path = operation["path"].as_str().unwrap();
        assert!(document["paths"][path][&method]["operationId"].is_string(), "{method} {path}");
    }
}

#[test]
fn marks_are_in_the_log() {
    let run = Running::start("mark");
    let operator = run.client("operator");
    operator.send("POST", "/log", Some(&json!({ "text": "it slips" }))).json();
    let marked = || {
        let lines = run.get("/log").json();
        lines.as_array().unwrap().iter().any(|line| {
            let text = line["text"].as_str().unwrap();
            text.starts_with("operator") && text.ends_with(": it slips")
        })
    };
    run.wait_for("the line", marked);
    for text in ["", " ", "two\nlines", &"long".repeat(100)] {
        operator.send("POST", "/log", Some(&json!({ "text": text }))).problem(422);
    }
}

#[test]
fn processor_time_of_threads_is_reported() {
    let run = Running::start("threads");
    let busy = || {
        let threads = run.get("/threads").json();
        let threads = threads.as_array().unwrap().clone();
        let console = threads.into_iter().find(|thread| thread["name"] == "console").unwrap();
        assert!(console["turns"].as_u64().unwrap() > 0 && console["waited"].is_u64(), "{console}");
        console["busy"].as_u64().unwrap()
    };
    let before = busy();
    // Where the processor has much to do, the times of a thread come late.
    run.wait_for("more time of the console", || {
        run.get("/properties?values").json();
        busy() > before
    });
}

//! Changes: the required role and conditions.

use serde_json::{Value as Json, json};

use crate::agent::Running;
use crate::client::Client;
use crate::modules::CONFIGURATION;

#[test]
fn a_parameter_is_set_checked_and_taken_back() {
    let run = Running::start("parameter");
    let developer = run.client("developer");
    let at = run.at("sensor/params/step");
    let changed = developer.send("PUT", &at, Some(&json!(2.5))).json();
    assert_eq!((&changed[0]["before"], &changed[0]["after"]), (&json!(null), &json!("2.5")));
    assert_eq!(run.get(&format!("{at}?bare")).json(), json!(2.5));
    // It is a change of the configuration, that can be saved or taken back.
    assert_eq!(run.get("/settings/differences").json()[0]["present"], "2.5");
    for (body, words) in [(json!(7.0), "5"), (json!("fast"), "step"), (json!(null), "step")] {
        let text = developer.send("PUT", &at, Some(&body)).problem(422);
        assert!(text.contains(words), "{body}: {text}");
    }
    assert_eq!(developer.send("DELETE", "/settings?path=modules.sensor", None).json()[0]["before"], "2.5");
    assert_eq!(run.get(&format!("{at}?bare")).json(), json!(1.0));
    let text = developer.send("PUT", &run.at("sensor/params"), Some(&json!({ "step": 1.0 }))).problem(422);
    assert!(text.contains("label"), "{text}");
    developer
        .send("PATCH", &run.at("sensor/params"), Some(&json!({ "step": 2.0, "label": "a \"b\"\n" })))
        .json();
    assert_eq!(run.get(&run.at("sensor/params?bare")).json(), json!({ "step": 2.0, "label": "a \"b\"\n" }));
}

#[test]
fn an_operator_sets_only_the_parameters_given_to_operators() {
    let table = "[console]\nport = 0\noperable = [\"/sensor/params/step\"]";
    let run = Running::start_with("operable", &format!("{CONFIGURATION}\n{table}"));
    let operator = run.client("operator");
    let (step, params) = (run.at("sensor/params/step"), run.at("sensor/params"));
    operator.send("PUT", &step, Some(&json!(2.0))).json();
    operator.send("PATCH", &params, Some(&json!({ "step": 3.0 }))).json();
    assert_eq!(run.get(&format!("{step}?bare")).json(), json!(3.0));
    // As a developer's it is checked.
    assert!(operator.send("PUT", &step, Some(&json!(7.0))).problem(422).contains("5"));
    for (method, path, body) in [
        ("PUT", run.at("sensor/params/label"), json!("mine")),
        ("PATCH", params.clone(), json!({ "step": 1.0, "label": "mine" })),
        ("PUT", params.clone(), json!({ "step": 1.0, "label": "mine" })),
        ("PUT", run.at("sensor/enabled"), json!(false)),
    ] {
        let problem = operator.send(method, &path, Some(&body)).problem(403);
        assert!(problem.contains("an operator") && problem.contains("console.operable"), "{problem}");
    }
    let empty = operator.send("PATCH", &params, Some(&json!({})));
    assert!(empty.problem(422).contains("at least one field"));
    run.client("viewer").send("PUT", &step, Some(&json!(1.0))).problem(403);
    assert_eq!(run.get(&format!("{step}?bare")).json(), json!(3.0));
    let told = run.get("/parameters").json();
    let operable = told.as_array().unwrap().iter().filter(|own| own["operable"] == true);
    assert_eq!(operable.map(|own| own["name"].clone()).collect::<Vec<_>>(), [json!("step")]);
}

#[test]
fn a_body_that_is_no_object_or_is_compressed_is_refused() {
    let run = Running::start("bodies");
    let developer = run.client("developer");
    let at = run.at("sensor/params");
    for body in [json!([1, 2]), json!("step"), json!(null), json!(3)] {
        let text = developer.send("PUT", &at, Some(&body)).problem(422);
        assert!(text.contains("sensor/params is an object of fields"), "{body}: {text}");
    }
    let packed = developer.with("Content-Encoding", "gzip");
    let text = packed.send("PATCH", &at, Some(&json!({ "step": 2.0 }))).problem(415);
    assert!(text.contains("gzip"), "{text}");
    assert_eq!(run.get(&run.at("sensor/params/step?bare")).json(), json!(1.0));
    assert!(
        run.client("viewer")
            .send("PATCH", &at, Some(&json!({ "step": 2.0 })))
            .problem(403)
            .contains("an operator")
    );
}

#[test]
fn a_dry_run_changes_nothing_and_says_whether_it_could() {
    let run = Running::start("dry");
    let developer = run.client("developer");
    let at = run.at("sensor/params/step?dry_run");
    assert_eq!(developer.send("PUT", &at, Some(&json!(2.5))).json()[0]["after"], "2.5");
    developer.send("PUT", &at, Some(&json!(7.0))).problem(422);
    assert_eq!(run.get(&run.at("sensor/params/step?bare")).json(), json!(1.0));
    let linked =
        developer.send("PUT", "/links/driver/goal?dry_run", Some(&json!({ "from": "sensor/place" })));
    assert_eq!(linked.json().as_array().map(Vec::len), Some(1));
    let text = developer
        .send("PUT", "/links/driver/goal?dry_run", Some(&json!({ "from": "sensor/image" })))
        .problem(409);
    assert!(text.contains("Image"), "{text}");
    assert_eq!(run.get("/links").json().as_array().map(Vec::len), Some(1));
}

#[test]
fn of_two_clients_with_one_version_one_changes_it() {
    let run = Running::start("version");
    let developer = run.client("developer");
    let at = run.at("sensor/params/step");
    let version = run.get(&at).header("etag").to_owned();
    let seen = developer.with("If-Match", &version);
    seen.send("PUT", &at, Some(&json!(2.0))).json();
    let late = seen.send("PUT", &at, Some(&json!(3.0)));
    assert!(late.problem(412).contains("version"));
    assert_ne!(late.header("etag"), version);
    assert_eq!(run.get(&format!("{at}?bare")).json(), json!(2.0));
    developer.with("If-Match", "*").send("PUT", &at, Some(&json!(3.0))).json();
}

#[test]
fn an_input_without_a_link_takes_a_goal_of_an_operator() {
    let run = Running::start("goal");
    let operator = run.client("operator");
    operator.send("PUT", &run.at("driver/goal"), Some(&json!({ "x": 2.0, "y": 1.0 }))).json();
    run.wait_for("the command", || run.number("wheel/command/value") == 2.0);
    operator.send("PUT", &run.at("driver/goal/x"), Some(&json!(3.0))).json();
    run.wait_for("the command", || run.number("wheel/command/value") == 3.0);
    assert_eq!(run.get(&run.at("driver/goal?bare")).json(), json!({ "x": 3.0, "y": 1.0 }));
    let text = operator.send("PUT", &run.at("driver/goal"), Some(&json!({ "x": 2.0 }))).problem(422);
    assert!(text.contains('y'), "{text}");
    assert!(
        operator
            .send("PUT", &run.at("sensor/params/step"), Some(&json!(2.0)))
            .problem(403)
            .contains("developer")
    );
}

#[test]
fn written_property_is_set_by_no_client() {
    let run = Running::start("outputs");
    let developer = run.client("developer");
    let refused = developer.send("PUT", &run.at("sensor/count/value"), Some(&json!(0.0)));
    assert!(refused.problem(405).contains("module"));
    assert_eq!(refused.header("allow"), "GET");
    let refused = developer.send("PUT", &run.at("driver/notes"), Some(&json!({ "value": 1.0 })));
    assert_eq!((refused.status, refused.header("allow")), (405, "POST"));
    developer.send("PUT", &run.at("driver/history"), Some(&json!({ "value": 1.0 }))).problem(405);
}

#[test]
fn a_message_is_sent_and_answered() {
    let run = Running::start("message");
    let operator = run.client("operator");
    let at = run.at("driver/notes");
    assert_eq!(
        operator.send("POST", &format!("{at}?dry_run"), Some(&json!({ "value": 2.0 }))).json()["status"],
        "fits"
    );
    let sent = operator.send("POST", &at, Some(&json!({ "value": 4.0 }))).json();
    assert_eq!(sent["status"], "done");
    run.wait_for("the message", || run.number("driver/heard/value") == 4.0);
    assert!(operator.send("POST", &at, Some(&json!({ "speed": 4.0 }))).problem(422).contains("value"));
    assert!(operator.send("POST", &at, Some(&json!({}))).problem(422).contains("lacks value"));
    operator.send("POST", &run.at("sensor/count"), Some(&json!({ "value": 4.0 }))).problem(405);
}

#[test]
fn a_message_that_is_refused_is_so_in_the_words_of_the_module() {
    let run = Running::start("refusal");
    let operator = run.client("operator");
    let send = |value: f64| operator.send("POST", &run.at("driver/notes"), Some(&json!({ "value": value })));
    // One that it refuses without a word between those of which it says why.
    for _ in 0..2 {
        let said = send(-3.0).problem(409);
        assert!(
            said.contains("/driver/notes refuses the message: -3 is less than nothing; send 0 or more"),
            "{said}"
        );
        let said = send(-300.0).problem(409);
        assert!(said.contains("code 2") && said.contains("the interface Speed"), "{said}");
    }
    assert_eq!(send(4.0).json()["status"], "done");
}

#[test]
fn refusal_has_status_200_on_request() {
    let run = Running::start("verdict");
    let (viewer, operator) = (run.client("viewer"), run.client("operator"));
    let asks = |client: &Client, value: Json| {
        client.with("Prefer", "refusal=200").send("POST", &run.at("driver/notes"), Some(&value))
    };
    for (value, status) in [(json!({ "value": -3.0 }), 409), (json!({ "speed": 4.0 }), 422)] {
        let answer = asks(&operator, value.clone());
        assert_eq!((answer.status, answer.header("preference-applied")), (200, "refusal=200"));
        assert_eq!(answer.header("content-type"), "application/problem+json");
        assert_eq!(answer.json()["status"], status);
        // A program without preference gets the status code.
        operator.send("POST", &run.at("driver/notes"), Some(&value)).problem(status);
    }
    assert_eq!(asks(&operator, json!({ "value": 4.0 })).json()["status"], "done");
    // A missing right does not judge the request.
    asks(&viewer, json!({ "value": 4.0 })).problem(403);
}

#[test]
fn anybody_stops_and_an_operator_lets_it_go_on() {
    let run = Running::start("stop");
    let (viewer, operator) = (run.client("viewer"), run.client("operator"));
    operator.send("PUT", &run.at("driver/goal"), Some(&json!({ "x": 2.0, "y": 1.0 }))).json();
    run.wait_for("the command", || run.number("wheel/command/value") == 2.0);
    assert_eq!(viewer.send("POST", "/stop", None).json(), json!({ "stopped": ["wheel"] }));
    assert_eq!(run.number("wheel/command/value"), 0.0);
    assert!(run.get("/agent").json()["stopped"].as_str().unwrap().contains("viewer"));
    // Nothing that comes with it is a reason not to stop.
    for (kind, path, body) in [
        ("application/x-www-form-urlencoded", "/stop", "now"),
        ("application/json", "/stop", "{bad"),
        ("application/json", "/stop?why=1", "[null]"),
        ("application/json", "/stop?reason=50%", ""),
        ("application/json", "/stop?reason=a&reason=b", "{}"),
        ("application/json", "/stop?%ff=%ff", ""),
        ("image/png", "/stop", "\u{fffd}"),
    ] {
        operator.send("POST", "/reset", None).json();
        let head = viewer.head("POST", &format!("/api/v1{path}"));
        let length = body.len();
        let asked = format!("{head}content-type: {kind}\r\ncontent-length: {length}\r\n\r\n{body}");
        assert_eq!(viewer.raw(asked.as_bytes()).json(), json!({ "stopped": ["wheel"] }), "{kind} {body}");
        assert!(run.get("/agent").json()["stopped"].is_string(), "{kind} {body}");
    }
    viewer.send("POST", "/reset", None).problem(403);
    viewer.send("POST", "/arm", None).problem(403);
    assert!(operator.send("POST", "/arm", None).problem(409).contains("still stopped"));
    assert_eq!(operator.send("POST", "/reset", None).json(), json!({ "was_stopped": true }));
    assert!(operator.send("POST", "/arm", Some(&json!({ "actuator": "arm" }))).problem(422).contains("arm"));
    operator.send("POST", "/arm", Some(&json!({ "actuator": "wheel" }))).json();
    run.wait_for("the command", || run.number("wheel/command/value") == 2.0);
}

#[test]
fn a_snapshot_is_taken_and_gone_on_from() {
    let run = Running::start("snapshot");
    let developer = run.client("developer");
    let name = format!("console-{}", std::process::id());
    let taken = developer.send("POST", &format!("/snapshots/{name}"), None).json();
    let file = std::path::PathBuf::from(taken["file"].as_str().unwrap());
    assert!(file.is_file() && file.ends_with(format!("snapshots/{name}.snapshot")), "{taken}");
    let then = run.number("sensor/count/value");
    run.wait_for("later", || run.number("sensor/count/value") > then + 100.0);
    let loaded = developer.send("POST", &format!("/snapshots/{name}/load"), None).json();
    assert_eq!(loaded["cycle"], taken["cycle"]);
    assert!(run.number("sensor/count/value") < then + 100.0);
    std::fs::remove_file(&file).unwrap();
    let _ = std::fs::remove_dir(file.parent().unwrap());
    developer.send("POST", &format!("/snapshots/{name}/load"), None).problem(404);
    developer.send("POST", "/snapshots/..%2fx", None).problem(400);
}

#[test]
fn modules_links_and_levels_change_while_it_runs() {
    let run = Running::start("parts");
    let developer = run.client("developer");
    assert_eq!(
        developer.send("PUT", "/modules/sensor", Some(&json!({ "enabled": false }))).json()["changed"],
        true
    );
    assert_eq!(
        developer.send("PUT", &run.at("sensor/enabled"), Some(&json!(true))).json()[0]["after"],
        "true"
    );
    assert!(
        developer
            .send("PUT", "/modules/senser", Some(&json!({ "enabled": false })))
            .problem(404)
            .contains("senser")
    );
    developer.send("PUT", "/links/driver/goal", Some(&json!({ "from": "sensor/place" }))).json();
    run.wait_for("the command", || run.number("wheel/command/value") == 1.5);
    let links = run.get("/links").json();
    assert!(links.as_array().unwrap().iter().any(|link| link["to"] == "driver/goal"), "{links}");
    developer.send("DELETE", "/links/driver/goal", None).json();
    assert!(developer.send("DELETE", "/links/driver/goal", None).problem(409).contains("no link"));
    developer.send("PATCH", "/settings", Some(&json!({ "log.level": "debug" }))).json();
    assert!(
        developer
            .send("PATCH", "/settings", Some(&json!({ "loop.period": "1s" })))
            .problem(422)
            .contains("loop")
    );
    assert!(developer.send("DELETE", "/plugins/nothing", None).problem(404).contains("nothing"));
    // The log names the caller.
    let lines = run.get("/log").text();
    assert!(
        lines.contains("developer at 127.0.0.1") && lines.contains("PUT /api/v1/links/driver/goal is done"),
        "{lines}"
    );
}

#[test]
fn repeated_request_is_in_the_log_once() {
    let run = Running::start("repeated");
    let developer = run.client("developer");
    for step in 1..=5 {
        let body = json!({ "step": f64::from(step) });
        developer.send("PATCH", &run.at("sensor/params"), Some(&body)).json();
    }
    developer.send("PUT", "/modules/sensor", Some(&json!({ "enabled": false }))).json();
    // The log has a thread of its own.
    run.wait_for("the last request", || {
        run.get("/log").text().contains("PUT /api/v1/modules/sensor is done")
    });
    let lines = run.get("/log").text();
    assert_eq!(lines.matches("/sensor/params is done").count(), 1, "{lines}");
}

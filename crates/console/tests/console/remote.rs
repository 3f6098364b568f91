//! Operations by callers of each role, what files they may name, and what belongs to their connections.

use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use slate_console::Role;
use slate_control::Client;
use slate_control::client::Access;
use slate_control::operations::OPERATIONS;

use crate::agent::Running;

/// A path of an operation, for things that do not exist.
fn path(template: &str) -> String {
    let part = |part: &str| match part.strip_prefix('{') {
        Some(_) => "none".to_owned(),
        None => part.to_owned(),
    };
    template.split('/').map(part).collect::<Vec<_>>().join("/")
}

#[test]
fn each_operation_is_refused_to_roles_below_its_own() {
    for role in Role::ALL {
        let run = Running::start(&format!("remote-{role}"));
        let client = run.client(role.name());
        for operation in OPERATIONS {
            let allowed = role >= operation.role;
            // A stream has no end, and what is allowed is tried elsewhere.
            if allowed && operation.method != "GET" || operation.name == "read" {
                continue;
            }
            let reply = client.send(operation.method, &path(operation.path), None);
            let text = reply.text();
            let name = operation.name;
            assert_eq!(reply.status == 403, !allowed, "{role}: {name}: {} {text}", reply.status);
            if !allowed {
                assert!(
                    text.contains("may not do this") && text.contains(operation.role.with_article()),
                    "{text}"
                );
            }
        }
        assert_eq!(run.get("/agent").json()["stopped"], Json::Null);
    }
}

#[test]
fn values_are_set_by_url_by_operators_or_developers() {
    let run = Running::start("remote-values");
    for (url, value, least) in [
        ("/driver/goal", json!({ "x": 0.0, "y": 0.0 }), Role::Operator),
        ("/sensor/params/step", json!(2.0), Role::Developer),
        ("/sensor/enabled", json!(true), Role::Developer),
        ("/nothing", json!(1), Role::Operator),
    ] {
        for role in Role::ALL {
            let path = run.at(url.trim_start_matches('/'));
            let reply = run.client(role.name()).send("PUT", &path, Some(&value));
            assert_eq!(reply.status == 403, role < least, "{role}: {url}: {}", reply.text());
        }
    }
}

#[test]
fn a_named_caller_is_in_the_log_beside_its_role() {
    let run = Running::start("remote-caller");
    let access = Access {
        address: format!("http://{}", run.address()).parse().unwrap(),
        browser: String::new(),
        token: run.token("viewer"),
        certificate: None,
    };
    let mut client = Client::at(&access).unwrap();
    client.modules().unwrap();
    client.on_behalf_of("model\" developer at 10.0.0.1: PUT /api/v1/value is done");
    client.links().unwrap();
    assert!(client.arm(None).is_err());
    let log = || run.get("/log").text();
    run.wait_for("the calls in the log", || log().contains("POST /api/v1/arm is refused with 403"));
    let log = run.get("/log").json().to_string();
    let line = r#"named \\\"model\\\\\\\" developer at 10.0.0.1: PUT /api/v1/value is done\\\": GET /api/v1/links is done"#;
    assert!(log.replace('\\', "").contains(&line.replace('\\', "")), "{log}");
    assert!(log.contains("viewer at 127.0.0.1:") && !log.contains("/modules"), "{log}");
}

#[test]
fn a_file_has_a_name_and_no_folder() {
    let run = Running::start("remote-files");
    let client = run.client("developer");
    for file in
        ["%2Ftmp%2Fstolen.mcap", "..%2Fup.mcap", "a%2Fb.mcap", ".mcap", "a.mcap.mcap", "a%00b", "a.sh"]
    {
        for path in [
            format!("/recordings/{file}"),
            format!("/recordings/{file}/snapshot"),
            format!("/snapshots/{file}"),
            format!("/snapshots/{file}/load"),
        ] {
            let reply = client.send("POST", &path, None);
            assert!(reply.problem(400).contains("can't be the name of"), "{path}: {}", reply.text());
        }
    }
    let trace = |file: &str| client.send("POST", "/trace", Some(&json!({ "file": file })));
    assert!(trace("/tmp/stolen.json").problem(400).contains("can't be the name of"));
    for (method, path) in
        [("POST", "/plugins"), ("POST", "/plugins/sensor/reload"), ("PUT", "/plugins/sensor/shadow")]
    {
        let reply = client.send(method, path, Some(&json!({ "file": "/tmp/lib.so" })));
        assert!(reply.problem(400).contains("over the network"), "{}", reply.text());
    }
    assert_eq!(client.send("POST", "/recordings/mine.mcap", None).status, 200);
    let again = client.send("POST", "/recordings/mine", None);
    assert!(again.problem(409).contains("mine.mcap already"), "{}", again.text());
    let ended = client.send("POST", "/recordings/mine.mcap/stop", None).json();
    assert_eq!(ended["file"], json!(run.folder.join("mine.mcap")), "{ended}");
}

/// The client that the `slate` command uses.
fn connect(run: &Running, role: &str) -> Client {
    let address = format!("http://{}", run.address());
    let access = Access {
        address: address.parse().unwrap(),
        browser: address,
        token: run.token(role),
        certificate: None,
    };
    Client::at(&access).unwrap()
}

#[test]
fn a_trace_belongs_to_the_connection_that_records_it() {
    let run = Running::start("remote-trace");
    let mut client = connect(&run, "developer");
    client.record_trace("what.json".as_ref()).unwrap();
    assert!(connect(&run, "developer").trace_progress().is_err());
    assert_eq!(client.end_trace().unwrap().file, run.folder.join("what.json"));
    assert!(run.folder.join("what.json").is_file());
    client.record_trace("gone.json".as_ref()).unwrap();
    drop(client);
    run.wait_for("the end", || !run.folder.join("gone.json.part").exists());
    assert!(!run.folder.join("gone.json").exists());
}

#[test]
fn controls_end_with_the_connection_that_took_them() {
    let run = Running::start("remote-drive");
    let mut client = connect(&run, "operator");
    assert_eq!(client.take_controls("wheel", "keys").unwrap().hold, 150);
    let holder = run.get("/leases").json()[0]["holder"].clone();
    assert!(holder.as_str().unwrap().starts_with("keys (operator at 127.0.0.1"), "{holder}");
    let drive = |client: &mut Client| {
        client.command(json!({ "value": -3.0 })).unwrap();
        run.wait_for("the command", || run.number("wheel/command/value") == -3.0);
        Instant::now()
    };
    // The last command, and nothing more is heard of it.
    let last = drive(&mut client);
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    // The connection goes.
    drive(&mut client);
    let gone = Instant::now();
    drop(client);
    run.wait_for("the end", || run.number("wheel/command/value") != -3.0);
    assert!(gone.elapsed() < Duration::from_millis(250), "{:?}", gone.elapsed());
    run.wait_for("the controls", || run.get("/leases").json()[0]["holder"].is_null());
    assert!(gone.elapsed() < Duration::from_secs(4), "{:?}", gone.elapsed());
    // One that is there and says nothing has them no longer than a lease holds.
    let mut silent = connect(&run, "operator");
    silent.take_controls("wheel", "").unwrap();
    let taken = Instant::now();
    run.wait_for("the controls", || run.get("/leases").json()[0]["holder"].is_null());
    assert!(taken.elapsed() > Duration::from_secs(4), "{:?}", taken.elapsed());
}

#[test]
fn waiting_callers_prevent_no_stop_and_no_query() {
    let run = Running::start("remote-crowd");
    let crowd: Vec<_> = (0..20)
        .map(|_| {
            let mut client = connect(&run, "viewer");
            std::thread::spawn(move || {
                let watched = slate_control::Watched { url: "/driver/goal".into(), after: Some(9) };
                client.watch(&[watched], Duration::from_secs(4))
            })
        })
        .collect();
    std::thread::sleep(Duration::from_millis(200));
    let asked = Instant::now();
    connect(&run, "viewer").read("/sensor/count").unwrap();
    run.client("viewer").send("POST", "/stop", None).json();
    assert!(asked.elapsed() < Duration::from_secs(1), "{:?}", asked.elapsed());
    crowd.into_iter().for_each(|waits| drop(waits.join().unwrap().unwrap()));
}

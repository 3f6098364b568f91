//! An agent that follows its configuration database, and is reached by tools at its socket.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and waits for other threads on the wall clock"
)]

#[path = "../../../runtime/tests/common/mod.rs"]
mod common;
#[path = "../../../runtime/tests/common/trace.rs"]
mod file;
mod files;
mod modules;
mod names;
mod openapi;
mod routes;
mod settings;
mod tracing;
mod wire;

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use common::{Number, Pair, number, plugins};
use proptest::prelude::*;
use serde_json::{Value, json};
use slate_control::operations::{by_name, carry_out};
use slate_control::{
    Caller, Client, ClientError, ConnectionEnd, Connections, ControlSurface, EnableResult, Pace, Refusal,
    Role, Server,
};
use slate_module::prelude::*;
use slate_module::{Level, Plugin};
use slate_runtime::configuration::{self, Database, SaveTo};
use slate_runtime::directory::agents;
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Control, Options, Rate};

use wire::Raw;

#[ports]
struct TellerIo {
    told: Output<Pair>,
    apart: Output<Number>,
    input: Input<Number>,
}

#[params]
struct TellerParams {
    #[param(default = 1.0, range = 0.0..=1e6, unit = "m", doc = "told first")]
    first: f64,
    #[param(default = 1.0, range = 0.0..=1e6, doc = "told second")]
    second: f64,
    #[param(default = 7, doc = "not told; 13 panics")]
    third: u64,
}

struct Teller;

/// Tells its parameters, and counts the ticks that saw two different ones.
#[module(stage = Think)]
impl Module for Teller {
    type Io = TellerIo;
    type Params = TellerParams;
    type State = f64;

    fn tick(apart: &mut f64, io: &TellerIo, params: &TellerParams, now: &Tick) -> Outcome {
        if params.first != params.second {
            *apart += 1.0;
        }
        assert_ne!(params.third, 13, "an unlucky number");
        now.log(Level::Debug, format_args!("told"));
        io.told.set(Pair { first: params.first, second: params.second });
        io.apart.set(Number { value: *apart + io.input.get().copied().unwrap_or_default().value });
        Outcome::Ok
    }
}

/// Held while no door may be created.
static DOOR: Mutex<()> = Mutex::new(());

/// Is made as soon as it may.
struct Door;

#[module(stage = Think)]
impl Module for Door {
    type Io = ();
    type Params = ();
    type State = ();

    fn create(_: &Setup<'_>, (): &()) -> Result<(), slate_module::Refusal> {
        drop(DOOR.lock());
        Ok(())
    }

    fn tick((): &mut (), (): &(), (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[test]
fn waiting_changes_delay_no_read_and_no_stop() {
    let text = format!("{TEXT}\n[modules.door]\n").replace("time.source", "loop.hang = \"60s\"\ntime.source");
    let file = format!("{}.toml", name("places"));
    let database = Database::from_text(&file, &text, configuration::Options::default()).unwrap();
    let mut all = plugins();
    all.extend([Plugin::linked::<Teller>(), Plugin::linked::<Door>()]);
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    let agent = Agent::load_with(&database, &all, options).unwrap();
    let server = Server::open(&agent).unwrap();
    agent.composer().unload("door").unwrap();
    let shut = DOOR.lock().unwrap();
    let ask = || {
        let mut stream = UnixStream::connect(server.socket()).unwrap();
        stream.write_all(b"PUT /api/v1/plugins/door HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        stream
    };
    let waiting: Vec<_> = (0..40).map(|_| ask()).collect();
    let mut client = Client::connect(server.name()).unwrap();
    // Time for the agent to receive all of them.
    std::thread::sleep(Duration::from_millis(200));
    let began = Instant::now();
    for path in ["/log", "/interfaces"] {
        assert_eq!(Raw::connect(&server).ask("GET", path, "").0, 200, "{path}");
    }
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    client.stop("by hand").unwrap();
    assert!(client.reset().unwrap());
    assert!(!client.modules().unwrap().iter().any(|module| module.name == "door"));
    assert!(client.plugins().unwrap().iter().any(|plugin| plugin.name == "teller"));
    drop(waiting);
    drop(shut);
    eventually(|| client.modules().unwrap().iter().any(|module| module.name == "door"));
}

const TEXT: &str = r#"
time.source = "counter"
[modules.counter]
[modules.teller]
params = { first = 2.0 }
[modules.relay]
[modules.driver]
[links]
"relay/input" = "counter/number"
"driver/input" = "relay/output"
[actuators.wheel]
command = "driver/wheel"
"#;

fn name(of: &str) -> String {
    format!("test-{}-{of}", std::process::id())
}

fn database(of: &str) -> Database {
    Database::from_text(&format!("{}.toml", name(of)), TEXT, configuration::Options::default()).unwrap()
}

fn load(database: &Database, log: MemoryTarget) -> Agent {
    let mut all = plugins();
    all.push(Plugin::linked::<Teller>());
    let options = Options { rate: Rate::Max, armed: true, log: vec![Box::new(log)], ..Options::default() };
    Agent::load_with(database, &all, options).unwrap()
}

/// An agent with its socket.
fn open(of: &str) -> (Agent, Server, Client) {
    let agent = load(&database(of), MemoryTarget::default());
    let server = Server::open(&agent).unwrap();
    let client = Client::connect(server.name()).unwrap();
    (agent, server, client)
}

fn change(path: &str, value: &str) -> (String, String) {
    (path.into(), value.into())
}

fn refused<T: std::fmt::Debug>(result: Result<T, ClientError>) -> Refusal {
    match result {
        Err(ClientError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    }
}

fn sequence(agent: &Agent, path: &str) -> u64 {
    agent.board().read(path).unwrap().map_or(0, |(_, stamp)| stamp.sequence)
}

/// Waits until it is so.
fn eventually(mut so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !so() {
        assert!(start.elapsed() < Duration::from_secs(20), "it never was");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_missing_library_is_shown_at_its_line_of_the_configuration() {
    let text = "[plugins.arm]\nfile = \"/nowhere/libarm.so\"\n";
    let database = Database::from_text("robot.toml", text, configuration::Options::default()).unwrap();
    let refusal = Agent::load_with(&database, &[], Options::default()).unwrap_err().to_string();
    assert!(refusal.contains("robot.toml:2:") && refusal.contains("libarm.so"), "{refusal}");
}

#[test]
fn a_panic_is_in_the_log_with_its_message_and_place() {
    let log = MemoryTarget::default();
    let mut agent = load(&database("panic"), log.clone());
    let database = agent.database().unwrap().clone();
    database.set(&[("modules.teller.params.third", "13")]).unwrap();
    agent.step();
    let has = |line: &str| {
        ["teller", "an unlucky number", "socket/main.rs:"].iter().all(|part| line.contains(part))
    };
    eventually(|| log.lines().iter().any(|line| has(&line.to_string())));
}

#[test]
fn actions_of_tools_are_logged() {
    let log = MemoryTarget::default();
    let agent = load(&database("logged"), log.clone());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.set(&[change("modules.teller.params.first", "3")]).unwrap();
    client.enable("teller", false).unwrap();
    client.reset().unwrap();
    client.arm(None).unwrap();
    for line in [
        "a tool has changed modules.teller.params.first: 2.0 -> 3",
        "a tool has switched teller off",
        "the stop of the actuators is ended",
        "the actuators are armed",
    ] {
        eventually(|| log.lines().iter().any(|logged| logged.to_string().contains(line)));
    }
}

#[test]
fn plugins_are_listed_and_refused_in_words() {
    let (_agent, _server, mut client) = open("plugins");
    let plugins = client.plugins().unwrap();
    let teller = plugins.iter().find(|plugin| plugin.modules == ["teller"]).unwrap();
    assert!(teller.loaded && teller.file.is_none());
    let message = refused(client.load("nothing")).message;
    assert!(message.contains("no plugin `nothing`"), "{message}");
    let relative = refused(client.load_library("x.so".as_ref()));
    assert!(relative.message.contains("relative"), "{relative:?}");
    let missing = refused(client.load_library("/nowhere/x.so".as_ref()));
    assert!(missing.message.contains("/nowhere/x.so"), "{missing:?}");
    assert!(refused(client.reload(&teller.name, None)).message.contains("linked in"));
    client.unload(&teller.name).unwrap();
    let plugins = client.plugins().unwrap();
    let known = plugins.iter().find(|plugin| plugin.name == teller.name).unwrap();
    assert!(!known.loaded && known.file.is_none());
    assert!(client.modules().unwrap().iter().all(|module| module.name != "teller"));
    let loaded = client.load(&teller.name).unwrap();
    assert_eq!((loaded.plugins.len(), &loaded.modules[..]), (1, &["teller".to_owned()][..]));
    assert_eq!((&loaded.plugins[0].name, &loaded.plugins[0].file), (&teller.name, &None), "linked in");
}

#[test]
fn an_agent_without_a_database_says_so() {
    let text = format!("agent.name = \"{}\"\n[modules.counter]", name("plain"));
    let agent = common::load(&text, &[], Options::default()).unwrap();
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    assert!(refused(client.settings("")).message.contains("can't change"));
    client.enable("counter", false).unwrap();
    assert_eq!(client.modules().unwrap().len(), 1);
}

#[test]
fn every_change_of_the_settings_takes_its_turn() {
    for name in ["set", "revert", "save", "write", "link", "load", "unload", "switch"] {
        assert_eq!(by_name(name).unwrap().pace, Pace::Change, "{name}");
    }
}

#[test]
fn stop_is_carried_out_whatever_its_query_is() {
    let (_agent, server, _client) = open("stop-query");
    let mut stream = Raw::connect(&server);
    for (query, reason) in [
        ("reason=50%", "50%"),
        ("reason=a%20b&reason=c", "a b"),
        ("reason=%ff", "%ff"),
        ("why=1&why=2", "by the "),
        ("%&%", "by the "),
    ] {
        let stopped = stream.ask("POST", &format!("/stop?{query}"), "");
        assert_eq!(stopped, (200, json!({ "stopped": ["wheel"] })), "{query}");
        let said = stream.ask("GET", "/actuators", "").1[0]["stopped"].clone();
        assert_eq!(said.as_str(), Some(reason), "{query}");
        assert_eq!(stream.ask("POST", "/reset", ""), (200, json!({ "was_stopped": true })), "{query}");
    }
}

#[test]
fn lease_of_a_closed_connection_is_refused() {
    let (agent, _server, _client) = open("closed");
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let connection = Arc::new(Arc::new(Connections::default()).admit());
    let end = ConnectionEnd::new(&surface, &connection);
    let caller =
        Caller { role: Role::Operator, who: "a test".into(), local: None, is_told: false, connection };
    let take = || carry_out(&surface, &caller, "take", &[], json!({ "actuator": "wheel", "bound": true }));
    assert!(take().is_ok());
    drop(end);
    let Err(refusal) = take() else { panic!("a lease of a closed connection") };
    assert!(refusal.detail().contains("closed"), "{refusal}");
    assert!(agent.composer().controls()[0].holder.is_none());
}

#[test]
fn actuators_are_stopped_and_armed() {
    let (_agent, server, _client) = open("stop");
    let mut stream = Raw::connect(&server);
    assert_eq!(stream.ask("POST", "/stop", r#"{"reason":"a test"}"#), (200, json!({ "stopped": ["wheel"] })));
    let refusal = stream.ask("POST", "/arm", "");
    assert_eq!((refusal.0, &refusal.1["detail"]), (409, &"still stopped: `wheel` (a test)".into()));
    assert!(refusal.1["help"].as_str().unwrap().contains("reset"), "{refusal:?}");
    let one = stream.ask("POST", "/arm", r#"{"actuator":"wheel"}"#);
    assert_eq!(one, refusal, "the only one");
    assert_eq!(stream.ask("POST", "/reset", ""), (200, json!({ "was_stopped": true })));
    assert_eq!(
        stream.ask("POST", "/reset", ""),
        (200, json!({ "was_stopped": false })),
        "nothing is stopped"
    );
    assert_eq!(stream.ask("POST", "/arm", r#"{"actuator":"wheel"}"#), (200, json!({})));
    assert_eq!(stream.ask("POST", "/arm", ""), (200, json!({})));
    let unknown = stream.ask("POST", "/arm", r#"{"actuator":"whele"}"#).1;
    assert_eq!(unknown["detail"], "no actuator is called `whele`");
    assert_eq!(unknown["help"], "did you mean wheel?");
}

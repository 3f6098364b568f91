//! An agent that follows its configuration database, and is reached by tools at its socket.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and waits for other threads on the wall clock"
)]

mod common;

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use common::{Number, Pair, number, plugins};
use proptest::prelude::*;
use serde_json::{Value, json};
use slate_module::prelude::*;
use slate_module::{Level, Plugin};
use slate_runtime::configuration::{self, Database, SaveTo};
use slate_runtime::log::MemoryTarget;
use slate_runtime::remote::{Client, ClientError, LINE_LIMIT, Refusal, Server, Switched, agents};
use slate_runtime::{Agent, Control, Options, Rate};

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

/// Tells its parameters, and counts the ticks that saw two different ones.
struct Teller;

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
        io.apart.set(Number { value: *apart + io.input.value });
        Outcome::Ok
    }
}

/// Held while a door shall not come to be.
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
fn a_stop_waits_for_no_other_tool_and_who_is_gone_has_no_place() {
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
        stream.write_all(b"{\"call\":\"plugin/load\",\"name\":\"door\"}\n").unwrap();
        let mut reader = BufReader::new(stream);
        reader.read_line(&mut String::new()).unwrap();
        reader
    };
    let waiting: Vec<_> = (0..32).map(|_| ask()).collect();
    let is_full = || {
        let mut client = Client::connect(server.name()).unwrap();
        matches!(client.settings("modules"), Err(ClientError::Refused(refusal)) if refusal.message.contains("too many tools"))
    };
    eventually(is_full);
    let mut client = Client::connect(server.name()).unwrap();
    client.stop("by hand").unwrap();
    assert!(client.reset().unwrap());
    assert!(!client.modules().unwrap().iter().any(|module| module.name == "door"));
    assert!(client.plugins().unwrap().iter().any(|plugin| plugin.name == "teller"));
    drop(waiting);
    eventually(|| !is_full());
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
fn several_parameters_change_in_one_write_and_are_listed_as_different() {
    let (mut agent, _server, mut client) = open("write");
    agent.step();
    assert_eq!(number(&agent, "teller/told/first"), 2.0);
    let before = sequence(&agent, "teller/params");
    let changes = [change("modules.teller.params.first", "3"), change("modules.teller.params.second", "4.5")];
    let changed = client.set(&changes).unwrap();
    assert_eq!(changed.len(), 2);
    assert_eq!((changed[0].before.as_deref(), changed[0].after.as_deref()), (Some("2.0"), Some("3")));
    assert_eq!(sequence(&agent, "teller/params"), before + 1);
    agent.step();
    assert_eq!(number(&agent, "teller/told/first"), 3.0);
    assert_eq!(number(&agent, "teller/told/second"), 4.5);
    assert_eq!(number(&agent, "teller/params/third"), 7.0);

    let reading = client.read(&format!("slate://{}/teller/told", name("write"))).unwrap().unwrap();
    assert_eq!(reading.value, json!({ "first": 3.0, "second": 4.5 }));
    let settings = client.settings("modules.teller").unwrap();
    assert_eq!(settings[0].path, "modules.teller.params.first");
    assert_eq!((&settings[0].value, settings[0].text.as_str()), (&json!(3), "3"));
    let differences = client.differences().unwrap();
    assert_eq!(differences[0].file.as_deref(), Some("2.0"));
    assert_eq!((&differences[1].file, differences[1].default.as_deref()), (&None, Some("1.0")));
    assert_eq!((&changed[1].before, changed[1].default.as_deref()), (&None, Some("1.0")));
    // The text is no file, so it stays as it is.
    assert!(refused(client.save(SaveTo::Origin)).message.contains("built in"));
}

#[test]
fn what_was_set_on_the_blackboard_stays_when_another_parameter_changes() {
    let (agent, _server, mut client) = open("beside");
    let value = slate_module::blackboard::interface::Value::Float(9.0);
    agent.board().write("teller/params/second", &value, 0).unwrap();
    client.set(&[change("modules.teller.params.first", "3")]).unwrap();
    assert_eq!(number(&agent, "teller/params/second"), 9.0);
}

#[test]
fn a_tick_sees_all_of_a_change_or_nothing() {
    let (mut agent, _server, mut client) = open("atomic");
    client.set(&[change("modules.teller.params.first", "1")]).unwrap();
    let stopper = agent.stopper();
    let running = std::thread::spawn(move || {
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        agent
    });
    for value in 2..200 {
        let value = value.to_string();
        let first = change("modules.teller.params.first", &value);
        client.set(&[first, change("modules.teller.params.second", &value)]).unwrap();
    }
    stopper.stop();
    let agent = running.join().unwrap();
    assert_eq!(number(&agent, "teller/apart/value"), 0.0);
    assert_eq!(number(&agent, "teller/params/first"), 199.0);
}

#[test]
fn what_does_not_fit_is_refused_whole_with_its_place() {
    let (agent, _server, mut client) = open("misfit");
    let before = sequence(&agent, "teller/params");
    let mut refuse = |path: &str, value: &str, words: &[&str]| {
        let good = change("modules.teller.params.second", "5");
        let refusal = refused(client.set(&[good, change(path, value)]));
        let report = refusal.report.unwrap_or_default();
        for word in words {
            assert!(report.contains(word), "{word}: {report}");
        }
        assert!(!refusal.help.is_empty() && !refusal.message.is_empty());
        report
    };
    let report = refuse("modules.teller.params.first", "-1", &["outside 0 to 1000000", "params.first=-1"]);
    assert!(report.contains("here"), "{report}");
    refuse("modules.teller.params.frist", "1", &["no parameter `frist`", "did you mean `first`"]);
    refuse("modules.teller.params.first", "fast", &["`first` is f64"]);
    refuse("modules.teler.params.first", "1", &["teler", "did you mean `teller`"]);
    refuse("modules.teller.stage", "Act", &["can't change while the agent runs", "next start"]);
    refuse("loop.period", "10ms", &["`loop.period` can't change"]);
    refuse("agent.seed", "3", &["`agent.seed` can't change"]);
    refuse("modules.teller.inputs.inptu.value", "3", &["no input `inptu`"]);
    refuse("log.level", "loud", &["loud"]);
    assert_eq!(sequence(&agent, "teller/params"), before);
    assert!(client.differences().unwrap().is_empty());
}

#[test]
fn inputs_without_a_link_and_levels_of_the_log_change() {
    let log = MemoryTarget::default();
    let mut agent = load(&database("levels"), log.clone());
    let database = agent.database().unwrap().clone();
    agent.step();
    database.set(&[("modules.teller.inputs.input.value", "6"), ("log.levels.teller", "debug")]).unwrap();
    assert_eq!(number(&agent, "teller/input/value"), 6.0);
    agent.step();
    eventually(|| log.lines().iter().any(|line| line.to_string().contains("told")));
    let taken_back = database.revert("modules.teller.inputs").unwrap_err().to_string();
    assert!(taken_back.contains("can't be taken back"), "{taken_back}");
    // The agent goes, and judges nothing any more.
    drop(agent);
    database.set(&[("loop.period", "10ms")]).unwrap();
}

#[test]
fn modules_are_switched_by_name() {
    let (mut agent, _server, mut client) = open("switch");
    client.enable("teller", false).unwrap();
    agent.step();
    assert_eq!(agent.counts("teller").unwrap().0, 0);
    let teller = client.modules().unwrap().into_iter().find(|module| module.name == "teller").unwrap();
    assert_eq!((teller.kind.as_str(), teller.condition.as_str(), teller.ticks), ("teller", "INACTIVE", 0));
    assert_eq!(client.differences().unwrap()[0].path, "modules.teller.enabled");
    assert!(!client.enable("teller", false).unwrap().changed, "it is off already");
    let on = Switched { changed: true, needs_reload: None };
    assert_eq!(client.enable("teller", true).unwrap(), on);
    assert!(!client.enable("teller", true).unwrap().changed, "it is on already");
    assert!(client.differences().unwrap().is_empty(), "as the file says");
    agent.step();
    assert_eq!(agent.counts("teller").unwrap().0, 1);
}

#[test]
fn switching_what_does_nothing_is_refused() {
    let (mut agent, _server, mut client) = open("useless");
    for on in [true, false] {
        let unknown = refused(client.enable("telle", on));
        assert_eq!(unknown.message, "no module is called `telle`");
        assert_eq!(unknown.help, "did you mean teller?");
    }
    let clock = refused(client.enable("counter", false));
    assert!(clock.message.contains("`counter` is the time source"), "{clock:?}");
    assert!(agent.step());
    let before = agent.now();
    assert!(agent.step() && agent.now() > before, "time goes on");
    // Each panic but the last one is followed by a fresh start.
    client.set(&[change("modules.teller.params.third", "13")]).unwrap();
    (0..20).for_each(|_| assert!(agent.step()));
    let teller = client.modules().unwrap().into_iter().find(|module| module.name == "teller").unwrap();
    assert_eq!(teller.condition, "FAULTED");
    let faulted = refused(client.enable("teller", true));
    assert!(faulted.message.contains("`teller` has failed for good"), "{faulted:?}");
    assert!(faulted.help.contains(&format!("slate plugin reload {}", teller.plugin)), "{faulted:?}");
    assert!(client.enable("teller", false).unwrap().changed, "off it can be");
    assert!(!client.enable("teller", false).unwrap().changed);
    let on = Switched { changed: true, needs_reload: Some(teller.plugin) };
    assert_eq!(client.enable("teller", true).unwrap(), on, "and on again, for when it is reloaded");
    assert_eq!(client.read("/teller/enabled/value").unwrap().unwrap().value, true);
    assert!(client.differences().unwrap().iter().all(|different| !different.path.ends_with("enabled")));
    refused(client.enable("teller", true));
}

#[test]
fn parameters_of_a_module_that_is_away_are_checked_by_what_it_was() {
    let (_agent, _server, mut client) = open("away");
    let plugins = client.plugins().unwrap();
    let teller = plugins.iter().find(|plugin| plugin.modules == ["teller"]).unwrap().name.clone();
    client.unload(&teller).unwrap();
    let unknown = refused(client.set(&[change("modules.teller.params.nope", "1")]));
    assert!(unknown.message.contains("no parameter `nope`"), "{unknown:?}");
    let text = refused(client.set(&[change("modules.teller.params.first", "text")]));
    assert!(text.message.contains("`first` is f64"), "{text:?}");
    client.set(&[change("modules.teller.params.first", "3")]).unwrap();
    client.load(&teller).unwrap();
}

#[test]
fn changes_are_taken_back() {
    let (agent, _server, mut client) = open("back");
    let [first, second] = ["first", "second"].map(|name| format!("modules.teller.params.{name}"));
    client.set(&[change(&first, "3"), change(&second, "4")]).unwrap();
    let back = client.revert(&second).unwrap();
    assert_eq!((back.len(), &back[0].path), (1, &second));
    assert_eq!((number(&agent, "teller/params/first"), number(&agent, "teller/params/second")), (3.0, 1.0));
    client.revert("").unwrap();
    assert_eq!(number(&agent, "teller/params/first"), 2.0);
    assert!(client.differences().unwrap().is_empty() && client.revert("").unwrap().is_empty());
}

#[test]
fn a_library_that_is_not_there_is_shown_at_its_line_of_the_configuration() {
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
    let has =
        |line: &str| ["teller", "an unlucky number", "remote.rs:"].iter().all(|part| line.contains(part));
    eventually(|| log.lines().iter().any(|line| has(&line.to_string())));
}

#[test]
fn what_tools_do_is_in_the_log() {
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
fn actuators_are_stopped_and_armed() {
    let (_agent, server, _client) = open("stop");
    let mut stream = Raw::connect(&server);
    assert_eq!(stream.ask(r#"{"call":"stop","reason":"a test"}"#), json!({ "result": null }));
    let refusal = stream.ask(r#"{"call":"arm"}"#);
    assert!(refusal["error"]["help"].as_str().unwrap().contains("reset"), "{refusal}");
    assert_eq!(refusal["error"]["message"], "still stopped: `wheel` (a test)");
    let one = stream.ask(r#"{"call":"arm","actuator":"wheel"}"#);
    assert_eq!(one, refusal, "the only one");
    assert_eq!(stream.ask(r#"{"call":"reset"}"#), json!({ "result": true }));
    assert_eq!(stream.ask(r#"{"call":"reset"}"#), json!({ "result": false }), "nothing is stopped");
    assert_eq!(stream.ask(r#"{"call":"arm","actuator":"wheel"}"#), json!({ "result": null }));
    assert_eq!(stream.ask(r#"{"call":"arm"}"#), json!({ "result": null }));
    let unknown = stream.ask(r#"{"call":"arm","actuator":"whele"}"#);
    assert_eq!(unknown["error"]["message"], "no actuator is called `whele`");
    assert_eq!(unknown["error"]["help"], "did you mean wheel?");
}

/// A tool that says what it likes.
struct Raw {
    stream: UnixStream,
    reader: BufReader<UnixStream>,
}

impl Raw {
    fn connect(server: &Server) -> Self {
        let stream = UnixStream::connect(server.socket()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let reader = BufReader::new(stream.try_clone().unwrap());
        let mut raw = Self { stream, reader };
        assert_eq!(raw.hear(), json!({ "slate": 1, "agent": server.name() }));
        raw
    }

    fn hear(&mut self) -> Value {
        let mut line = String::new();
        self.reader.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    fn ask(&mut self, line: impl AsRef<[u8]>) -> Value {
        self.stream.write_all(line.as_ref()).unwrap();
        self.stream.write_all(b"\n").unwrap();
        self.hear()
    }
}

#[test]
fn bad_lines_are_answered_with_what_is_wrong() {
    let (_agent, server, _client) = open("lines");
    let mut stream = Raw::connect(&server);
    for (line, word) in [
        ("", "no call"),
        ("hello", "no call"),
        ("{}", "missing field `call`"),
        (r#"{"call":"plugin/lst"}"#, "plugin/list"),
        (r#"{"call":"plugin/list","agent":"x"}"#, "agent"),
        (r#"{"call":"plugin/load"}"#, "a name or a file"),
        (r#"{"call":"module/enable","name":7}"#, "string"),
        (r#"{"call":"config/get","path":"a..b"}"#, "no path"),
        (r#"{"call":"config/set","changes":[["a=b","c"]]}"#, "path"),
        (r#"{"call":"config/save","to":"moon"}"#, "origin"),
        (r#"{"call":"read","url":"http://x/y"}"#, "slate://"),
        (r#"{"call":"read","url":"/teller/tld"}"#, "teller/told"),
        (r#"{"call":"read","url":"slate://other/teller/told"}"#, "another agent"),
    ] {
        let answer = stream.ask(line);
        let message = answer["error"]["message"].as_str().unwrap_or_else(|| panic!("{line}: {answer}"));
        assert!(message.contains(word), "{line}: {message}");
        assert!(!answer["error"]["help"].as_str().unwrap().is_empty(), "{line}: {answer}");
    }
    let deep = format!(r#"{{"call":{}"#, "[".repeat(100_000));
    assert!(stream.ask(&deep)["error"]["message"].is_string());
    let long = stream.ask(vec![b'x'; LINE_LIMIT + 1]);
    assert!(long["error"]["message"].as_str().unwrap().contains("longer than"), "{long}");
    // It goes on after all of that.
    assert!(stream.ask(r#"{"call":"plugin/list"}"#)["result"].is_array());
}

#[test]
fn calls_sent_at_once_are_answered_in_their_order() {
    let (_agent, server, _client) = open("order");
    let mut stream = Raw::connect(&server);
    let calls = [r#"{"call":"read","url":"/teller/params/first"}"#, "wrong", r#"{"call":"plugin/list"}"#];
    stream.stream.write_all(format!("{}\n", calls.join("\n")).as_bytes()).unwrap();
    assert_eq!(stream.hear()["result"]["value"], json!(2.0));
    assert!(stream.hear()["error"].is_object());
    assert!(stream.hear()["result"].is_array());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn any_line_gets_one_answer(lines in proptest::collection::vec(".*", 1..40)) {
        let (_agent, server, _client) = open("any");
        let mut stream = Raw::connect(&server);
        for line in lines.iter().filter(|line| !line.contains('\n')) {
            let answer = stream.ask(line);
            prop_assert!(answer["error"]["message"].is_string(), "{}: {}", line, answer);
        }
    }
}

#[test]
fn tools_that_are_silent_or_hear_nothing_hold_nobody_up() {
    let (_agent, server, mut client) = open("silent");
    let mut silent: Vec<_> = (0..20).map(|_| Raw::connect(&server)).collect();
    // These ask without end and never listen, until nothing more goes into the socket.
    let mut deaf: Vec<_> = (0..10).map(|_| UnixStream::connect(server.socket()).unwrap()).collect();
    for stream in &mut deaf {
        stream.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        while stream.write_all(b"{\"call\":\"config/get\"}\n").is_ok() {}
    }
    for _ in 0..20 {
        silent.push(Raw::connect(&server));
        assert!(!client.plugins().unwrap().is_empty());
    }
    // The first of the silent ones had to go, the client never.
    let mut line = String::new();
    assert_eq!(silent[0].reader.read_line(&mut line).unwrap_or(0), 0);
}

#[test]
fn names_are_taken_once_and_free_again() {
    let agent = load(&database("names"), MemoryTarget::default());
    let (first, second) = (Server::open(&agent).unwrap(), Server::open(&agent).unwrap());
    assert_eq!(first.name(), name("names"));
    assert_eq!(second.name(), format!("{}-2", name("names")));
    assert!(agents().contains(&first.name().to_owned()) && agents().contains(&second.name().to_owned()));
    let (socket, lock) = (first.socket().to_owned(), first.socket().with_extension("lock"));
    assert!(socket.exists() && lock.exists());
    drop(first);
    assert!(!socket.exists() && !lock.exists());
    assert!(matches!(Client::connect(&name("names")), Err(ClientError::NoAgent { .. })));
    // What an agent leaves that is killed: a socket that nobody listens at.
    drop(std::os::unix::net::UnixListener::bind(&socket).unwrap());
    assert!(socket.exists() && !agents().contains(&name("names")));
    assert!(matches!(Client::connect(&name("names")), Err(ClientError::NoAgent { .. })));
    let again = Server::open(&agent).unwrap();
    assert_eq!(again.name(), name("names"));
    Client::connect(again.name()).unwrap().plugins().unwrap();
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

/// A configuration file in a folder of its own.
fn file(of: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(name(of));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("robot.toml");
    std::fs::write(&path, TEXT).unwrap();
    path
}

#[test]
fn an_edited_file_is_taken_over_or_refused_whole() {
    let path = file("edited");
    let log = MemoryTarget::default();
    let database = Database::open(&path, configuration::Options::default()).unwrap();
    let agent = load(&database, log.clone());
    let edit = |text: &str| {
        assert_ne!(text, TEXT);
        std::fs::write(&path, text).unwrap();
    };
    edit(&TEXT.replace("first = 2.0", "first = 8.0, second = 5.0"));
    eventually(|| number(&agent, "teller/params/first") == 8.0);
    assert_eq!(number(&agent, "teller/params/second"), 5.0);
    let said = |word: &str| log.lines().iter().any(|line| line.to_string().contains(word));
    edit(&TEXT.replace("first = 2.0", "first = -3.0, second = 6.0"));
    eventually(|| said("outside 0 to 1000000") && said("robot.toml:5") && said("help"));
    assert_eq!(number(&agent, "teller/params/first"), 8.0);
    assert_eq!(number(&agent, "teller/params/second"), 5.0);
    // What is left out has its default again.
    edit(&TEXT.replace("first = 2.0", "first = 4.0"));
    eventually(|| number(&agent, "teller/params/first") == 4.0);
    assert_eq!(number(&agent, "teller/params/second"), 1.0);
    drop(agent);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn what_only_the_next_start_can_have_waits_and_holds_up_nothing_else() {
    let path = file("waiting");
    let log = MemoryTarget::default();
    let database = Database::open(&path, configuration::Options::default()).unwrap();
    let agent = load(&database, log.clone());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    let said = |word: &str| log.lines().iter().any(|line| line.to_string().contains(word));
    let with = |text: &str| TEXT.replace("[modules.relay]", &format!("[modules.relay]\n{text}"));
    std::fs::write(&path, with("every = '50ms'").replace("first = 2.0", "first = 8.0")).unwrap();
    eventually(|| said("holds from the next start: modules.relay.every"));
    assert_eq!(number(&agent, "teller/params/first"), 8.0);
    let waiting = |client: &mut Client| -> Vec<_> {
        let different = client.differences().unwrap();
        different.into_iter().map(|one| (one.path, one.file, one.present)).collect()
    };
    let every = ("modules.relay.every".to_owned(), Some("\"50ms\"".to_owned()), None);
    assert_eq!(waiting(&mut client), std::slice::from_ref(&every));
    // Later edits and saves go on, and save nothing of what waits.
    std::fs::write(&path, with("every = '50ms'").replace("first = 2.0", "first = 9.0")).unwrap();
    eventually(|| number(&agent, "teller/params/first") == 9.0);
    client.set(&[change("modules.teller.params.second", "3.5")]).unwrap();
    client.save(SaveTo::Origin).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("every = '50ms'") && text.contains("3.5"), "{text}");
    assert_eq!(waiting(&mut client), [every]);
    let agent_only = configuration::Options::default();
    assert_eq!(Database::open(&path, agent_only).unwrap().get("modules.relay.every").unwrap().len(), 1);
    // A module that came or went waits with all that belongs to it.
    let another = "[modules.another]\nplugin = 'relay'\n[links]\n\"another/input\" = \"counter/number\"";
    let more = text.replace("every = '50ms'\n", "").replace("[links]", another);
    std::fs::write(&path, more).unwrap();
    eventually(|| said("holds from the next start: ") && said("modules.another.plugin"));
    assert!(!agent.modules().contains(&"another".into()));
    // What is taken out again waits no more.
    std::fs::write(&path, text.replace("every = '50ms'\n", "")).unwrap();
    eventually(|| database.waiting().is_empty());
    assert!(client.differences().unwrap().is_empty());
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn changes_are_saved_with_the_comments_of_the_file() {
    let path = file("saved");
    std::fs::write(&path, TEXT.replace("[modules.teller]", "[modules.teller] # it tells")).unwrap();
    let agent =
        load(&Database::open(&path, configuration::Options::default()).unwrap(), MemoryTarget::default());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.set(&[change("modules.teller.params.first", "3.5")]).unwrap();
    assert_eq!(client.save(SaveTo::Origin).unwrap().files, std::slice::from_ref(&path));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("[modules.teller] # it tells\nparams = { first = 3.5 }"), "{text}");
    assert!(client.differences().unwrap().is_empty());
    client.set(&[change("modules.teller.params.first", "4.5")]).unwrap();
    assert!(refused(client.save(SaveTo::Host)).message.contains("no file of this computer"));
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn an_edit_that_is_refused_is_told_and_not_overwritten() {
    let path = file("refused");
    let agent =
        load(&Database::open(&path, configuration::Options::default()).unwrap(), MemoryTarget::default());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.set(&[change("modules.teller.params.second", "3.5")]).unwrap();
    assert_eq!(client.refused_edit().unwrap(), None);
    let edited = TEXT.replace("first = 2.0", "first = -3.0");
    std::fs::write(&path, &edited).unwrap();
    // At once, whether or not the agent has looked at the file by now.
    for refusal in [client.refused_edit().unwrap().unwrap(), refused(client.save(SaveTo::Origin))] {
        assert!(refusal.message.contains("robot.toml:5:"), "{refusal:?}");
        assert!(refusal.message.contains("outside 0 to 1000000"), "{refusal:?}");
        assert!(refusal.report.unwrap().contains("params = { first = -3.0"));
    }
    assert!(refused(client.save(SaveTo::Origin)).message.starts_with("nothing is saved: a file was edited"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), edited);
    assert_eq!(number(&agent, "teller/params/second"), 3.5);
    std::fs::write(&path, TEXT.replace("[modules.relay]", "[modules.relay] # mended")).unwrap();
    eventually(|| client.save(SaveTo::Origin).is_ok());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("{ first = 2.0, second = 3.5 }\n[modules.relay] # mended"), "{text}");
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

//! Traces that callers record at the socket.

use std::path::Path;

use slate_runtime::Rate;

use super::file::tracks;
use super::*;

/// A robot of three stages with a module each.
fn robot(name: &str) -> Agent {
    let name = format!("test-{}-{name}", std::process::id());
    let text = format!(
        "agent.name = \"{name}\"\ntime.source = \"counter\"\n[modules.counter]\n[modules.relay]\n[modules.driver]\n\
         [links]\n\"relay/input\" = \"counter/number\"\n\"driver/input\" = \"relay/output\"\n\
         [actuators.wheel]\ncommand = \"driver/wheel\"\n"
    );
    common::load(&text, &[], Options { rate: Rate::Max, armed: true, ..Options::default() }).unwrap()
}

/// Spans of a cycle: itself, three stages and three modules.
const SPANS: u64 = 7;

fn step(agent: &mut Agent, cycles: u64) {
    (0..cycles).for_each(|_| assert!(agent.step()));
}

/// Makes many cycles, and lets the recording keep up.
fn step_in_time(agent: &mut Agent, cycles: u64, mut spans: impl FnMut() -> u64) {
    let before = spans();
    for made in 1..=cycles {
        assert!(agent.step());
        if made.is_multiple_of(2000) || made == cycles {
            eventually(|| spans() == before + made * SPANS);
        }
    }
}

/// A folder that goes with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(of: &str) -> Self {
        let path = std::env::temp_dir().join(format!("slate-test-{}-{of}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn traced(of: &str) -> (Agent, Server, Folder) {
    let agent = robot(of);
    let server = Server::open(&agent).unwrap();
    (agent, server, Folder::new(of))
}

fn connect(server: &Server) -> Client {
    Client::connect(server.name()).unwrap()
}

fn cycles(file: &Path) -> usize {
    tracks(&std::fs::read(file).unwrap())["main loop"].count("cycle")
}

#[test]
fn two_tools_have_all_of_their_time_in_their_own_files() {
    let (mut agent, server, folder) = traced("tools");
    let (mut first, mut second) = (connect(&server), connect(&server));
    first.record_trace(&folder.file("first.json")).unwrap();
    step_in_time(&mut agent, 5_000, || first.trace_progress().unwrap().spans());
    second.record_trace(&folder.file("second.json")).unwrap();
    let before = first.trace_progress().unwrap();
    assert!(!before.ended && before.spans() == 5_000 * SPANS && before.from < before.to);
    step(&mut agent, 100);
    let entry = first.end_trace().unwrap();
    assert_eq!((entry.ended, entry.spans(), entry.missing()), (true, 5_100 * SPANS, 0));
    assert_eq!((entry.file.as_path(), entry.tracks.len()), (&*folder.file("first.json"), 4));
    step(&mut agent, 100);
    assert_eq!(second.end_trace().unwrap().spans(), 200 * SPANS);
    assert_eq!(folder.names(), ["first.json", "second.json"]);
    assert_eq!((cycles(&folder.file("first.json")), cycles(&folder.file("second.json"))), (5_100, 200));
    assert!(!agent.trace().is_on());
    // One tool may record again, and in the same file.
    first.record_trace(&folder.file("first.json")).unwrap();
    step(&mut agent, 7);
    first.end_trace().unwrap();
    assert_eq!(cycles(&folder.file("first.json")), 7);
}

#[test]
fn aborted_write_leaves_older_file_unchanged() {
    let (mut agent, server, folder) = traced("gone");
    let file = folder.file("trace.json");
    std::fs::write(&file, "older").unwrap();
    // What a process has left that was killed is no hindrance.
    std::fs::write(folder.file("trace.json.part"), "x".repeat(1 << 20)).unwrap();
    let mut client = connect(&server);
    client.record_trace(&file).unwrap();
    step(&mut agent, 10);
    assert_eq!(folder.names(), ["trace.json", "trace.json.part"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "older");
    drop(client);
    eventually(|| !agent.trace().is_on());
    eventually(|| folder.names() == ["trace.json"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "older");
    let mut client = connect(&server);
    client.record_trace(&file).unwrap();
    step(&mut agent, 10);
    client.end_trace().unwrap();
    assert_eq!((cycles(&file), folder.names()), (10, vec!["trace.json".to_owned()]));
}

#[test]
fn unrecordable_settings_are_refused_at_once() {
    let (agent, server, folder) = traced("refused");
    let (mut client, mut other) = (connect(&server), connect(&server));
    let mut refuse = |file: &Path, message: &str, help: &str| {
        let refusal = refused(client.record_trace(file));
        assert!(refusal.message.contains(message) && refusal.help.contains(help), "{refusal:?}");
        assert!(!agent.trace().is_on());
    };
    let exists = "name a file in a folder that exists";
    refuse("trace.json".as_ref(), "relative", "absolute");
    refuse(&folder.file("nowhere/trace.json"), "nowhere/trace.json can't be written", exists);
    refuse(&folder.0, "can't be written", exists);
    refuse("/dev/full".as_ref(), "/dev/full can't be written: it is a device", exists);
    assert!(refused(client.trace_progress()).message.contains("records no trace"));
    assert!(refused(client.end_trace()).help.contains("POST /api/v1/trace"));
    let file = folder.file("trace.json");
    client.record_trace(&file).unwrap();
    let twice = refused(client.record_trace(&folder.file("other.json")));
    assert!(
        twice.message.contains("trace.json already") && twice.help.contains("DELETE /api/v1/trace"),
        "{twice:?}"
    );
    let taken = refused(other.record_trace(&file));
    assert!(taken.message.contains("just being written") && taken.help.contains("another file"), "{taken:?}");
    client.end_trace().unwrap();
    assert!(refused(client.end_trace()).message.contains("records no trace"));
    other.record_trace(&file).unwrap();
    other.end_trace().unwrap();
    assert_eq!(folder.names(), ["trace.json"]);
}

#[test]
fn an_agent_that_ends_ends_the_traces_of_its_tools() {
    let (mut agent, server, folder) = traced("ends");
    let (mut asks, mut silent) = (connect(&server), connect(&server));
    asks.record_trace(&folder.file("asks.json")).unwrap();
    silent.record_trace(&folder.file("silent.json")).unwrap();
    step(&mut agent, 20);
    let asking = std::thread::spawn(move || {
        loop {
            let progress = asks.trace_progress().unwrap();
            if progress.ended {
                return progress;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    });
    drop(server);
    assert_eq!(asking.join().unwrap().spans(), 20 * SPANS);
    assert!(silent.trace_progress().is_err());
    assert_eq!(folder.names(), ["asks.json", "silent.json"]);
    assert!(folder.names().iter().all(|name| cycles(&folder.file(name)) == 20));
}

#[test]
fn a_silent_recorder_stays_connected_and_delays_no_stop() {
    let (mut agent, server, folder) = traced("silent");
    let mut recording: Vec<_> = (0..32)
        .map(|number| {
            let mut client = connect(&server);
            client.record_trace(&folder.file(&format!("{number}.json"))).unwrap();
            client
        })
        .collect();
    let mut late = connect(&server);
    assert!(refused(late.record_trace(&folder.file("late.json"))).message.contains("too many tools"));
    let _silent: Vec<_> = (0..60)
        .map(|_| {
            let stream = UnixStream::connect(server.socket()).unwrap();
            // It is noticed before the next one.
            std::thread::sleep(Duration::from_millis(2));
            stream
        })
        .collect();
    connect(&server).stop("as a test").unwrap();
    step(&mut agent, 10);
    for (number, client) in recording.iter_mut().enumerate() {
        assert_eq!(client.end_trace().unwrap().spans(), 10 * SPANS);
        assert_eq!(cycles(&folder.file(&format!("{number}.json"))), 10);
    }
    assert!(!agent.trace().is_on());
}

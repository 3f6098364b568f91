//! What a recording promises to the robot and to whoever reads it, with files that are slow, full, or fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::io::{self, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};

use mcap::MessageStream;
use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::{Recorder, bag};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Control, Options, RecordedTimes};

/// A number, and room for more.
#[interface]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Others.
    pub others: [f64; 16],
}

/// What it writes.
#[ports]
pub struct CounterIo {
    number: Output<Number>,
}

/// How it counts.
#[params]
pub struct CounterParams {
    #[param(default = 1.0, doc = "how far it counts at once")]
    step: f64,
    #[param(default = 1e9, doc = "the number at which it panics")]
    limit: f64,
}

/// Counts.
pub struct Counter;

#[module(stage = Think)]
impl Module for Counter {
    type Io = CounterIo;
    type Params = CounterParams;
    type State = f64;

    fn tick(state: &mut f64, io: &CounterIo, params: &CounterParams, _: &Tick) -> Outcome {
        *state += params.step;
        assert!(*state < params.limit, "it can't count that far");
        io.number.set(Number { value: *state, others: [0.0; 16] });
        Outcome::Ok
    }
}

/// Bytes that can be looked at afterwards.
#[derive(Clone, Default)]
struct Bytes(Arc<Mutex<Vec<u8>>>);

impl Write for Bytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Has room for so many bytes.
struct Full(Bytes, usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.0.lock().unwrap().len() + bytes.len() > self.1 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes nothing after its first bytes until it may.
struct Stuck {
    bytes: Bytes,
    may: Receiver<()>,
    writes: usize,
}

impl Write for Stuck {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writes += 1;
        if self.writes > 1 {
            // It may for good when nobody can say so any more.
            let _ = self.may.recv();
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

const LOCKSTEP: bool = true;

/// An agent with a module that counts, and what records it; `extra` is said in `[record]`.
fn agent(lockstep: bool, extra: &str) -> (Agent, Recorder, MemoryTarget) {
    let text = format!(
        "[loop]\nperiod = \"1ms\"\n[log.targets]\nconsole = false\n[modules.counter]\nplugin = \"counter\"\n\
         [record]\nenabled = true\n{extra}"
    );
    let database = Database::from_text("robot.toml", &text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let log = MemoryTarget::default();
    let options = Options {
        time_source: lockstep.then(|| Box::new(RecordedTimes::new(Vec::new())) as _),
        recording: Some(Arc::new(recorder.clone())),
        log: vec![Box::new(log.clone()), recorder.log_target()],
        ..Options::default()
    };
    let plugins = [Plugin::linked::<Counter>()];
    (Agent::load_with(&database, &plugins, options).unwrap(), recorder, log)
}

/// The numbers of the values of a property in a file.
fn numbers(file: &[u8], topic: &str) -> Vec<u32> {
    let all = MessageStream::new(file).unwrap().map(|message| message.unwrap());
    all.filter(|message| message.channel.topic == topic).map(|message| message.sequence).collect()
}

#[test]
fn in_lockstep_the_loop_waits_for_a_recorder_that_is_behind() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "buffer = \"1KiB\"\nchunk = \"1KiB\"");
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    let steps = std::thread::spawn(move || {
        (0..1000).for_each(|_| assert!(agent.step()));
        agent
    });
    for _ in 0..20 {
        go.send(()).unwrap();
    }
    drop(go);
    let mut agent = steps.join().unwrap();
    let recorded = recorder.end(&mut agent).unwrap();
    assert_eq!(recorded.dropped, 0);
    let file = bytes.0.lock().unwrap().clone();
    assert_eq!(recorded.bytes, file.len() as u64);
    assert_eq!(numbers(&file, "/counter/number"), (1..=1000).collect::<Vec<_>>());
}

#[test]
fn on_the_wall_clock_nobody_waits_and_drops_are_counted_in_the_file() {
    let small =
        "buffer = \"1KiB\"\nchunk = \"1KiB\"\nselect = [\"/counter/**\"]\nexclude = [\"/**/histogram\"]";
    let (mut agent, recorder, _) = agent(!LOCKSTEP, small);
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    // The file takes nothing meanwhile, and the run ends all the same.
    let stop =
        |cycle: &slate_runtime::Cycle<'_>| if cycle.number < 100 { Control::Continue } else { Control::Stop };
    agent.run(Box::new(stop)).unwrap();
    drop(go);
    let written = agent.board().read("counter/number").unwrap().unwrap().1.sequence;
    let recorded = recorder.end(&mut agent).unwrap();
    let file = bytes.0.lock().unwrap().clone();
    let numbers = numbers(&file, "/counter/number");
    assert!(recorded.dropped > 0 && numbers.is_sorted(), "{recorded:?}");
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let index = summary.metadata_indexes.iter().find(|index| index.name == "dropped").unwrap();
    let dropped = mcap::read::metadata(&file, index).unwrap().metadata;
    let own: u64 = dropped["/counter/number"].parse().unwrap();
    assert_eq!(numbers.len() as u64 + own, written, "every value is in the file or counted");
}

#[test]
fn a_disk_that_gets_full_ends_the_recording_with_one_line_and_the_agent_goes_on() {
    let (mut without, _, _) = agent(LOCKSTEP, "");
    let (mut agent, recorder, log) = agent(LOCKSTEP, "chunk = \"1KiB\"");
    let bytes = Bytes::default();
    let full = Full(bytes.clone(), 20_000);
    recorder.begin_with(&agent, Path::new("here"), Box::new(full));
    for _ in 0..2000 {
        assert!(agent.step() && without.step());
    }
    assert_eq!(agent.digest(), without.digest());
    let error = recorder.end(&mut agent).unwrap_err().to_string();
    assert!(error.contains("the recording here has not all of the run: "), "{error}");
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let said = lines.iter().filter(|line| line.text.contains("the recording here ends here")).count();
    assert_eq!(said, 1, "{lines:?}");
    let (state, _) = agent.board().read("record/state").unwrap().unwrap();
    assert_eq!(state.get("is_on"), Some(&Value::Bool(false)));
    // What was closed before is there.
    let file = bytes.0.lock().unwrap().clone();
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let there = MessageStream::new_with_options(&file, options).unwrap().filter(Result::is_ok).count();
    assert!(there > 50, "{there}");
}

#[test]
fn every_write_is_recorded_also_several_in_one_cycle_and_those_before_the_file_is_open() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    let set = |agent: &Agent, value: f64| {
        agent.board().write("counter/params/step", &Value::Float(value), agent.now()).unwrap();
    };
    set(&agent, 2.0);
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
    agent.step();
    (3..8).for_each(|value| set(&agent, value.into()));
    agent.step();
    recorder.end(&mut agent).unwrap();
    let file = bytes.0.lock().unwrap().clone();
    assert_eq!(numbers(&file, "/counter/params"), (1..=7).collect::<Vec<_>>());
    assert_eq!(numbers(&file, "/counter/number"), [1, 2]);
}

/// Panics when so many bytes are there.
struct Broken(Bytes, usize);

impl Write for Broken {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        assert!(self.0.0.lock().unwrap().len() < self.1, "a disk that is no disk");
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_thread_that_dies_ends_the_recording_with_one_line_and_the_agent_goes_on() {
    let (mut without, _, _) = agent(LOCKSTEP, "");
    let (mut agent, recorder, log) = agent(LOCKSTEP, "chunk = \"1KiB\"\nbuffer = \"1KiB\"");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(Broken(bytes.clone(), 20_000)));
    for _ in 0..2000 {
        assert!(agent.step() && without.step());
    }
    assert_eq!(agent.digest(), without.digest());
    let error = recorder.end(&mut agent).unwrap_err().to_string();
    assert!(
        error.contains("the recording here has not all of the run: ") && error.contains("panicked"),
        "{error}"
    );
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let said = lines.iter().filter(|line| line.text.contains("the recorder has panicked")).count();
    assert_eq!(said, 1, "{lines:?}");
    let (state, _) = agent.board().read("record/state").unwrap().unwrap();
    assert_eq!(state.get("is_on"), Some(&Value::Bool(false)));
    let file = bytes.0.lock().unwrap().clone();
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let there = MessageStream::new_with_options(&file, options).unwrap().filter(Result::is_ok).count();
    assert!(there > 50, "{there}");
}

/// A recording of a run, as it is on the disk.
fn reference() -> Vec<u8> {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "chunk = \"2KiB\"");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
    (0..200).for_each(|_| assert!(agent.step()));
    recorder.end(&mut agent).unwrap();
    bytes.0.lock().unwrap().clone()
}

/// A message: its topic, number and time, and its bytes.
type Message = (String, u32, u64, Vec<u8>);

/// All messages of a file; an error when anything of it is damaged.
fn read(file: &[u8]) -> Result<Vec<Message>, bag::Error> {
    let mut reader = bag::Reader::new(io::Cursor::new(file), "here")?;
    let mut all = Vec::new();
    while let Some(message) = reader.next_message()? {
        let (topic, data) = (message.channel.topic.clone(), message.data.to_vec());
        all.push((topic, message.sequence, message.log_time, data));
    }
    Ok(all)
}

#[test]
fn a_recording_that_was_cut_or_damaged_anywhere_is_an_error_and_never_silently_wrong() {
    let file = reference();
    let whole = read(&file).unwrap();
    assert!(whole.len() > 200);
    // A sample: all places are tried with the smaller files of the tests of `bag`.
    for place in (0..file.len()).step_by(97) {
        assert!(read(&file[..place]).is_err(), "cut at {place}");
        let mut flipped = file.clone();
        flipped[place] ^= 1 << (place % 8);
        match read(&flipped) {
            Err(error) => assert!(error.to_string().contains("here"), "{error}"),
            Ok(all) => assert!(all == whole, "bit {} of byte {place} changes what is read", place % 8),
        }
    }
}

#[test]
fn a_fault_saves_what_was_before_it_and_a_run_without_one_saves_nothing() {
    let extra = "flight = { keep = \"100ms\", trigger = [\"fault\"] }";
    for (limit, name) in [(1e9, "without"), (400.0, "with")] {
        let (mut agent, recorder, _) = agent(LOCKSTEP, extra);
        agent.board().write("counter/params/limit", &Value::Float(limit), 0).unwrap();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-fault").join(name);
        let _ = std::fs::remove_dir_all(&folder);
        recorder.attach(&agent, &folder);
        (0..410).for_each(|_| assert!(agent.step()));
        recorder.end(&mut agent).unwrap();
        let saved = folder.join("flight-fault-1.mcap");
        assert_eq!(saved.exists(), limit < 1e9);
        if !saved.exists() {
            continue;
        }
        let all = read(&std::fs::read(saved).unwrap()).unwrap();
        let own = all.iter().filter(|(topic, ..)| topic == "/counter/number");
        let numbers: Vec<_> = own.map(|(_, number, ..)| *number).collect();
        assert!(numbers.contains(&399) && numbers[0] > 1, "{numbers:?}");
        assert!(all.iter().any(|(topic, ..)| topic == "/counter/params"), "which was set long before");
        assert!(!folder.join("flight-fault-2.mcap").exists(), "it panics on, but that is no news for 10 s");
    }
}

#[test]
fn a_recording_that_has_not_begun_has_no_end() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    assert!(recorder.end(&mut agent).unwrap_err().to_string().contains("has not begun"));
}

//! An agent that is recorded, and what its recordings are written to.

use std::io::{self, Write};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};

use mcap::MessageStream;
use slate_bag as bag;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Options, RecordedTimes};

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
    /// Written only for readers.
    half: Debug<Number>,
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
        io.half.set(|| Number { value: *state / 2.0, others: [0.0; 16] });
        Outcome::Ok
    }
}

/// Bytes that can be looked at afterwards.
#[derive(Clone, Default)]
pub struct Bytes(pub Arc<Mutex<Vec<u8>>>);

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
pub struct Full(pub Bytes, pub usize);

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
pub struct Stuck {
    pub bytes: Bytes,
    pub may: Receiver<()>,
    pub writes: usize,
}

impl Write for Stuck {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writes += 1;
        if self.writes > 1 {
            // It may forever when no sender is left.
            let _ = self.may.recv();
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

pub const LOCKSTEP: bool = true;

/// An agent with a module that counts, and what records it; `extra` is said in `[record]`.
pub fn agent(lockstep: bool, extra: &str) -> (Agent, Recorder, MemoryTarget) {
    let text = format!(
        "[loop]\nperiod = \"1ms\"\n[log.targets]\nconsole = false\n[modules.counter]\nkind = \"counter\"\n\
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
pub fn numbers(file: &[u8], topic: &str) -> Vec<u32> {
    let all = MessageStream::new(file).unwrap().map(|message| message.unwrap());
    all.filter(|message| message.channel.topic == topic).map(|message| message.sequence).collect()
}

/// A message: its topic, number and time, and its bytes.
pub type Message = (String, u32, u64, Vec<u8>);

/// All messages of a file; an error when anything of it is damaged.
pub fn read(file: &[u8]) -> Result<Vec<Message>, bag::Error> {
    let mut reader = bag::Reader::new(io::Cursor::new(file), "here")?;
    let mut all = Vec::new();
    while let Some(message) = reader.next_message()? {
        let (topic, data) = (message.channel.topic.clone(), message.data.to_vec());
        all.push((topic, message.sequence, message.log_time, data));
    }
    Ok(all)
}

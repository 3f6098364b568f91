//! The hot paths whose instructions are counted.

use std::fmt::Write;
use std::hint::black_box;
use std::sync::Arc;

use crate::controller;
use crate::folder::ProcessFolder;
use crate::monitors;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Policy, Start};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_runtime::configuration::{Database, Options as Layers, Record};
use slate_runtime::recording::Recording;
use slate_runtime::{Agent, Options, Rate, RecordedTimes};

/// Names of the paths, and operations of the two runs whose difference counts.
pub const ALL: [(&str, u32, u32); 13] = [
    ("write a value", 10_000, 30_000),
    ("read a value", 10_000, 30_000),
    ("push to a queue and pull", 10_000, 30_000),
    ("a cycle of 17 modules", 500, 1500),
    ("a cycle of 17 modules, recorded", 500, 1500),
    ("sonars without a Monitor", 500, 1500),
    ("sonars, Monitor returns them", 500, 1500),
    ("sonars, Monitor hands them on", 500, 1500),
    ("laser without a Monitor", 500, 1500),
    ("laser, Monitor copies it", 500, 1500),
    ("laser, Monitor hands it on", 500, 1500),
    (TICK_IN_RUST, 10_000, 30_000),
    (TICK_IN_CPP, 10_000, 30_000),
];

/// Tick of a controller behind its table, in both languages.
pub const TICK_IN_RUST: &str = "a tick in Rust";
pub const TICK_IN_CPP: &str = "a tick in C++";

/// Does one so often.
pub fn run(name: &str, count: u32) -> Result<(), String> {
    match name {
        "write a value" => write(count),
        "read a value" => read(count),
        "push to a queue and pull" => queue(count),
        "a cycle of 17 modules" => cycle(count, false),
        "a cycle of 17 modules, recorded" => cycle(count, true),
        "sonars without a Monitor" => monitors::cycle(count, ""),
        "sonars, Monitor returns them" => monitors::cycle(count, "returns_sonars"),
        "sonars, Monitor hands them on" => monitors::cycle(count, "hands_on_sonars"),
        "laser without a Monitor" => monitors::cycle(count, "."),
        "laser, Monitor copies it" => monitors::cycle(count, "copies_laser"),
        "laser, Monitor hands it on" => monitors::cycle(count, "hands_on_laser"),
        TICK_IN_RUST => controller::ticks(count, false),
        TICK_IN_CPP => controller::ticks(count, true),
        _ => Err(format!("there is no path `{name}`")),
    }
}

const VALUE: [u8; 64] = [1; 64];

fn channel(depth: usize, latest: u16, queues: u16) -> Arc<Channel> {
    Channel::new(Shape::fixed(64, 8), depth, Budget { latest, queues, window: 64 })
}

/// Takes a value whose making must not be left out.
fn consume<T>(value: T) {
    black_box(value);
}

fn text(error: impl std::fmt::Debug) -> String {
    format!("{error:?}")
}

fn write(count: u32) -> Result<(), String> {
    let channel = channel(1, 4, 0);
    let mut writer = channel.writer().map_err(text)?;
    for _ in 0..count {
        writer.write(black_box(&VALUE), 0, 0).map_err(text)?;
    }
    Ok(())
}

/// Each value is new, so this is writing too.
fn read(count: u32) -> Result<(), String> {
    let channel = channel(1, 4, 0);
    let mut writer = channel.writer().map_err(text)?;
    let mut reader = channel.latest().map_err(text)?;
    for _ in 0..count {
        writer.write(black_box(&VALUE), 0, 0).map_err(text)?;
        black_box(reader.refresh());
        black_box(reader.value().map(|loan| loan.bytes()[0]));
    }
    Ok(())
}

fn queue(count: u32) -> Result<(), String> {
    let channel = channel(128, 0, 1);
    let mut writer = channel.writer().map_err(text)?;
    let mut reader = channel.queue(Policy::Skip, Start::Next).map_err(text)?;
    for i in 1..=count {
        writer.write(black_box(&VALUE), 0, 0).map_err(text)?;
        if i % 50 == 0 {
            reader.pull().map_err(text)?;
            reader.window().for_each(|loan| consume(loan.bytes()[0]));
            reader.release();
        }
    }
    Ok(())
}

/// A number.
#[interface]
pub struct Number {
    /// The number.
    pub value: f64,
}

/// The ports of a segment.
#[ports]
pub struct SegmentIo {
    input: Required<Number>,
    output: Output<Number>,
}

/// Passes a number on, plus one.
pub struct Segment;

#[module(stage = Think)]
impl Module for Segment {
    type Io = SegmentIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SegmentIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(Number { value: io.input.value + 1.0 });
        Outcome::Ok
    }
}

fn cycle(count: u32, recorded: bool) -> Result<(), String> {
    let folder = ProcessFolder::new().map_err(text)?;
    let mut settings = Record { enabled: recorded, ..Record::default() };
    settings.flight.enabled = false;
    let recorder = recorded.then(|| Recorder::on_demand(&settings));
    let mut configuration = String::from("[log.targets]\nconsole = false\n");
    for module in 0..17 {
        let _ = writeln!(configuration, "[modules.m{module:02}]\nkind = \"segment\"");
    }
    // The first one has no predecessor.
    configuration.push_str("[modules.m00.inputs]\ninput = { value = 0.0 }\n[links]\n");
    for module in 1..17 {
        let _ = writeln!(configuration, "\"m{module:02}/input\" = \"m{:02}/output\"", module - 1);
    }
    let database =
        Database::from_text("instructions.toml", &configuration, Layers::default()).map_err(text)?;
    let options = Options {
        rate: Rate::Max,
        time_source: Some(Box::new(RecordedTimes::new(Vec::new()))),
        recording: recorder.clone().map(|recorder| Arc::new(recorder) as Arc<dyn Recording>),
        log: recorder.iter().map(|recorder| recorder.log_target()).collect(),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &[Plugin::linked::<Segment>()], options).map_err(text)?;
    if let Some(recorder) = &recorder {
        recorder.attach(&agent, folder.path());
    }
    for _ in 0..count {
        black_box(agent.step());
    }
    if let Some(Some(recorded)) = recorder.map(|recorder| recorder.finish(&mut agent)) {
        recorded.map_err(text)?;
    }
    Ok(())
}

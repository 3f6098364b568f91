//! Agents that are recorded, and what is played of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use slate_bag::{Channel, Compression, Header, Reader, Schema, Writer};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_replay::{Plan, PlayedRun, Player, Recomputation};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, Control, Cycle, Options, RecordedTimes};

use crate::replay::order::{Asker, Driver};

/// A number.
#[interface]
pub struct Number {
    /// The number.
    pub value: f64,
}

/// What it writes.
#[ports]
pub struct SourceIo {
    number: Output<Number>,
}

/// How it counts.
#[params]
pub struct SourceParams {
    #[param(default = 1.0, doc = "how far it counts at once")]
    step: f64,
    #[param(default = 0.0, doc = "the first number that it writes")]
    first: f64,
}

/// Counts, and writes numbers from a first one on.
pub struct Source;

#[module(stage = SensorAcquire)]
impl Module for Source {
    type Io = SourceIo;
    type Params = SourceParams;
    type State = f64;

    fn tick(state: &mut f64, io: &SourceIo, params: &SourceParams, _: &Tick) -> Outcome {
        *state += params.step;
        if *state >= params.first {
            io.number.set(Number { value: *state });
        }
        Outcome::Ok
    }
}

/// What it reads and writes.
#[ports]
pub struct SumIo {
    number: Input<Number>,
    other: Input<Number>,
    sum: Output<Number>,
}

/// What it adds.
#[params]
pub struct SumParams {
    #[param(default = 2.0, doc = "what the number is multiplied by")]
    gain: f64,
}

/// Sums up what it reads, so that each value depends on all before.
pub struct Sum;

#[module(stage = Think)]
impl Module for Sum {
    type Io = SumIo;
    type Params = SumParams;
    type State = f64;

    fn tick(state: &mut f64, io: &SumIo, params: &SumParams, _: &Tick) -> Outcome {
        *state += io.number.fresh().map_or(0.5, |number| number.value * params.gain);
        *state -= io.other.fresh().map_or(0.25, |other| other.value / 3.0);
        io.sum.set(Number { value: *state });
        Outcome::Ok
    }
}

/// What it reads and writes.
#[ports]
pub struct ScaleIo {
    number: Input<Number>,
    scaled: Output<Number>,
}

/// Multiplies what it reads, and remembers nothing.
pub struct Scale;

#[module(stage = Think)]
impl Module for Scale {
    type Io = ScaleIo;
    type Params = SumParams;
    type State = ();

    fn tick(_: &mut (), io: &ScaleIo, params: &SumParams, _: &Tick) -> Outcome {
        if let Some(number) = io.number.fresh() {
            io.scaled.set(Number { value: number.value * params.gain });
        }
        Outcome::Ok
    }
}

/// What it reads, all of it.
#[ports]
pub struct GathererIo {
    numbers: Queue<Number>,
    count: Output<Number>,
}

/// Counts what comes in a queue.
pub struct Gatherer;

#[module(stage = WorldState)]
impl Module for Gatherer {
    type Io = GathererIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &GathererIo, _: &(), _: &Tick) -> Outcome {
        for number in io.numbers.iter() {
            *state = *state * 0.5 + number.value;
        }
        io.count.set(Number { value: *state });
        Outcome::Ok
    }
}

/// What it sees, and says.
#[ports]
pub struct SeenIo {
    number: Input<Number>,
    other: Input<Number>,
    seen: Output<Number>,
}

/// Publishes which values it sees, whether they are new, and whether their writer works.
pub struct Seen;

#[module(stage = Think, on = number)]
impl Module for Seen {
    type Io = SeenIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &SeenIo, _: &(), _: &Tick) -> Outcome {
        for input in [&io.number, &io.other] {
            let flags = [input.is_new(), input.is_stale(), input.has_writer()];
            let flags = flags.iter().fold(0.0, |sum, flag| sum * 2.0 + f64::from(u8::from(*flag)));
            *state = *state * 0.875 + input.stamp().sequence as f64 + flags * 0.125;
        }
        io.seen.set(Number { value: *state });
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    vec![Plugin::new(
        "test",
        [
            Plugin::linked::<Source>(),
            Plugin::linked::<Sum>(),
            Plugin::linked::<Scale>(),
            Plugin::linked::<Gatherer>(),
            Plugin::linked::<Seen>(),
            Plugin::linked::<Driver>(),
            Plugin::linked::<Asker>(),
        ]
        .iter()
        .flat_map(Plugin::kinds)
        .cloned(),
    )]
}

/// Two that read each other, one of them what was in the last cycle, one that reads all, and one that begins late.
pub const ROBOT: &str = r#"
[agent]
name = "robot"
[loop]
period = "10ms"
[log.targets]
console = false
[modules.source]
[modules.late]
kind = "source"
params = { first = 20.0 }
[modules.front]
kind = "sum"
stage = "SensorAcquire"
[modules.back]
kind = "sum"
[modules.gatherer]
[links]
"front/number" = "source/number"
"front/other" = { from = "back/sum", previous = true }
"back/number" = "front/sum"
"back/other" = { from = "source/number", previous = true }
"gatherer/numbers" = "source/number"
[record]
enabled = true
"#;

/// The times of its cycles, milliseconds: mostly ten apart.
pub fn times() -> Vec<u64> {
    let mut times: Vec<u64> = (0..30).map(|cycle| cycle * 10_000_000).collect();
    // A time source may go in steps of its own.
    times[7] -= 3_000_000;
    times
}

pub fn file(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("replay");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// Records the robot; `between` is called before each cycle.
pub fn record(path: &Path, text: &str, mut between: impl FnMut(&Agent, usize)) {
    let database = Database::from_text("robot.toml", text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new(times()))),
        recording: Some(Arc::new(recorder.clone())),
        log: vec![recorder.log_target()],
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.begin(&agent, path);
    for cycle in 0..times().len() {
        between(&agent, cycle);
        assert!(agent.step());
    }
    recorder.end(&mut agent).unwrap();
}

/// A recording of the robot.
pub fn recorded(name: &str) -> PathBuf {
    let path = file(name);
    record(&path, ROBOT, |_, _| {});
    path
}

/// What is played, by an agent that was loaded for it.
pub fn load(player: &Player, recorder: Option<&Recorder>) -> Agent {
    let other = recorder.map(|recorder| Arc::new(recorder.clone()) as _);
    let options = Options {
        rate: player.rate(),
        recording: player.recording(other),
        playback: Some(player.playback()),
        ..Options::default()
    };
    let database = player.configuration().unwrap();
    Agent::load_with(&database, &plugins(), options).unwrap_or_else(|error| panic!("{error:?}"))
}

/// Plays a recording to its end.
pub fn play(path: &Path, plan: Plan) -> (PlayedRun, Option<Recomputation>, Player) {
    let mut player = Player::open(path, &plugins(), plan).unwrap();
    let mut agent = load(&player, None);
    let played = player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    let outcome = player.outcome().unwrap();
    (played, outcome, player)
}

/// A value as it stands in a file: sequence, time and bytes.
pub type Written = (u32, u64, Vec<u8>);

/// The values of a topic.
pub fn values(path: &Path, topic: &str) -> Vec<Written> {
    let mut reader = Reader::open(path).unwrap();
    let mut all = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        if message.channel.topic == topic {
            all.push((message.sequence, message.log_time, message.data.to_vec()));
        }
    }
    all
}

/// A foreign file: topics, each with type, definition, encoding and values.
pub struct Foreign<'a> {
    pub topic: &'a str,
    pub kind: &'a str,
    pub text: &'a str,
    pub encoding: &'a str,
    /// Times and bytes behind the header of CDR.
    pub values: Vec<(u64, Vec<u8>)>,
}

pub fn foreign(name: &str, topics: &[Foreign<'_>]) -> PathBuf {
    foreign_in(Compression::Lz4, name, topics)
}

pub fn foreign_in(compression: Compression, name: &str, topics: &[Foreign<'_>]) -> PathBuf {
    let path = file(name);
    let header = Header { profile: "ros2".into(), library: "somebody".into() };
    let mut writer = Writer::new(Vec::new(), &path, &header, compression).unwrap();
    for (id, topic) in (1..).zip(topics) {
        let data = topic.text.as_bytes().to_vec();
        writer.schema(&Schema { id, name: topic.kind.into(), encoding: "ros2msg".into(), data }).unwrap();
        writer
            .channel(&Channel {
                id,
                schema_id: id,
                topic: topic.topic.into(),
                message_encoding: topic.encoding.into(),
                metadata: [].into(),
            })
            .unwrap();
        for (time, bytes) in &topic.values {
            writer.message(id, 0, *time, *time, &[&[0, 1, 0, 0], &bytes[..]].concat()).unwrap();
        }
    }
    std::fs::write(&path, writer.finish().unwrap()).unwrap();
    path
}

/// Records some cycles of the robot on the wall clock.
pub fn record_on_the_wall_clock(path: &Path) {
    record_on_the_wall_clock_with(path, &[]);
}

/// The same, with settings that get values at certain times after the beginning.
pub fn record_on_the_wall_clock_with(path: &Path, changes: &[(Duration, &str, &str)]) {
    let database = Database::from_text("robot.toml", ROBOT, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options { recording: Some(Arc::new(recorder.clone())), ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.begin(&agent, path);
    // A change may be late; each is followed by some cycles.
    let made = Arc::new(AtomicUsize::new(0));
    let (seen, wanted) = (made.clone(), changes.len());
    let mut cycles_after = 0;
    let until = move |cycle: &Cycle<'_>| {
        cycles_after += u64::from(seen.load(Ordering::Relaxed) == wanted);
        if cycle.number < 30 || cycles_after < 6 { Control::Continue } else { Control::Stop }
    };
    let database = agent.database().unwrap().clone();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut passed = Duration::ZERO;
            for (after, path, value) in changes {
                std::thread::sleep(*after - passed);
                passed = *after;
                database.set(&[(*path, *value)]).unwrap();
                made.fetch_add(1, Ordering::Relaxed);
            }
        });
        agent.run(Box::new(until)).unwrap();
    });
    recorder.end(&mut agent).unwrap();
}

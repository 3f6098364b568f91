//! Agents of Slate that several works need.

use std::fmt::Write;
use std::sync::Arc;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_network::TABLE;
use slate_record::Recorder;
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::recording::Recording;
use slate_runtime::{Agent, Options, Rate, RecordedTimes};

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

/// The configuration of modules in a row, each reading the one before.
pub fn row(modules: usize) -> String {
    let mut text = String::from("[log.targets]\nconsole = false\n");
    for module in 0..modules {
        let _ = write!(text, "[modules.m{module:04}]\nkind = \"segment\"\n");
    }
    // The first one has no predecessor.
    text.push_str("[modules.m0000.inputs]\ninput = { value = 0.0 }\n[links]\n");
    for module in 1..modules {
        let _ = writeln!(text, "\"m{module:04}/input\" = \"m{:04}/output\"", module - 1);
    }
    text
}

/// The settings of an agent in text, as a file would have them.
pub fn database(text: &str) -> Database {
    let layers = Layers { extra_tables: vec![TABLE.into()], ..Layers::default() };
    Database::from_text("bench.toml", text, layers).expect("the configuration of a bench is right")
}

/// An agent of segments in lockstep, without a rate limit.
pub fn lockstep(text: &str, recorder: Option<&Recorder>) -> Agent {
    let options = Options {
        rate: Rate::Max,
        time_source: Some(Box::new(RecordedTimes::new(Vec::new()))),
        recording: recorder.map(|recorder| Arc::new(recorder.clone()) as Arc<dyn Recording>),
        log: recorder.iter().map(|recorder| recorder.log_target()).collect(),
        ..Options::default()
    };
    let agent = Agent::load_with(&database(text), &[Plugin::linked::<Segment>()], options);
    agent.expect("the modules of a bench fit")
}

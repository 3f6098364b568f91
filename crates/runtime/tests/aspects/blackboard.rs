//! The aspect BlackBoard.

use std::sync::Arc;

use slate_blackboard::channel::{Policy, Start};
use slate_blackboard::{Property, Stamp};
use slate_module::Plugin;
use slate_module::aspect::{Aspect, BlackBoard, BoardEvent};
use slate_module::prelude::*;
use slate_runtime::{Agent, Options, Rate};

use crate::aspects::common::{Number, Pair, load, number};
use crate::aspects::{agent, logged, says, steps};

#[params]
pub struct ScribeParams {
    #[param(default = 0, doc = "fails in that tick, after it has written")]
    fail_at: u64,
    #[param(default = 0, doc = "panics in that tick, after it has written")]
    panic_at: u64,
    #[param(default = 0, doc = "writes a NaN in that tick")]
    nan_at: u64,
    #[param(default = "", doc = "what it writes")]
    write: Text<60>,
    #[param(default = "", doc = "what it writes too, as a pair")]
    write_pair: Text<60>,
    #[param(default = "", doc = "what it reads")]
    read: Text<60>,
    #[param(default = "", doc = "whose paths it lists")]
    list: Text<60>,
    #[param(default = "", doc = "whose events it logs")]
    events: Text<60>,
}

/// What a scribe has seen.
#[interface]
pub struct Seen {
    /// What it read; -1 when nothing was there.
    pub value: f64,
    /// The value's number.
    pub sequence: u64,
    /// The writer's generation.
    pub generation: u64,
    /// Whether the last tick did not see it.
    pub new: u64,
    /// Whether it has a writer.
    pub alive: u64,
    /// How many paths were listed.
    pub listed: u64,
}

#[ports]
pub struct ScribeIo {
    board: Aspect<BlackBoard>,
    seen: Output<Seen>,
}

/// Writes and reads what its parameters say, and logs what is refused.
pub struct Scribe;

#[module(stage = Think)]
impl Module for Scribe {
    type Io = ScribeIo;
    type Params = ScribeParams;
    type State = ();

    fn tick(_: &mut (), io: &ScribeIo, params: &ScribeParams, now: &Tick) -> Outcome {
        let refused = |what: &str, reason: &dyn std::fmt::Display| {
            now.warn(format_args!("{what}: {reason}"));
        };
        let value = if now.number() == params.nan_at { f64::NAN } else { now.number() as f64 };
        if !params.write.as_str().is_empty()
            && let Err(reason) = io.board.write(params.write.as_str(), &Number { value })
        {
            refused("write", &reason);
        }
        if !params.write_pair.as_str().is_empty()
            && let Err(reason) =
                io.board.write(params.write_pair.as_str(), &Pair { first: value, second: value })
        {
            refused("write pair", &reason);
        }
        let mut seen = Seen { value: -1.0, sequence: 0, generation: 0, new: 0, alive: 0, listed: 0 };
        if !params.read.as_str().is_empty() {
            match io.board.read::<Number>(params.read.as_str()) {
                Ok(Some(sample)) => {
                    let Stamp { sequence, generation, .. } = sample.stamp();
                    seen = Seen {
                        value: sample.value,
                        sequence,
                        generation,
                        new: sample.is_new().into(),
                        alive: sample.has_writer().into(),
                        listed: 0,
                    };
                    let again = io.board.read::<Number>(params.read.as_str()).unwrap().unwrap();
                    assert_eq!(again.stamp(), sample.stamp(), "the same during a whole tick");
                    assert_eq!(again.is_new(), sample.is_new());
                }
                Ok(None) => {}
                Err(reason) => refused("read", &reason),
            }
        }
        if !params.list.as_str().is_empty() {
            match io.board.matching::<Number>(params.list.as_str()) {
                Ok(paths) => {
                    seen.listed = paths.len() as u64;
                    now.info(format_args!("paths: {}", paths.join(" ")));
                }
                Err(reason) => refused("list", &reason),
            }
        }
        while !params.events.as_str().is_empty() {
            match io.board.event(params.events.as_str()) {
                Ok(Some((path, event))) => now.info(format_args!("event: {path} {}", name(event))),
                Ok(None) => break,
                Err(reason) => {
                    refused("events", &reason);
                    break;
                }
            }
        }
        io.seen.set(seen);
        if now.number() == params.panic_at {
            panic!("as the test wants");
        }
        if now.number() == params.fail_at { Outcome::Failed } else { Outcome::Ok }
    }
}

fn name(event: BoardEvent) -> &'static str {
    match event.kind {
        BoardEvent::ADDED => "appeared",
        BoardEvent::REMOVED => "vanished",
        BoardEvent::WRITER_ADDED => "writer came",
        BoardEvent::WRITER_REMOVED => "writer left",
        BoardEvent::READER_ADDED => "reader came",
        BoardEvent::READER_REMOVED => "reader left",
        _ => "unknown",
    }
}

/// The same code as another plugin, so that one can leave and the other stay.
pub struct Clerk;

#[module(stage = WorldState)]
impl Module for Clerk {
    type Io = ScribeIo;
    type Params = ScribeParams;
    type State = ();

    fn tick(state: &mut (), io: &ScribeIo, params: &ScribeParams, now: &Tick) -> Outcome {
        Scribe::tick(state, io, params, now)
    }
}

#[ports]
pub struct TruthIo {
    #[role("truth")]
    truth: Output<Number>,
}

/// A simulator.
pub struct Oracle;

#[module(stage = PreLoop)]
impl Module for Oracle {
    type Io = TruthIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &TruthIo, _: &(), _: &Tick) -> Outcome {
        io.truth.set(Number { value: 5.0 });
        Outcome::Ok
    }
}

#[ports]
pub struct RefereeIo {
    #[role("truth")]
    truth: Input<Number>,
}

/// The same code as a referee.
pub struct Referee;

#[module(stage = PostLoop)]
impl Module for Referee {
    type Io = (ScribeIo, RefereeIo);
    type Params = ScribeParams;
    type State = ();

    fn tick(state: &mut (), (io, own): &Self::Io, params: &ScribeParams, now: &Tick) -> Outcome {
        assert!(own.truth.get().is_none(), "it is not linked");
        Scribe::tick(state, io, params, now)
    }
}

fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Scribe>(),
        Plugin::linked::<Clerk>(),
        Plugin::linked::<Oracle>(),
        Plugin::linked::<Referee>(),
    ]
}

fn property(agent: &Agent, path: &str) -> Arc<Property> {
    agent.board().find(path).unwrap().0
}

#[test]
fn a_path_below_the_own_one_is_written_and_read_by_others() {
    let text = "[modules.clerk]\nparams.write = \"object/1\"\n\
                [modules.scribe]\nparams.read = \"/clerk/object/1\"\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 3);
    assert_eq!(number(&agent, "clerk/object/1/value"), 3.0);
    assert_eq!(number(&agent, "scribe/seen/value"), 3.0, "in the same cycle, as its stage comes later");
    assert_eq!(number(&agent, "scribe/seen/new"), 1.0);
    assert_eq!(number(&agent, "scribe/seen/sequence"), 3.0);
}

#[test]
fn inputs_are_constant_in_a_tick_and_new_once() {
    let text = "[modules.clerk]\nevery = \"40ms\"\nparams.write = \"object\"\n\
                [modules.scribe]\nparams.read = \"/clerk/object\"\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "scribe/seen/new"), 1.0);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "scribe/seen/new"), 0.0);
    assert_eq!(number(&agent, "scribe/seen/value"), 1.0);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "scribe/seen/new"), 1.0);
}

#[test]
fn missing_and_unwritten_properties_have_no_value() {
    let text = "[modules.scribe]\nparams.read = \"/clerk/object\"\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "scribe/seen/value"), -1.0);
    let text = "[modules.relay]\n[modules.scribe]\nparams.read = \"/relay/output\"\n";
    let mut agent = crate::aspects::agent(text, &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "scribe/seen/value"), -1.0);
}

#[test]
fn another_interface_is_refused() {
    let text = "[modules.clerk]\nparams.write_pair = \"object\"\n\
                [modules.scribe]\nparams = { read = \"/clerk/object\", write = \"/clerk/seen\" }\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 2);
    assert!(says(&agent, &log, "scribe", "/clerk/object is Pair"), "{:?}", log.lines());
    assert!(
        says(&agent, &log, "scribe", &format!("not {:016x}", Number::DESCRIPTOR.hash)),
        "{:?}",
        log.lines()
    );
    assert_eq!(number(&agent, "scribe/seen/value"), -1.0);
}

#[test]
fn one_path_does_not_change_its_interface() {
    let text = "[modules.scribe]\nparams = { write = \"object\", write_pair = \"object\" }\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 2);
    assert!(says(&agent, &log, "scribe", "write pair: /scribe/object is Number"), "{:?}", log.lines());
    assert_eq!(number(&agent, "scribe/object/value"), 2.0);
}

#[test]
fn no_module_writes_below_another() {
    for path in ["/clerk/object", "/clerk/deep/er/object", "/clerk/seen"] {
        let text = format!(
            "[modules.clerk]\n[modules.scribe]\nparams = {{ write = \"{path}\", read = \"{path}\" }}\n"
        );
        let (mut agent, log) = logged(&text, &plugins());
        steps(&mut agent, 2);
        assert!(says(&agent, &log, "scribe", "write: "), "{path}: {:?}", log.lines());
        assert!(says(&agent, &log, "scribe", "another module"), "{path}: {:?}", log.lines());
    }
}

#[test]
fn a_module_does_not_write_what_the_host_writes_or_its_outputs() {
    for path in ["seen", "state", "params", "enabled", "timing"] {
        let text = format!("[modules.scribe]\nparams.write = \"{path}\"\n");
        let (mut agent, log) = logged(&text, &plugins());
        steps(&mut agent, 2);
        assert!(says(&agent, &log, "scribe", "write: "), "{path}: {:?}", log.lines());
    }
}

#[test]
fn of_two_writers_of_a_path_the_second_is_refused() {
    let text = "[modules.clerk]\nparams.write = \"/shared/object\"\n\
                [modules.scribe]\nparams.write = \"/shared/object\"\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 3);
    assert!(!says(&agent, &log, "clerk", "write"), "{:?}", log.lines());
    assert!(says(&agent, &log, "scribe", "write: /shared/object"), "{:?}", log.lines());
    assert_eq!(number(&agent, "shared/object/value"), 3.0);
    assert_eq!(property(&agent, "shared/object").generation(), 1);
    // A repeated request after the first holder has left succeeds.
    agent.composer().unload("clerk").unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "shared/object/value"), 4.0);
}

#[test]
fn invalid_paths_and_patterns_are_refused() {
    let text = "[modules.scribe]\nparams = { list = \"a//b\", events = \"a//b\" }\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "list: "), "{:?}", log.lines());
    assert!(says(&agent, &log, "scribe", "events: "), "{:?}", log.lines());
    let text = "[modules.clerk]\nparams.write = \"object\"\n\
                [modules.scribe]\nparams.read = \"/clerk/object/value\"\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "read: /clerk/object/value is a field"), "{:?}", log.lines());
}

#[test]
fn ground_truth_is_read_by_referees_alone() {
    let text = "[modules.oracle]\n[modules.referee]\nparams.read = \"/oracle/truth\"\n\
                [modules.scribe]\nparams.read = \"/oracle/truth\"\n\
                [modules.clerk]\nparams.read = \"/referee/seen\"\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "referee/seen/value"), 5.0);
    assert_eq!(number(&agent, "scribe/seen/value"), -1.0);
    for (module, path) in [("scribe", "/oracle/truth"), ("clerk", "/referee/seen")] {
        let refused = format!("read: {path} is ground truth, which only referees read");
        assert!(says(&agent, &log, module, &refused), "{module}: {:?}", log.lines());
    }
}

#[test]
fn a_pattern_means_the_paths_of_that_interface() {
    let text = "[modules.clerk]\nparams = { write = \"object/1\", write_pair = \"object/2\" }\n\
                [modules.scribe]\nparams.list = \"*/object/*\"\n";
    let (mut agent, log) = logged(text, &plugins());
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "scribe/seen/listed"), 1.0);
    assert!(says(&agent, &log, "scribe", "paths: /clerk/object/1"), "{:?}", log.lines());
}

#[test]
fn events_report_properties_readers_and_writers() {
    let text = "[modules.clerk]\nevery = \"40ms\"\nparams.write = \"object\"\n\
                [modules.scribe]\nparams.events = \"/clerk/object\"\n";
    // The scribe comes first, so that it observes when the object appears.
    let text = text.replace("[modules.clerk]", "[modules.clerk]\nenabled = false");
    let (mut agent, log) = logged(&text, &plugins());
    steps(&mut agent, 1);
    agent.composer().enable("clerk", true).unwrap();
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "event: /clerk/object appeared"), "{:?}", log.lines());
    assert!(says(&agent, &log, "scribe", "event: /clerk/object writer came"), "{:?}", log.lines());
    let reader = property(&agent, "clerk/object").channel().unwrap().latest().unwrap();
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "event: /clerk/object reader came"), "{:?}", log.lines());
    drop(reader);
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "event: /clerk/object reader left"), "{:?}", log.lines());
    agent.composer().unload("clerk").unwrap();
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "scribe", "event: /clerk/object writer left"), "{:?}", log.lines());
    assert!(says(&agent, &log, "scribe", "event: /clerk/object vanished"), "{:?}", log.lines());
}

#[test]
fn a_path_that_is_given_to_another_property_is_read_afresh() {
    let text = "[modules.clerk]\n[modules.scribe]\nparams.read = \"/shared/object\"\n";
    let mut agent = agent(text, &plugins());
    let store = || slate_blackboard::Store {
        capacity: 0,
        depth: 1,
        budget: slate_blackboard::channel::Budget { latest: 4, queues: 1, window: 1 },
    };
    for value in [10.0, 20.0] {
        let board = agent.board();
        let property = board
            .add_channel("shared/object", "", Number::DESCRIPTOR, store(), slate_blackboard::Access::Output)
            .unwrap();
        let mut writer = property.channel().unwrap().writer().unwrap();
        let mut number = Number { value };
        writer.write(slate_blackboard::interface::View::of(&mut number).bytes(), 0, 0).unwrap();
        steps(&mut agent, 1);
        assert_eq!(crate::aspects::common::number(&agent, "scribe/seen/value"), value);
        assert_eq!(crate::aspects::common::number(&agent, "scribe/seen/alive"), 1.0);
        assert_eq!(property.readers(), 1);
        drop(writer);
        steps(&mut agent, 1);
        assert_eq!(crate::aspects::common::number(&agent, "scribe/seen/alive"), 0.0);
        agent.board().remove("shared/object").unwrap();
        steps(&mut agent, 1);
        assert_eq!(crate::aspects::common::number(&agent, "scribe/seen/value"), -1.0, "it has vanished");
        assert_eq!(property.readers(), 0, "and its handle was given back");
    }
}

#[test]
fn unload_closes_what_a_module_opened() {
    let text = "[modules.clerk]\nparams.write = \"/shared/object\"\n\
                [modules.scribe]\nparams = { read = \"/shared/object\", write = \"mine\" }\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    let (object, mine) = (property(&agent, "shared/object"), property(&agent, "scribe/mine"));
    assert_eq!((object.readers(), object.has_writer(), mine.has_writer()), (1, true, true));
    agent.composer().unload("scribe").unwrap();
    assert_eq!((object.readers(), mine.has_writer()), (0, false));
    assert!(agent.board().find("scribe/mine").is_err(), "nobody reads it");
    agent.composer().unload("clerk").unwrap();
    assert!(!object.has_writer());
    assert!(agent.board().find("shared/object").is_err());
    steps(&mut agent, 1);
}

#[test]
fn read_values_stay_after_unload_of_writer() {
    let text = "[modules.clerk]\nparams.write = \"/shared/object\"\n\
                [modules.scribe]\nparams.read = \"/shared/object\"\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    agent.composer().unload("clerk").unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "scribe/seen/value"), 2.0);
    assert_eq!(number(&agent, "scribe/seen/alive"), 0.0);
}

#[test]
fn a_tick_that_fails_writes_nothing() {
    for how in ["fail_at", "panic_at"] {
        let text = format!("[modules.scribe]\nparams = {{ write = \"object\", {how} = 3 }}\n");
        let mut agent = agent(&text, &plugins());
        steps(&mut agent, 3);
        assert_eq!(number(&agent, "scribe/object/value"), 2.0, "{how}");
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "scribe/object/value"), 4.0, "{how}");
        let reader = property(&agent, "scribe/object");
        assert_eq!(reader.generation(), 1, "{how}: the handle stays open");
    }
}

#[test]
fn every_value_reaches_a_queue_once() {
    let text = "[modules.scribe]\nparams.write = \"object\"\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 1);
    let channel = Arc::clone(property(&agent, "scribe/object").channel().unwrap());
    let mut queue = channel.queue(Policy::Skip, Start::Next).unwrap();
    for _ in 0..5 {
        steps(&mut agent, 1);
        assert_eq!(queue.pull(), Ok(1));
    }
}

#[test]
fn a_number_that_is_none_is_made_the_same_on_every_machine() {
    let text = "[modules.scribe]\nparams = { write = \"object\", nan_at = 2 }\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    let (bytes, _, _) = property(&agent, "scribe/object").newest().unwrap().unwrap();
    assert_eq!(bytes, f64::from_bits(0x7ff8_0000_0000_0000).to_ne_bytes());
}

#[test]
fn run_is_the_same_on_any_thread() {
    let run = |workers: usize| {
        let mut text = String::from("time.source = \"m0\"\n[modules.m0]\nkind = \"counter\"\n");
        for (name, other) in [("m1", "m2"), ("m2", "m3"), ("m3", "m1")] {
            text.push_str(&format!(
                "[modules.{name}]\nkind = \"scribe\"\n\
                 params = {{ write = \"object\", read = \"/{other}/object\", list = \"*/object\" }}\n\
                 [modules.{name}_dice]\nkind = \"dice\"\n"
            ));
        }
        let options = Options { workers, always_help: true, rate: Rate::Max, ..Options::default() };
        let mut agent = load(&text, &plugins(), options).unwrap();
        steps(&mut agent, 50);
        agent.digest().unwrap()
    };
    let alone = run(0);
    assert_eq!(run(1), alone);
    assert_eq!(run(2), alone);
}

#[test]
fn run_time_writes_are_part_of_the_digest() {
    let run = |nan_at: u64| {
        let text = format!("[modules.scribe]\nparams = {{ write = \"object\", nan_at = {nan_at} }}\n");
        let mut agent = agent(&text, &plugins());
        steps(&mut agent, 5);
        agent.digest().unwrap()
    };
    assert_eq!(run(3), run(3));
    assert_ne!(run(3), run(4));
}

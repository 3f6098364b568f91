//! Statements of a block, as its agent shows them.
#![allow(clippy::unwrap_used, missing_docs, reason = "a test")]

use slate_mapek::{FactTable, Statements};
use slate_module::Plugin;
use slate_module::blackboard::interface::Value;
use slate_module::prelude::*;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Options, Rate};

/// What a block is to say about the keys from 0.
#[interface]
#[derive(PartialEq)]
pub struct Say {
    /// How many of them it states something about.
    pub state: u32,
    /// How many of them it takes back.
    pub retract: u32,
    /// Whether the step fails in the end.
    pub fail: Bool,
}

#[interface]
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Room {
    pub warmth: f64,
}

/// How many were accepted of what was taken back.
#[interface]
pub struct Accepted {
    pub count: u64,
}

#[ports]
pub struct KeeperIo {
    say: Input<Say>,
    #[capacity(64)]
    found: Output<FactTable<Room>>,
    accepted: Output<Accepted>,
}

pub struct Keeper;

#[module(stage = Think)]
impl Module for Keeper {
    type Io = KeeperIo;
    type Params = ();
    type State = Statements<Room>;

    fn tick(own: &mut Statements<Room>, io: &KeeperIo, _: &(), now: &Tick) -> Outcome {
        let say = io.say.updated().copied().unwrap_or_default();
        for key in 0..say.state {
            assert!(own.state(now.now(), &key.to_string(), 1.0, Room { warmth: 20.0 }));
        }
        let accepted = (0..say.retract).filter(|key| own.retract(now.now(), &key.to_string())).count();
        io.accepted.set(Accepted { count: accepted as u64 });
        own.write(now.now(), &io.found);
        if say.fail.get() { Outcome::Failed } else { Outcome::Ok }
    }
}

/// An agent that makes ten steps a second.
fn agent() -> Agent {
    let text = "loop.period = \"100ms\"\ntime.source = \"keeper\"\n[modules.keeper]\n";
    let configuration = Configuration::from_text("test.toml", text, &Reading::default()).unwrap();
    let options = Options { rate: Rate::Max, ..Options::default() };
    Agent::load(&configuration, &[Plugin::linked::<Keeper>()], options).unwrap()
}

/// Makes a step in which that is said.
fn say(agent: &mut Agent, state: u32, retract: u32, fail: bool) {
    let number = |name: &str, number: u32| (name.to_owned(), Value::Integer(number.into()));
    let fail = ("fail".to_owned(), Value::Bool(fail));
    let say = Value::Table(vec![number("state", state), number("retract", retract), fail]);
    agent.board().write("keeper/say", &say, agent.now()).unwrap();
    steps(agent, 1);
}

fn steps(agent: &mut Agent, count: usize) {
    (0..count).for_each(|_| assert!(agent.step()));
}

/// The keys in the table, and how many of them are taken back.
fn found(agent: &Agent) -> (Vec<String>, usize) {
    let read = |path: String| agent.board().read(&path).unwrap().map(|(value, _)| value);
    let Some(Value::List(facts)) = read("keeper/found/facts".into()) else { return Default::default() };
    let head = |i: usize, field: &str| read(format!("keeper/found/facts/{i}/{field}")).unwrap();
    let keys = (0..facts.len()).map(|i| head(i, "key").as_str().unwrap_or_default().to_owned());
    let retracted = (0..facts.len()).filter(|i| head(*i, "retracted") == Value::Bool(true));
    (keys.collect(), retracted.count())
}

#[test]
fn facts_of_failed_step_are_written_again() {
    let mut agent = agent();
    say(&mut agent, 1, 0, true);
    assert_eq!(found(&agent).0.len(), 0, "what the step wrote is dropped");
    steps(&mut agent, 10);
    assert_eq!(found(&agent), (vec!["0".to_owned()], 0));
}

#[test]
fn retraction_is_kept_for_some_seconds() {
    let mut agent = agent();
    say(&mut agent, 50, 0, false);
    say(&mut agent, 0, 40, false);
    steps(&mut agent, 50);
    let (keys, retracted) = found(&agent);
    assert_eq!((keys.len(), retracted), (50, 40));
    steps(&mut agent, 60);
    let (keys, retracted) = found(&agent);
    assert_eq!((keys.len(), retracted), (10, 0));
}

#[test]
fn each_retraction_has_its_turn_where_there_is_little_room() {
    let mut agent = agent();
    // Two thousand of an earlier life, of which this block knows nothing.
    say(&mut agent, 0, 2000, false);
    assert_eq!(agent.board().read("keeper/accepted/count").unwrap().unwrap().0, Value::Integer(1024));
    let mut seen = slate_sorted::SortedSet::new();
    // As often as the forwarder polls.
    for _ in 0..90 {
        seen.extend(found(&agent).0);
        steps(&mut agent, 2);
    }
    assert_eq!(seen.len(), 1024);
    steps(&mut agent, 100);
    assert_eq!(found(&agent).0.len(), 0);
}

#[test]
fn a_table_with_other_statements_has_another_revision() {
    let revision = |facts: u32| {
        let mut agent = agent();
        say(&mut agent, facts, 0, false);
        agent.board().read("keeper/found/revision").unwrap().unwrap().0
    };
    assert_eq!(revision(1), revision(1));
    assert_ne!(revision(1), revision(2), "both are the first of their block");
}

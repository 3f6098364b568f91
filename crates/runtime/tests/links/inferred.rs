//! Links that need not be written, while modules of the same robot come and go.

use slate_mapek::prelude::*;
use slate_mapek::{analyze, driver_sensors, monitor, sensor};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::Change;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, NewLink, Options, Rate};

use crate::links::common::Number;
use crate::links::support::{all, steps};

driver_sensors! { Gauge("gauge", "Counts."): Number }

#[ports]
pub struct Sensors {
    number: Input<Number>,
}

macro_rules! monitors {
    ($($name:ident: $kind:literal),+) => {
        $(
            pub struct $name;

            impl Monitor for $name {
                const NAME: &'static str = $kind;
                type Sensors = Sensors;
                type Params = ();
                type State = ();
                type Value = Number;

                fn interpret((): &mut (), sensors: &Sensors, (): &(), _: &Tick) -> Option<Number> {
                    sensors.number.fresh().copied()
                }
            }
        )+
    };
}
monitors!(Front: "front", Back: "back");

#[ports]
pub struct ObservedNumber {
    number: Observed<Number>,
}

pub struct Passing;

impl Analyze for Passing {
    const NAME: &'static str = "passing";
    type Observed = ObservedNumber;
    type Params = ();
    type State = ();
    type Value = Number;

    fn process((): &mut (), observed: &ObservedNumber, (): &(), _: &Tick) -> Option<Number> {
        observed.number.updated().copied()
    }
}

/// An agent with one Monitor and an Analyze that reads it, as nothing else can be read; the plugin `back` has another one.
fn agent() -> Agent {
    agent_and_database().0
}

fn agent_and_database() -> (Agent, Database) {
    let text = "time.source = \"counter\"\n[modules.counter]\n[robots.r2.modules]\ngauge = {}\nfront = {}\nback = {}\n\
                passing = {}\n[robots.r2.links]\n\"gauge/source\" = \"/counter/number\"\n";
    let database = Database::from_text("test.toml", text, Reading::default()).unwrap();
    // Without it the start is refused, as both Monitors are there.
    database.set(&[("links.\"r2/passing/number\"", "false")]).unwrap();
    let blocks =
        [sensor::<Gauge>(), monitor::<Front>(), monitor::<Back>(), analyze::<Passing>()].map(Plugin::from);
    let plugins: Vec<_> = all().into_iter().chain(blocks).collect();
    let options = Options { rate: Rate::Max, ..Options::default() };
    let agent = Agent::load_with(&database, &plugins, options).unwrap();
    let composer = agent.composer();
    composer.unload("back").unwrap();
    database.take_back("").unwrap();
    composer.unload("passing").unwrap();
    composer.load("passing").unwrap();
    (agent, database)
}

/// Source of the Analyze, and whether it is unwritten.
fn source(agent: &Agent) -> Option<(String, bool)> {
    let links = agent.composer().links().into_iter();
    links.filter(|link| link.to == "r2/passing/number").map(|link| (link.from, link.inferred)).next()
}

fn read(agent: &mut Agent) -> Option<f64> {
    steps(agent, 2);
    let read = agent.board().read("r2/passing/change/value").unwrap();
    read.and_then(|(value, _)| value.as_f64())
}

#[test]
fn loading_another_module_changes_no_inferred_link() {
    let mut agent = agent();
    let front = Some(("/r2/front/percept".to_owned(), true));
    assert_eq!(source(&agent), front);
    assert!(read(&mut agent).is_some());
    let refused = format!("{:?}", agent.composer().load("back").unwrap_err());
    for part in ["`r2/passing/number` could read", "`r2/back/percept`", "`r2/front/percept`"] {
        assert!(refused.contains(part), "{part} in {refused}");
    }
    assert_eq!(source(&agent), front);
    assert!(agent.modules().iter().all(|module| module != "r2/back"));
    // With a link that is written there is nothing to choose.
    agent.composer().link(&NewLink::new("r2/passing/number", "/r2/front/percept")).unwrap();
    agent.composer().load("back").unwrap();
    assert_eq!(source(&agent), Some(("/r2/front/percept".to_owned(), false)));
    assert!(read(&mut agent).is_some());
}

#[test]
fn false_removes_an_inferred_link_while_the_agent_runs() {
    let agent = agent();
    let composer = agent.composer();
    assert!(source(&agent).is_some());
    composer.unlink("r2/passing/number").unwrap();
    assert_eq!(source(&agent), None);
    composer.unload("passing").unwrap();
    composer.load("passing").unwrap();
    assert_eq!(source(&agent), None, "also for a module that is loaded anew");
}

const INPUT: &str = "r2/passing/number";

fn front() -> Option<(String, bool)> {
    Some(("/r2/front/percept".to_owned(), true))
}

/// The changes as pairs of old and new values.
fn told(changes: &[Change]) -> Vec<(String, String)> {
    let text = |value: &Option<slate_runtime::configuration::Value>| {
        value.as_ref().map_or("none".to_owned(), ToString::to_string)
    };
    changes.iter().map(|change| (text(&change.before), text(&change.after))).collect()
}

fn pair(before: &str, after: &str) -> Vec<(String, String)> {
    vec![(before.to_owned(), after.to_owned())]
}

#[test]
fn revert_restores_the_inferred_link_that_held_before() {
    let (mut agent, database) = agent_and_database();
    let composer = agent.composer();
    let revert = || composer.commit(|| database.revert("")).unwrap();
    composer.unlink(INPUT).unwrap();
    assert_eq!(source(&agent), None);
    assert_eq!(told(&revert()), pair("false", "\"/r2/front/percept\""));
    assert_eq!(source(&agent), front());
    composer.link(&NewLink::new(INPUT, "/r2/front/percept")).unwrap();
    assert_eq!(source(&agent), Some(("/r2/front/percept".to_owned(), false)));
    assert_eq!(told(&revert()), pair("\"/r2/front/percept\"", "\"/r2/front/percept\""));
    assert_eq!(source(&agent), front());
    assert!(database.diff().is_empty());
    // Taken away is taken away, also where another one would be inferred.
    composer.link(&NewLink::new(INPUT, "/r2/front/percept")).unwrap();
    composer.unlink(INPUT).unwrap();
    assert_eq!(source(&agent), None);
    revert();
    assert!(read(&mut agent).is_some());
}

#[test]
fn revert_to_an_ambiguous_link_is_refused() {
    let (agent, database) = agent_and_database();
    agent.composer().unlink(INPUT).unwrap();
    agent.composer().load("back").unwrap();
    let refused = agent.composer().commit(|| database.revert("")).unwrap_err().to_string();
    for part in ["`r2/passing/number` could read", "`r2/back/percept`", "`r2/front/percept`"] {
        assert!(refused.contains(part), "{part} in {refused}");
    }
    assert_eq!(source(&agent), None);
    assert_eq!(database.diff().len(), 1);
}

#[test]
fn changes_of_an_inferred_link_tell_its_source() {
    let (agent, _database) = agent_and_database();
    let composer = agent.composer();
    let link = NewLink::new(INPUT, "/r2/front/percept");
    let linked = composer.check_link(&link).unwrap();
    assert_eq!(told(&linked), pair("\"/r2/front/percept\"", "\"/r2/front/percept\""));
    let unlinked = composer.check_unlink(INPUT).unwrap();
    assert_eq!(told(&unlinked), pair("\"/r2/front/percept\"", "false"));
    assert_eq!(source(&agent), front());
    assert_eq!(told(&composer.unlink(INPUT).unwrap()), pair("\"/r2/front/percept\"", "false"));
}

#[test]
fn snapshot_keeps_inferred_links_as_inferred() {
    let (mut agent, database) = agent_and_database();
    let composer = agent.composer();
    let snapshot = composer.snapshot().unwrap();
    composer.restore(&snapshot, Some(&database)).unwrap();
    assert!(database.diff().is_empty(), "{:?}", database.diff());
    database.take_back("").unwrap();
    assert_eq!(source(&agent), front());
    let resumed = snapshot.configuration(vec![]).unwrap();
    assert_eq!(resumed.current().links().len(), database.current().links().len(), "none is written");
    // Changes that were made since go, and the inferred link is back.
    for change in ["false", "{ from = \"/r2/front/percept\", every = 2 }"] {
        database.set(&[(format!("links.\"{INPUT}\""), change)]).unwrap();
        assert_ne!(source(&agent), front());
        let other = composer.snapshot().unwrap();
        composer.restore(&snapshot, Some(&database)).unwrap();
        assert_eq!(source(&agent), front());
        assert!(database.diff().is_empty(), "{:?}", database.diff());
        // And the other way round.
        composer.restore(&other, Some(&database)).unwrap();
        assert_ne!(source(&agent), front());
        assert!(!database.diff().is_empty());
        database.take_back("").unwrap();
        assert_eq!(source(&agent), front());
    }
    assert!(read(&mut agent).is_some());
}

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::Database;
use slate_runtime::snapshot::{Snapshot, SnapshotError};
use slate_runtime::{Agent, StartError};

use crate::snapshot::common::{Number, plugins};
use crate::snapshot::support::{ROBOT, file, options, robot, seen, steps};

fn snapshot() -> Snapshot {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 9);
    agent.composer().snapshot().unwrap()
}

/// Error of an agent that restores a snapshot which does not fit.
fn refused(mut agent: Agent) -> String {
    steps(&mut agent, 4);
    let before = seen(&mut agent);
    let error = agent.restore(&snapshot()).unwrap_err();
    assert_eq!(seen(&mut agent), before, "nothing is changed");
    steps(&mut agent, 4);
    error.to_string()
}

#[test]
fn mismatch_is_named() {
    for (what, with, words) in [
        ("agent.name = \"robot\"", "agent.name = \"other\"", "this is agent `other`"),
        ("[modules.dice]", "[modules.dice]\n[modules.more]\nkind = \"dice\"", "module `more` is not in it"),
        (
            "[modules.sender]",
            "[modules.sender]\nkind = \"dice\"",
            "module `sender` is a dice here and a sender in it",
        ),
        ("\"relay/input\" = \"counter/number\"", "\"relay/input\" = \"dice/number\"", "links.relay/input"),
        (
            "rate_limits = { value = 20.0 }",
            "",
            "actuators.wheel.rate_limits.value is not set here and 20.0 in it",
        ),
        (
            "time.source = \"counter\"",
            "time.source = \"counter\"\nagent.seed = 5",
            "agent.seed is 5 here and 0 in it: give it --set agent.seed=0",
        ),
    ] {
        assert!(ROBOT.contains(what), "{what}");
        let mut text = ROBOT.replace(what, with);
        if with.contains("sender]\nkind") {
            text = text.replace("\"receiver/notes\" = \"sender/note\"\n", "");
        }
        let agent =
            Agent::load(&crate::snapshot::common::configuration(&text), &plugins(), options()).unwrap();
        let said = refused(agent).replace(['"', '\''], "");
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[ports]
pub struct OtherIo {
    #[safe(Number { value: -1.0 })]
    number: Output<Number>,
}

/// A counter whose state is another one.
struct OtherCounter;

#[module(stage = SensorAcquire, name = "counter")]
impl Module for OtherCounter {
    type Io = OtherIo;
    type Params = crate::snapshot::common::CounterParams;
    type State = Option<String>;

    fn tick(
        _: &mut Option<String>,
        io: &OtherIo,
        _: &crate::snapshot::common::CounterParams,
        _: &Tick,
    ) -> Outcome {
        io.number.set(Number { value: 1.0 });
        Outcome::Ok
    }
}

fn with(counter: Option<Plugin>) -> Result<Agent, StartError> {
    let others = plugins().into_iter().filter(|plugin| plugin.name() != "counter");
    let database = Database::from_text("robot.toml", ROBOT, Default::default()).unwrap();
    Agent::load_with(&database, &others.chain(counter).collect::<Vec<_>>(), options())
}

#[test]
fn a_state_that_does_not_fit_leaves_all_as_it_was() {
    let agent = with(Some(Plugin::linked::<OtherCounter>())).unwrap();
    let said = refused(agent);
    assert!(said.contains("module `counter`") && said.contains("does not take its state"), "{said}");
}

#[test]
fn a_refused_load_touches_no_setting_and_no_link() {
    let agent = with(Some(Plugin::linked::<OtherCounter>())).unwrap();
    let (database, composer) = (agent.database().unwrap().clone(), agent.composer());
    let changes = [("modules.counter.params.nan_at", "22"), ("links.\"driver/input\"", "\"relay/output\"")];
    database.set(&changes).unwrap();
    // How old values are is measured in each step.
    let wiring =
        || composer.links().into_iter().map(|link| (link.to, link.from, link.options)).collect::<Vec<_>>();
    let (told, links) = (Arc::new(AtomicU32::new(0)), wiring());
    let count = Arc::clone(&told);
    let _subscription = database
        .subscribe("", move |_, _| {
            count.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
    let said = refused(agent);
    assert!(said.contains("does not take its state"), "{said}");
    assert_eq!(told.load(Ordering::Relaxed), 0, "nobody is told of a change");
    assert_eq!(wiring(), links);
    assert_eq!(database.get("modules.counter.params.nan_at").unwrap()[0].value.as_integer(), Some(22));
}

#[test]
fn snapshot_of_another_agent_is_one_error() {
    let text = ROBOT.replace("agent.name = \"robot\"", "agent.name = \"other\"");
    let text = text.replace("[modules.dice]", "[modules.dice]\nparams = {}\n[modules.more]\nkind = \"dice\"");
    let said = refused(robot(&text));
    assert_eq!(said, "the snapshot of agent `robot` does not fit: this is agent `other`");
}

#[test]
fn many_differences_have_a_line_each_up_to_a_limit() {
    let mut text = ROBOT.to_owned();
    for number in 0..30 {
        text += &format!("[modules.more{number}]\nkind = \"dice\"\n");
    }
    let agent = Agent::load(&crate::snapshot::common::configuration(&text), &plugins(), options()).unwrap();
    let error = agent.restore_under_own_settings(&snapshot()).unwrap_err().to_string();
    assert!(error.lines().count() <= 12 && error.lines().all(|line| line.len() < 200), "{error}");
    assert!(error.contains("module `more0` is not in it\n") && error.contains("more"), "{error}");
}

#[test]
fn two_that_write_one_file_never_spoil_it() {
    let snapshot = snapshot();
    let path = file("race");
    snapshot.write(&path).unwrap();
    let writing = std::sync::atomic::AtomicBool::new(true);
    std::thread::scope(|scope| {
        let write = || {
            for _ in 0..200 {
                if let Err(error) = snapshot.write(&path) {
                    let help = miette::Diagnostic::help(&error).unwrap().to_string();
                    assert!(help.contains("wait for it"), "{error}: {help}");
                }
            }
        };
        let writers: Vec<_> = (0..4).map(|_| scope.spawn(write)).collect();
        scope.spawn(|| {
            while writing.load(Ordering::Relaxed) {
                Snapshot::read(&path).unwrap();
            }
        });
        let ended: Vec<_> = writers.into_iter().map(|writer| writer.join()).collect();
        writing.store(false, Ordering::Relaxed);
        ended.into_iter().for_each(|ended| ended.unwrap());
    });
}

#[test]
fn another_version_of_a_plugin_is_named() {
    let agent = with(Some(Plugin::linked::<crate::snapshot::common::Counter>().version("7.0.0"))).unwrap();
    let said = refused(agent);
    assert!(said.contains("plugin `counter` has version 7.0.0 here"), "{said}");
}

#[test]
fn a_file_that_cannot_be_written_leaves_the_old_one() {
    let snapshot = snapshot();
    let missing = file("no").with_file_name("no-folder").join("a.snapshot");
    let error = snapshot.write(&missing).unwrap_err();
    assert!(matches!(&error, SnapshotError::File { file, .. } if *file == missing), "{error}");
    let path = file("full");
    snapshot.write(&path).unwrap();
    let before = std::fs::read(&path).unwrap();
    // The disk is full.
    let part = path.with_file_name("full.snapshot.part");
    std::os::unix::fs::symlink("/dev/full", &part).unwrap();
    let error = snapshot.write(&path).unwrap_err();
    let help = miette::Diagnostic::help(&error).unwrap().to_string();
    assert!(help.contains("make room"), "{error}: {help}");
    assert!(!part.exists(), "nothing is left of it");
    // Somebody else writes it.
    let other = std::fs::File::create(&part).unwrap();
    other.lock().unwrap();
    let error = snapshot.write(&path).unwrap_err();
    assert!(miette::Diagnostic::help(&error).unwrap().to_string().contains("wait for it"), "{error}");
    drop(other);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    snapshot.write(&path).unwrap();
    assert!(!part.exists());
}

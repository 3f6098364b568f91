//! Modules of libraries in snapshots.

use slate_module::Level;
use slate_runtime::configuration::Database;
use slate_runtime::log::MemoryTarget;
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Options, Rate};

use crate::fixtures::{Folder, libraries};
use crate::support::*;

fn load(database: &Database, log: &MemoryTarget) -> Agent {
    let log = Box::new(log.clone());
    let options = Options { rate: Rate::Max, armed: true, log: vec![log], ..Options::default() };
    Agent::load_with(database, &linked(), options).unwrap()
}

/// An agent as another process makes it of a snapshot, and the warnings in its log.
fn resumed(snapshot: &Snapshot) -> (Agent, Vec<String>) {
    let log = MemoryTarget::default();
    let agent = load(&snapshot.configuration(vec![]).unwrap(), &log);
    agent.restore(snapshot).unwrap();
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let warnings = lines.iter().filter(|line| line.level == Level::Warn).map(ToString::to_string).collect();
    (agent, warnings)
}

#[test]
fn libraries_resume_with_state_and_changed_code_is_reported() {
    let folder = Folder::new();
    let library = folder.copy(&plain());
    let text = format!("time.source = \"beat\"\n{}\n[modules.beat]\n", robot(&library));
    let database = Database::from_text("test.toml", &text, Default::default()).unwrap();
    let mut straight = load(&database, &MemoryTarget::default());
    step(&mut straight, 60);
    let mut first = load(&database, &MemoryTarget::default());
    step(&mut first, 30);
    let snapshot = first.composer().snapshot().unwrap();
    drop(first);

    let (mut second, warnings) = resumed(&snapshot);
    assert_eq!(warnings, Vec::<String>::new());
    step(&mut second, 30);
    assert_eq!(second.digest(), straight.digest());
    assert_eq!(number(&second, "counter/count/value"), 60);

    folder.copy(&libraries().counter("more"));
    let (mut third, warnings) = resumed(&snapshot);
    assert!(
        warnings.iter().any(|line| line.contains("plugin `counter` has other code than in the snapshot")),
        "{warnings:?}"
    );
    step(&mut third, 30);
    assert_eq!(number(&third, "counter/count/value"), 60);
    assert_eq!(number(&third, "counter/count/version"), 2);
}

use slate_runtime::configuration::{Database, Options};
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, NewLink};

use crate::common::plugins;
use crate::support::{ROBOT, file, options, steps};

/// What holds and is not what the files say: path, the file's value, the present one.
fn told(database: &Database) -> Vec<(String, Option<String>, Option<String>)> {
    let text = |value: Option<slate_runtime::configuration::Value>| value.map(|value| value.to_string());
    let all = database.diff().into_iter();
    all.map(|own| (own.path, text(own.file), text(own.present))).collect()
}

/// A snapshot of an agent whose configuration has all layers, in a file, and the database that it had.
fn frozen(name: &str) -> (Snapshot, Database) {
    let sets = vec!["modules.counter.params.panic_at=30".into(), "modules.receiver.every=200ms".into()];
    let how = Options { sets, ..Options::default() };
    let database = Database::from_text("robot.toml", ROBOT, how).unwrap();
    let mut agent = Agent::load_with(&database, &plugins(), options()).unwrap();
    steps(&mut agent, 5);
    database.set(&[("modules.counter.params.panic_at", "40"), ("modules.driver.enabled", "false")]).unwrap();
    agent.composer().link(&NewLink::new("relay/input", "dice/number")).unwrap();
    steps(&mut agent, 5);
    let file = file(name);
    agent.composer().save_snapshot(&file).unwrap();
    (Snapshot::read(&file).unwrap(), database)
}

#[test]
fn resume_keeps_layers_of_configuration() {
    let (snapshot, before) = frozen("layers");
    let database = snapshot.configuration(vec![]).unwrap();
    assert_eq!(told(&database), told(&before));
    assert!(told(&database).len() >= 3, "{:?}", told(&database));
    let mut agent = Agent::load_with(&database, &plugins(), options()).unwrap();
    agent.restore(&snapshot).unwrap();
    assert_eq!(told(&database), told(&before), "going on from it changes none");
    steps(&mut agent, 2);
    // What was changed is taken back to what the command line had set, and the file.
    database.take_back("").unwrap();
    let present = |path: &str| database.get(path).unwrap().first().map(|own| own.value.to_string());
    assert_eq!(present("modules.counter.params.panic_at").as_deref(), Some("30"));
    assert_eq!(present("modules.driver.enabled"), None);
    assert_eq!(present("links").as_deref(), present_of(&before, "links").as_deref());
    steps(&mut agent, 2);
}

fn present_of(before: &Database, path: &str) -> Option<String> {
    before.take_back("").unwrap();
    before.get(path).unwrap().first().map(|own| own.value.to_string())
}

#[test]
fn settings_of_resume_go_over_all_layers() {
    let (snapshot, _) = frozen("layers-sets");
    let database = snapshot.configuration(vec!["modules.counter.params.panic_at=50".into()]).unwrap();
    let present = |path: &str| database.get(path).unwrap().first().map(|own| own.value.to_string());
    assert_eq!(present("modules.counter.params.panic_at").as_deref(), Some("50"));
    assert_eq!(present("modules.driver.enabled").as_deref(), Some("false"), "the other changes stay");
    database.take_back("").unwrap();
    assert_eq!(present("modules.counter.params.panic_at").as_deref(), Some("50"));
}

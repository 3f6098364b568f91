use ciborium::Value as Cbor;
use slate_runtime::configuration::{Database, Options};
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, NewLink};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::support::{ROBOT, file, options, steps};
use crate::common::plugins;

/// Differences between the running configuration and its files: path, the file's value, the present one.
fn told(database: &Database) -> Vec<(String, Option<String>, Option<String>)> {
    let text = |value: Option<slate_runtime::configuration::Value>| value.map(|value| value.to_string());
    let all = database.diff().into_iter();
    all.map(|own| (own.path, text(own.file), text(own.present))).collect()
}

/// A snapshot of an agent whose configuration has all layers, in a file, and the database that it had.
fn saved(name: &str) -> (Snapshot, Database) {
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
    let (snapshot, before) = saved("layers");
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
    let (snapshot, _) = saved("layers-sets");
    let database = snapshot.configuration(vec!["modules.counter.params.panic_at=50".into()]).unwrap();
    let present = |path: &str| database.get(path).unwrap().first().map(|own| own.value.to_string());
    assert_eq!(present("modules.counter.params.panic_at").as_deref(), Some("50"));
    assert_eq!(present("modules.driver.enabled").as_deref(), Some("false"), "the other changes stay");
    database.take_back("").unwrap();
    assert_eq!(present("modules.counter.params.panic_at").as_deref(), Some("50"));
}

/// The value under a name of a CBOR map.
fn entry<'a>(map: &'a mut Cbor, name: &str) -> &'a mut Cbor {
    let entries = map.as_map_mut().unwrap().iter_mut();
    entries.into_iter().find(|(key, _)| key.as_text() == Some(name)).map(|(_, value)| value).unwrap()
}

fn cbor(value: &impl serde::Serialize) -> Vec<u8> {
    let mut bytes = Vec::new();
    ciborium::into_writer(value, &mut bytes).unwrap();
    bytes
}

#[test]
fn snapshot_without_layers_is_read_as_before() {
    let (_, before) = saved("layers-old");
    let file = file("layers-old");
    // As a version wrote it that knew the sum alone.
    let mut document: Cbor = ciborium::from_reader(&*std::fs::read(&file).unwrap()).unwrap();
    let mut image: Cbor =
        ciborium::from_reader(&**entry(&mut document, "image").as_bytes().unwrap()).unwrap();
    image.as_map_mut().unwrap().retain(|(key, _)| key.as_text() != Some("layers"));
    let image = cbor(&image);
    let head = cbor(&(1_u64, entry(&mut document, "head").clone()));
    let checksum = xxh3_64_with_seed(&image, xxh3_64_with_seed(&head, 0));
    *entry(&mut document, "image") = Cbor::Bytes(image);
    *entry(&mut document, "checksum") = checksum.into();
    std::fs::write(&file, cbor(&document)).unwrap();
    let snapshot = Snapshot::read(&file).unwrap();
    let database = snapshot.configuration(vec![]).unwrap();
    assert!(told(&database).is_empty(), "what was changed counts as what the files say");
    let values = |database: &Database| {
        let all = database.get("modules").unwrap().into_iter();
        all.map(|own| (own.path, own.value.to_string())).collect::<Vec<_>>()
    };
    assert_eq!(values(&database), values(&before));
    let mut agent = Agent::load_with(&database, &plugins(), options()).unwrap();
    agent.restore(&snapshot).unwrap();
    steps(&mut agent, 2);
}

//! A snapshot's file: a refused one leaves the agent unchanged.

use std::sync::{Mutex, OnceLock};

use ciborium::Value;
use slate_runtime::Agent;
use slate_runtime::snapshot::Snapshot;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// The agent of the target, which exactly one input at a time is sent to.
fn agent() -> &'static Mutex<Agent> {
    static AGENT: OnceLock<Mutex<Agent>> = OnceLock::new();
    AGENT.get_or_init(|| Mutex::new(crate::robot::robot()))
}

/// Reads a file of those bytes, raw and with the right checksum.
/// The agent continues from it.
pub fn run(bytes: &[u8]) {
    let file = crate::folder().join("robot.snapshot");
    for bytes in [Some(bytes.to_vec()), repaired(bytes)].into_iter().flatten() {
        std::fs::write(&file, &bytes).expect("there is room");
        let read = match Snapshot::read(&file) {
            Ok(read) => read,
            Err(error) => {
                assert!(error.to_string().contains("robot.snapshot"), "{error} names no file");
                continue;
            }
        };
        let agent = agent().lock().expect("nobody panics");
        let composer = agent.composer();
        let mark = crate::folder().join("mark.snapshot");
        let state = || {
            composer.save_snapshot(&mark).expect("there is room");
            std::fs::read(&mark).expect("it was just written")
        };
        let before = state();
        match composer.restore(&read, None) {
            Ok(()) => {
                // As it was, for the next input.
                std::fs::write(&mark, &before).expect("there is room");
                let first = Snapshot::read(&mark).expect("it was just written");
                composer.restore(&first, None).expect("it is of this agent");
            }
            Err(error) => {
                let _ = error.to_string();
                assert!(state() == before, "what was refused changed something: {error}");
            }
        }
    }
}

/// Returns the file with the right checksum; nothing without head or image.
fn repaired(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut document: Value = ciborium::from_reader(bytes).ok()?;
    let entries = document.as_map_mut()?;
    let find = |name: &str| entries.iter().position(|(key, _)| key.as_text() == Some(name));
    let (head, image, checksum) = (find("head")?, find("image")?, find("checksum")?);
    let mut marked = Vec::new();
    let version = Value::from(1_u64);
    ciborium::into_writer(&Value::Array(vec![version, entries[head].1.clone()]), &mut marked).ok()?;
    let seed = xxh3_64_with_seed(&marked, 0);
    entries[checksum].1 = Value::from(xxh3_64_with_seed(entries[image].1.as_bytes()?, seed));
    let mut whole = Vec::new();
    ciborium::into_writer(&document, &mut whole).ok()?;
    Some(whole)
}

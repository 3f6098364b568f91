//! State of modules that is kept from run to run.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use slate_runtime::memory::ModuleMemory;
use slate_runtime::{Agent, Options, Rate, StartError};

fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// An agent with a counter that remembers in a file, if it is one that keeps that.
fn agent(text: &str, keeps_memory: bool) -> Result<Agent, StartError> {
    let text = format!("time.source = \"counter\"\n[modules.counter]\n{text}");
    common::load(&text, &[], Options { rate: Rate::Max, keeps_memory, ..Options::default() })
}

fn in_file(file: &Path) -> String {
    format!("memory = {:?}\n", file.to_str().unwrap())
}

/// Counts so far, and returns where it came to and what was known of a memory at the start.
fn run(text: &str, cycles: usize, keeps_memory: bool) -> (f64, Option<u64>) {
    let mut agent = agent(text, keeps_memory).unwrap();
    let began = agent.memories().next().and_then(|(_, began)| began);
    (0..cycles).for_each(|_| assert!(agent.step()));
    let (value, _) = agent.board().read("counter/number/value").unwrap().unwrap();
    agent.remember().unwrap();
    (value.as_f64().unwrap(), began)
}

/// Reported reason why an agent does not start.
fn refusal(text: &str) -> String {
    match agent(text, true) {
        Err(StartError::Configuration(report)) => report.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_module_goes_on_where_the_run_before_has_ended() {
    let file = folder("goes_on").join("counter.memory");
    let text = in_file(&file);
    let (count, began) = run(&text, 3, true);
    assert_eq!((count, began), (3.0, None), "there was none");
    let first = std::fs::read(&file).unwrap();
    let (count, second) = run(&text, 2, true);
    assert_eq!(count, 5.0);
    let (count, third) = run(&text, 1, true);
    assert_eq!(count, 6.0);
    assert!(second.is_some() && third.is_some() && second != third, "each begins with another one");
    std::fs::write(&file, first).unwrap();
    assert_eq!(run(&text, 2, true), (5.0, second), "the same memory, the same run");
}

#[test]
fn without_a_memory_nothing_is_remembered() {
    assert_eq!(run("", 3, true), (3.0, None));
    assert_eq!(run("", 3, true), (3.0, None));
    let file = folder("reads").join("counter.memory");
    let text = in_file(&file);
    run(&text, 3, true);
    let before = std::fs::read(&file).unwrap();
    assert_eq!(run(&text, 2, false).0, 5.0, "who keeps nothing reads");
    assert_eq!(std::fs::read(&file).unwrap(), before, "and does not write");
}

#[test]
fn a_run_that_does_not_end_leaves_the_memory_as_it_was() {
    let file = folder("killed").join("counter.memory");
    let text = in_file(&file);
    run(&text, 3, true);
    let mut agent = agent(&text, true).unwrap();
    assert!(agent.step());
    drop(agent);
    assert_eq!(run(&text, 1, true).0, 4.0);
    let names = std::fs::read_dir(file.parent().unwrap()).unwrap().count();
    assert_eq!(names, 1, "nothing else is left");
}

#[test]
fn a_memory_is_that_of_one_run_at_a_time() {
    let file = folder("at_once").join("counter.memory");
    let text = in_file(&file);
    let _first = agent(&text, true).unwrap();
    let told = refusal(&text);
    assert!(told.contains("counter.memory") && told.contains("other run"), "{told}");
    let two = format!("{text}[modules.other]\nkind = \"counter\"\n{text}");
    drop(_first);
    let told = refusal(&two);
    assert!(told.contains("`other`") && told.contains("another run or module has it"), "{told}");
}

#[test]
fn a_name_of_a_memory_that_comes_later_is_that_memory() {
    let folder = folder("linked");
    let (file, link, second) =
        (folder.join("counter.memory"), folder.join("link.memory"), folder.join("second.memory"));
    std::os::unix::fs::symlink("counter.memory", &link).unwrap();
    std::os::unix::fs::symlink(&link, &second).unwrap();
    let first = agent(&in_file(&file), true).unwrap();
    for name in [&link, &second] {
        assert!(refusal(&in_file(name)).contains("another run"), "{name:?}");
    }
    drop(first);
    assert_eq!(run(&in_file(&second), 3, true), (3.0, None));
    assert!(link.is_symlink() && second.is_symlink() && file.is_file(), "names stay names");
    assert_eq!(run(&in_file(&file), 1, true).0, 4.0);
    std::fs::remove_file(&file).unwrap();
    std::os::unix::fs::symlink("counter.memory", &file).unwrap();
    assert!(agent(&in_file(&file), true).is_err(), "one that leads to itself is none");
}

#[test]
fn unusable_memory_starts_nothing_and_has_place() {
    let folder = folder("refused");
    let file = folder.join("counter.memory");
    let text = in_file(&file);
    run(&text, 3, true);
    let whole = std::fs::read(&file).unwrap();
    let refuse = |bytes: &[u8], words: &[&str]| {
        std::fs::write(&file, bytes).unwrap();
        let told = refusal(&text);
        for word in ["test.toml:3", "counter.memory", "`counter`"].iter().chain(words) {
            assert!(told.contains(word), "{word}: {told}");
        }
        assert_eq!(std::fs::read(&file).unwrap(), bytes, "it is left as it is");
    };
    refuse(&whole[..whole.len() - 1], &["ends too early", &format!("byte {}", whole.len() - 1)]);
    refuse(b"", &["ends too early, after byte 0"]);
    refuse(b"no memory", &["something else"]);
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 1;
    refuse(&damaged, &["checksum"]);
    let more = [&whole[..], b"x"].concat();
    refuse(&more, &[&format!("from byte {} on", whole.len())]);
    let own = ModuleMemory::from_bytes(&whole).unwrap();
    let others = ModuleMemory { kind: "relay".into(), ..own.clone() };
    refuse(&others.to_bytes().unwrap(), &["`relay`"]);
    let strange = ModuleMemory { state: vec![0x61, b'x'], ..own };
    refuse(&strange.to_bytes().unwrap(), &["restore its content"]);
    let nowhere = refusal(&in_file(&folder.join("nowhere/counter.memory")));
    assert!(nowhere.contains("folder that exists"), "{nowhere}");
}

#[test]
fn unwritable_memory_is_kept_and_reported() {
    let folder = folder("unwritten");
    let file = folder.join("inner/counter.memory");
    std::fs::create_dir(folder.join("inner")).unwrap();
    let mut agent = agent(&in_file(&file), true).unwrap();
    assert!(agent.step());
    std::fs::remove_dir_all(folder.join("inner")).unwrap();
    let error = agent.remember().unwrap_err();
    let (told, help) = (error.to_string(), miette::Diagnostic::help(&error).unwrap().to_string());
    assert!(told.contains("`counter`") && told.contains("counter.memory"), "{told}");
    assert!(help.contains("folder that exists"), "{help}");
}

proptest! {
    #[test]
    fn a_memory_comes_back_as_it_was_written(kind in ".{0,40}", state in prop::collection::vec(any::<u8>(), 0..300)) {
        let memory = ModuleMemory { kind, state };
        let bytes = memory.to_bytes().unwrap();
        prop_assert_eq!(ModuleMemory::from_bytes(&bytes), Ok(memory));
    }

    #[test]
    fn any_other_byte_is_seen(
        kind in "[a-z_]{0,40}",
        state in prop::collection::vec(any::<u8>(), 0..300),
        at in any::<prop::sample::Index>(),
        change in 1..=255_u8,
    ) {
        let bytes = ModuleMemory { kind, state }.to_bytes().unwrap();
        let mut other = bytes.clone();
        *at.get_mut(&mut other) ^= change;
        prop_assert!(ModuleMemory::from_bytes(&other).is_err());
        prop_assert!(ModuleMemory::from_bytes(&bytes[..at.index(bytes.len())]).is_err());
    }

    #[test]
    fn other_file_content_is_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(ModuleMemory::from_bytes(&bytes).is_err());
    }
}

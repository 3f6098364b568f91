//! Every target keeps its promises for its corpus, and for random edits of it.
//! The edits are the same in each run; `fuzz/run` finds others by the coverage of the code.

use std::cell::RefCell;
use std::fs;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

/// Edited inputs for each target.
const CASES: u32 = 512;

/// Far longer than any input takes, on a machine that is busy with something else.
const LONGEST: Duration = Duration::from_secs(5);

/// As the targets count what the whole process allocates, one runs at a time.
static TURN: Mutex<()> = Mutex::new(());

/// Change of an input. Places are parts of its length, so that they fit whatever the others have done.
#[derive(Clone, Debug)]
enum Edit {
    Byte {
        place: f64,
        byte: u8,
    },
    Insert {
        place: f64,
        bytes: Vec<u8>,
    },
    Remove {
        place: f64,
        count: usize,
    },
    Repeat {
        place: f64,
        count: usize,
    },
    CutOff {
        place: f64,
    },
    /// Goes on as another input of the corpus.
    Join {
        place: f64,
        other: usize,
    },
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let place = || 0.0..1.0_f64;
    let edit = prop_oneof![
        4 => (place(), any::<u8>()).prop_map(|(place, byte)| Edit::Byte { place, byte }),
        2 => (place(), prop_oneof![Just(0), Just(0xff), Just(0x7f)]).prop_map(|(place, byte)| Edit::Byte { place, byte }),
        2 => (place(), prop::collection::vec(any::<u8>(), 1..9)).prop_map(|(place, bytes)| Edit::Insert { place, bytes }),
        2 => (place(), 1..9_usize).prop_map(|(place, count)| Edit::Remove { place, count }),
        1 => (place(), 1..65_usize).prop_map(|(place, count)| Edit::Repeat { place, count }),
        1 => place().prop_map(|place| Edit::CutOff { place }),
        1 => (place(), any::<usize>()).prop_map(|(place, other)| Edit::Join { place, other }),
    ];
    prop::collection::vec(edit, 1..9)
}

fn apply(edit: &Edit, input: &mut Vec<u8>, corpus: &[Vec<u8>]) {
    let length = input.len();
    let at = |place: &f64| ((place * length as f64) as usize).min(length);
    match edit {
        Edit::Byte { place, byte } => {
            if let Some(found) = input.get_mut(at(place)) {
                *found = *byte;
            }
        }
        Edit::Insert { place, bytes } => drop(input.splice(at(place)..at(place), bytes.iter().copied())),
        Edit::Remove { place, count } => drop(input.drain(at(place)..length.min(at(place) + count))),
        Edit::Repeat { place, count } => input.extend_from_within(at(place)..length.min(at(place) + count)),
        Edit::CutOff { place } => input.truncate(at(place)),
        Edit::Join { place, other } => {
            let other = &corpus[other % corpus.len()];
            input.truncate(at(place));
            input.extend(&other[at(place).min(other.len())..]);
        }
    }
}

/// Ends the tests with the input that has taken too long: the target has promised never to hang.
fn watch(target: &'static str) -> Sender<Vec<u8>> {
    let (sender, inputs) = channel::<Vec<u8>>();
    std::thread::spawn(move || {
        let mut last = Vec::new();
        loop {
            match inputs.recv_timeout(LONGEST) {
                Ok(input) => last = input,
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {
                    eprintln!("{target} has hung for {LONGEST:?} with {last:02x?}");
                    std::process::abort();
                }
            }
        }
    });
    sender
}

fn check(target: &'static str, run: fn(&[u8])) {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let watchdog = watch(target);
    let run = |input: &[u8]| {
        watchdog.send(input.to_vec()).expect("it waits for inputs");
        run(input);
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<_> = fs::read_dir(folder.join("corpus").join(target))
        .expect("it has a corpus")
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    files.sort();
    let corpus: Vec<_> = files.iter().map(|file| fs::read(file).expect("it can be read")).collect();
    assert!(!corpus.is_empty(), "{target} has a corpus");
    for (file, input) in files.iter().zip(&corpus) {
        println!("{}", file.display());
        run(input);
    }
    let mut runner = TestRunner::new_with_rng(
        Config { cases: CASES, failure_persistence: None, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let last = RefCell::new(Vec::new());
    let checked = runner.run(&(any::<prop::sample::Index>(), edits()), |(file, edits)| {
        let mut input = file.get(&corpus).clone();
        for edit in &edits {
            apply(edit, &mut input, &corpus);
        }
        last.replace(input.clone());
        run(&input);
        Ok(())
    });
    if let Err(error) = checked {
        panic!("{target}: {error}\nlast input: {:02x?}", last.borrow());
    }
}

macro_rules! targets {
    ($($target:ident)*) => {
        $(
            #[test]
            fn $target() {
                check(stringify!($target), slate_fuzz::$target::run);
            }
        )*

        #[test]
        fn each_program_of_a_target_is_tested() {
            let mut programs: Vec<_> = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("targets"))
                .expect("it is there")
                .map(|entry| entry.expect("the folder can be read").file_name().into_string().expect("it is text"))
                .collect();
            programs.sort();
            assert_eq!(programs, [$(concat!(stringify!($target), ".rs")),*]);
        }
    };
}

targets! {
    bag behavior_tree configuration conversation definition drivers encoding golog idl interface knowledge knowledge_file
    logs map_file navigation_graph network outline peer petri_net shared_memory snapshot state tool
}

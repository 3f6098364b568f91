//! Recordings of runs that are killed at random moments: what was there stays, and is repaired to a whole file.
//!
//! Usage: `kill [--first SEED] [--kills N]`. A round that fails prints its seed.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and the moments are those of the wall clock"
)]

mod common;

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use common::Running;
use mcap::read::{ChunkFlattener, Options};
use mcap::records::Record;

/// Runs at a time; each mostly sleeps.
const WORKERS: usize = 3;

/// A message: its channel, number and time, and its bytes.
type Message = (u16, u32, u64, Vec<u8>);

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)?.parse::<u64>().ok()
    };
    // Listing or filtering finds no tests here.
    if arguments.iter().any(|argument| argument == "--list") {
        return;
    }
    let (first, kills) = (after("--first").unwrap_or(0), after("--kills").unwrap_or(10));
    let outcomes = std::thread::scope(|scope| {
        let of = |worker| (first + worker..first + kills).step_by(WORKERS).map(kill);
        let workers: Vec<_> =
            (0..WORKERS as u64).map(|worker| scope.spawn(move || of(worker).collect::<Vec<_>>())).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect::<Vec<_>>()
    });
    let sum = |(a, b, c), (d, e, f)| (a + d, b + e, c + f);
    let (acknowledged, there, lost) = outcomes.into_iter().fold((0, 0, 0), sum);
    println!(
        "{kills} kills: {acknowledged} messages were acknowledged, {there} are there, {lost} bytes were cut off"
    );
    assert!(kills < 5 || acknowledged > 0, "no run was killed late enough to say anything");
}

/// A number below `limit` that depends on the seed and the place alone.
fn random(seed: u64, place: u64, limit: u64) -> u64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(place);
    for _ in 0..3 {
        state = (state ^ state >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (state ^ state >> 29) % limit
}

/// Kills a run that records, and says how many messages were acknowledged, how many are there, and how many bytes belong to
/// none of them.
fn kill(seed: u64) -> (usize, usize, u64) {
    println!("seed {seed}");
    let running = Running::new(&format!("kill-{seed}"));
    let mode = if random(seed, 0, 2) == 0 { "staged" } else { "threaded" };
    let seed_text = seed.to_string();
    let mut arguments =
        vec!["run", "exp1", "--headless", "--seed", &seed_text, "--mode", mode, "--rate", "4"];
    arguments.extend(["--set", "record.enabled=true", "--set", "modules.referee.params.goal_tolerance=0.0"]);
    arguments.extend(["--out", "here"]);
    let mut command = running.command(&arguments);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let file = running.folder().join("here/run.mcap");
    if random(seed, 1, 8) > 0 {
        common::wait_for("the file begins", || std::fs::metadata(&file).is_ok_and(|file| file.len() > 0));
    }
    std::thread::sleep(Duration::from_micros(random(seed, 2, 1_500_000)));
    // A closed piece is handed to the system, so readers of the file see it: that is the acknowledgement.
    let before = std::fs::read(&file).unwrap_or_default();
    std::thread::sleep(Duration::from_micros(random(seed, 3, 20_000)));
    child.kill().unwrap();
    child.wait().unwrap();
    let after = std::fs::read(&file).unwrap_or_default();
    assert!(after.starts_with(&before), "what is written is never written again");
    if after.is_empty() {
        return (0, 0, 0);
    }
    let acknowledged = messages(&before);
    let said = running.done(&["bag", "repair", "here/run.mcap"]);
    let whole = running.done(&["bag", "verify", "here/run.mcap"]);
    assert!(whole.contains("is whole"), "{said}{whole}");
    let repaired = std::fs::read(&file).unwrap();
    let there = messages(&repaired);
    assert!(there.len() >= acknowledged.len(), "{} of {}: {said}", there.len(), acknowledged.len());
    for (place, (wanted, found)) in acknowledged.iter().zip(&there).enumerate() {
        assert_eq!((wanted.1, wanted.2, &wanted.3), (found.1, found.2, &found.3), "message {place}: {said}");
    }
    read_by_others(&file);
    let kept = messages(&after).len();
    assert_eq!(there.len(), kept, "all that is whole is there, and nothing else: {said}");
    (acknowledged.len(), there.len(), after.len() as u64 - end_of_pieces(&after))
}

/// Somebody else's library reads the file without being told that its end is missing.
fn read_by_others(file: &Path) {
    let file = std::fs::read(file).unwrap();
    let messages: Result<Vec<_>, _> = mcap::MessageStream::new(&file).unwrap().collect();
    let messages = messages.unwrap().len();
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, messages as u64);
}

/// The messages of a file that may end anywhere, as read by a foreign library.
fn messages(file: &[u8]) -> Vec<Message> {
    if file.len() < mcap::MAGIC.len() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for record in ChunkFlattener::new_with_options(file, Options::IgnoreEndMagic.into()).unwrap() {
        match record {
            Ok(Record::Message { header, data }) => {
                found.push((header.channel_id, header.sequence, header.log_time, data.into_owned()));
            }
            Ok(_) => {}
            Err(_) => break,
        }
    }
    found
}

/// Where the last whole record at the top of a file ends.
fn end_of_pieces(file: &[u8]) -> u64 {
    let mut end = mcap::MAGIC.len().min(file.len());
    while let Some((head, rest)) = file[end..].split_first_chunk::<9>() {
        let length = u64::from_le_bytes(head[1..].first_chunk().copied().unwrap());
        if length > rest.len() as u64 {
            break;
        }
        end += 9 + length as usize;
    }
    end as u64
}

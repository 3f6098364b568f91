//! Cost of a module and of a property when there are many.

use std::hint::black_box;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Interface;
use slate_blackboard::{Access, Board, Store};

use super::agents::{self, Number};
use crate::machine::{pin, unpin};
use crate::measure::{Contest, Effort, consume};
use crate::table::{Role, Table};

/// The word that makes this program a process of which the memory is looked at.
pub const PROCESS: &str = "@scale";

pub(super) const WORK: &str = "scale";

const MODULES: [usize; 4] = [10, 100, 1000, 5000];

const PROPERTIES: [usize; 4] = [100, 1000, 10_000, 100_000];

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    for count in MODULES {
        let mut agent = agents::lockstep(&agents::row(count), None);
        let mut contest = Contest::new(WORK, format!("a module in a cycle of {count} in a row"));
        let cycles = effort.count(1_000_000 / count).min(5000);
        contest.with("Slate", Role::Slate, move |samples| {
            for _ in 0..cycles {
                let start = Instant::now();
                assert!(agent.step());
                samples.add_mean(start.elapsed(), count as u32);
            }
        });
        contest.run(effort, table);
        process("modules", count, table);
    }
    for count in PROPERTIES {
        let board = board(count);
        let channels = (0..count).filter_map(|i| board.find(&path(i)).ok()?.0.channel()?.writer().ok());
        let mut writers: Vec<_> = channels.collect();
        let mut contest = Contest::new(WORK, format!("a property of {count} written"));
        let bursts = effort.count(1_000_000 / count).clamp(1, 1000);
        contest.with("Slate", Role::Slate, move |samples| {
            for _ in 0..bursts {
                let start = Instant::now();
                writers.iter_mut().for_each(|writer| consume(writer.write(&[1; 8], 0, 0)));
                samples.add_mean(start.elapsed(), count as u32);
            }
        });
        contest.run(effort, table);
        let mut contest = Contest::new(WORK, format!("a property of {count} found by its path"));
        let paths: Vec<_> = (0..count).step_by(count / 100).map(path).collect();
        contest.with("Slate", Role::Slate, move |samples| {
            for _ in 0..effort.count(1000) {
                samples.burst(paths.len() as u32, |i| consume(board.find(&paths[i as usize])));
            }
        });
        contest.run(effort, table);
        process("properties", count, table);
    }
    unpin();
    super::least::run(effort, table);
}

fn path(number: usize) -> String {
    format!("p{number}/value")
}

fn board(count: usize) -> Arc<Board> {
    let board = Arc::new(Board::new("scale"));
    let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 2, queues: 0, window: 0 } };
    for number in 0..count {
        let added = board.add_channel(&path(number), "A number.", Number::DESCRIPTOR, store, Access::Output);
        assert!(added.is_ok(), "the path is new");
    }
    board
}

/// Starts a process that makes a number of them and reports time and memory.
fn process(what: &str, count: usize, table: &mut Table) {
    let program = std::env::current_exe().expect("a program knows where it is");
    let output = Command::new(program).args([PROCESS, what, &count.to_string()]).output();
    let text =
        String::from_utf8_lossy(&output.expect("this program can be started again").stdout).into_owned();
    let mut numbers = text.split_whitespace().filter_map(|number| number.parse::<f64>().ok());
    if let (Some(seconds), Some(bytes)) = (numbers.next(), numbers.next()) {
        let count_f = count as f64;
        table.figure(WORK, format!("{count} {what}: start, by each"), seconds * 1e6 / count_f, "us");
        table.figure(
            WORK,
            format!("{count} {what}: resident memory, by each"),
            bytes / count_f / 1024.0,
            "KiB",
        );
    }
}

/// The other process.
pub fn make(arguments: &[String]) {
    let [what, count] = arguments else { return };
    let count = count.parse().unwrap_or(0);
    let (before, start) = (resident("self"), Instant::now());
    if what == "modules" {
        let text = agents::row(count);
        let start = Instant::now();
        let mut agent = agents::lockstep(&text, None);
        black_box(agent.step());
        println!("{} {}", start.elapsed().as_secs_f64(), resident("self") - before);
    } else {
        let board = board(count);
        println!("{} {}", start.elapsed().as_secs_f64(), resident("self") - before);
        drop(board);
    }
}

/// Bytes of memory that a process has.
pub(super) fn resident(process: &str) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024.0
}

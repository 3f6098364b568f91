//! What a module and a property cost when there are many of them, and what the least agent costs.

use std::hint::black_box;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Interface;
use slate_blackboard::{Access, Board, Store};

use super::agents::{self, Number};
use crate::machine::pin;
use crate::measure::{Contest, Effort, consume};
use crate::table::{Role, Table};

/// The word that makes this program a process of which the memory is looked at.
pub const PROCESS: &str = "@scale";

const WORK: &str = "scale";

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
    crate::machine::unpin();
    if let Err(error) = minimal(effort, table) {
        table.absent(WORK, "the least agent", error);
    }
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

/// A process of this program that makes so many, and says how long that took and how much more memory it has then.
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
fn resident(process: &str) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024.0
}

/// Seconds of the processor that a process has used.
fn processor(process: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let fields = stat.rsplit_once(')').map(|(_, rest)| rest.split_whitespace().collect::<Vec<_>>());
    let ticks = fields
        .and_then(|fields| Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?));
    // SAFETY: a call without memory.
    ticks.unwrap_or(0.0) / unsafe { libc::sysconf(libc::_SC_CLK_TCK) } as f64
}

/// Builds the least agent, and looks at it.
fn minimal(effort: Effort, table: &mut Table) -> Result<(), String> {
    let folder = env!("CARGO_MANIFEST_DIR");
    let manifest = format!("{folder}/Cargo.toml");
    let mut build = Command::new("cargo");
    // With this program, so that what both need is not built again with fewer features.
    let packages = ["-p", "slate-bench", "-p", "slate-minimal"];
    build
        .args(["build", "--release", "--quiet", "--message-format=json", "--manifest-path", &manifest])
        .args(packages);
    let output = build.output().map_err(|error| format!("`cargo` does not start: {error}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let messages = String::from_utf8_lossy(&output.stdout).into_owned();
    let program = messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let mut program = program.filter(|message| message["target"]["name"] == "slate-minimal");
    let program = program.find_map(|message| message["executable"].as_str().map(str::to_owned));
    let program = program.ok_or("cargo names no program")?;
    let text = |error: std::io::Error| error.to_string();
    let size = std::fs::metadata(&program).map_err(text)?.len();
    table.figure(WORK, "the least agent: its file, with its symbols", size as f64 / 1048576.0, "MiB");
    let mut contest = Contest::new(WORK, "the least agent, until its first cycle is over");
    contest.with("Slate", Role::Slate, |samples| {
        for _ in 0..effort.count(30) {
            let start = Instant::now();
            let Ok(mut agent) = start_agent(&program) else { continue };
            samples.add_mean(start.elapsed(), 1);
            drop(agent.stdin.take());
            let _ = agent.wait();
        }
    });
    contest.run(effort, table);
    let mut agent = start_agent(&program).map_err(text)?;
    thread::sleep(Duration::from_secs(1));
    let before = processor(agent.id());
    let time = effort.time(Duration::from_secs(20));
    thread::sleep(time);
    let part = (processor(agent.id()) - before) / time.as_secs_f64();
    table.figure(WORK, "the least agent: processor at 100 Hz", part * 100.0, "% of a core");
    table.figure(
        WORK,
        "the least agent: resident memory",
        resident(&agent.id().to_string()) / 1048576.0,
        "MiB",
    );
    drop(agent.stdin.take());
    agent.wait().map(drop).map_err(text)
}

/// Waits until it runs.
fn start_agent(program: &str) -> std::io::Result<std::process::Child> {
    let mut agent = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    if let Some(output) = agent.stdout.as_mut() {
        BufReader::new(output).read_line(&mut String::new())?;
    }
    Ok(agent)
}

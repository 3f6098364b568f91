//! Least agent beside the least applications of Copper and dora with one node.
//! Measures building, starting and idling; each does nothing at 100 Hz.
//!
//! What is built is built alone in a folder of its own, so that it has nothing that others of the bench need.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use super::scale::{WORK, resident};
use crate::machine::{processor_time, provenance};
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

/// Built programs: name, role, folder and file.
const BUILT: [(&str, Role, &str, &str); 2] = [
    ("Slate", Role::Slate, "slate", "slate-minimal"),
    ("Copper (cu29)", Role::Peer, "copper", "copper-minimal"),
];

const DORA: &str = "dora, a node in Python";

/// Program that is started.
struct Least {
    name: &'static str,
    role: Role,
    program: PathBuf,
}

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut all = Vec::new();
    for (name, role, folder, program) in BUILT {
        match build(bench, name, folder, program, effort, table) {
            Ok(program) => all.push(Least { name, role, program }),
            Err(reason) => table.absent(WORK, name, reason),
        }
    }
    let dora = Least { name: DORA, role: Role::Peer, program: bench.join("peers/dora-least") };
    let first = dora.begin().map(|(_, took)| took);
    let mut contest = Contest::new(WORK, "the least agent, until its first cycle is over");
    for least in &all {
        contest.with(least.name, least.role, |samples| {
            (0..effort.count(30)).for_each(|_| least.sample(samples));
        });
    }
    match first {
        Ok(took) => {
            let mut turn = 0;
            // It takes seconds: once in each turn, and quickly once in all. What warmed up is the first.
            contest.with(dora.name, dora.role, |samples| {
                turn += 1;
                match turn {
                    1 => (),
                    2 if effort.quick => samples.add_mean(took, 1),
                    _ if effort.quick => (),
                    _ => dora.sample(samples),
                }
            });
            contest.run(effort, table);
            all.push(dora);
        }
        Err(reason) => {
            table.absent(WORK, dora.name, reason);
            contest.run(effort, table);
        }
    }
    be_there(&all, effort, table);
}

/// Builds a program, and says what that takes.
fn build(
    bench: &Path,
    name: &str,
    folder: &str,
    program: &str,
    effort: Effort,
    table: &mut Table,
) -> Result<PathBuf, String> {
    let text = |error: std::io::Error| error.to_string();
    let source = bench.join("minimal").join(folder);
    let target = bench.join("target/minimal").join(folder);
    let cargo = |words: &[&str]| -> Result<Duration, String> {
        let mut cargo = Command::new("cargo");
        cargo.args(words).arg("--manifest-path").arg(source.join("Cargo.toml"));
        let start = Instant::now();
        let output = cargo.env("CARGO_TARGET_DIR", &target).output();
        let output = output.map_err(|error| format!("`cargo` does not start: {error}"))?;
        let took = start.elapsed();
        if output.status.success() { Ok(took) } else { Err(complaint(&output.stderr)) }
    };
    // What comes from elsewhere is there before the clock runs.
    cargo(&["fetch"])?;
    let note = target.join("built");
    if !effort.quick || !note.is_file() {
        if target.exists() {
            std::fs::remove_dir_all(&target).map_err(text)?;
        }
        let took = cargo(&["build", "--release"])?.as_secs_f64();
        std::fs::write(&note, format!("{took}\n{}", provenance())).map_err(text)?;
    }
    let mut figure = |what: &str, value, unit| table.figure(WORK, what_of(name, what), value, unit);
    cargo(&["build", "--release"])?;
    let main = File::options().append(true).open(source.join("src/main.rs"));
    main.and_then(|main| main.set_modified(SystemTime::now())).map_err(text)?;
    figure("built again when its own code changed", cargo(&["build", "--release"])?.as_secs_f64(), "s");
    let program = target.join("release").join(program);
    let size = |path: &Path| std::fs::metadata(path).map(|data| data.len() as f64 / 1048576.0).map_err(text);
    figure("its file, with its symbols", size(&program)?, "MiB");
    let stripped = target.join("stripped");
    let strip = Command::new("strip").arg("-o").args([&stripped, &program]).status();
    if strip.is_ok_and(|status| status.success()) {
        figure("its file, stripped", size(&stripped)?, "MiB");
    }
    // Quickly, what was noted when it was last built from nothing.
    let noted = std::fs::read_to_string(&note).map_err(text)?;
    if let Some((took, when)) = noted.split_once('\n')
        && let Ok(took) = took.parse()
    {
        table.figure_from(WORK, what_of(name, "built from nothing"), took, "s", when);
    }
    Ok(program)
}

fn what_of(name: &str, what: &str) -> String {
    format!("the least agent, {name}: {what}")
}

/// Returns the error message of a program, in one line.
fn complaint(error: &[u8]) -> String {
    String::from_utf8_lossy(error).trim().replace('\n', "; ")
}

/// A program that runs. It ends when its input is closed.
struct Running {
    child: Child,
    /// The first process of those that are looked at.
    process: u32,
}

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

impl Least {
    /// Starts it, and waits until it says that its first cycle is over.
    fn begin(&self) -> Result<(Running, Duration), String> {
        let mut command = Command::new(&self.program);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let start = Instant::now();
        let child = command.spawn().map_err(|error| format!("{}: {error}", self.program.display()))?;
        let mut running = Running { process: child.id(), child };
        let mut line = String::new();
        if let Some(output) = running.child.stdout.as_mut() {
            BufReader::new(output).read_line(&mut line).map_err(|error| error.to_string())?;
        }
        let took = start.elapsed();
        if line.is_empty() {
            let mut error = Vec::new();
            if let Some(mut output) = running.child.stderr.take() {
                let _ = std::io::Read::read_to_end(&mut output, &mut error);
            }
            return Err(complaint(&error));
        }
        // A process that a script started names its executable.
        running.process = line.trim().parse().unwrap_or(running.process);
        Ok((running, took))
    }

    fn sample(&self, samples: &mut Samples) {
        match self.begin() {
            Ok((_, took)) => samples.add_mean(took, 1),
            Err(reason) => eprintln!("{}: a turn is missing: {reason}", self.name),
        }
    }
}

/// Lets all be there for the same while, and looks at what that takes.
fn be_there(all: &[Least], effort: Effort, table: &mut Table) {
    let mut running = Vec::new();
    for least in all {
        match least.begin() {
            Ok((begun, _)) => running.push((least.name, begun)),
            Err(reason) => table.absent(WORK, least.name, reason),
        }
    }
    thread::sleep(Duration::from_secs(1));
    let used = |running: &Running| family(running.process).into_iter().map(processor_time).sum::<f64>();
    let before: Vec<_> = running.iter().map(|(_, running)| used(running)).collect();
    let start = Instant::now();
    thread::sleep(effort.time(Duration::from_secs(20)));
    let time = start.elapsed().as_secs_f64();
    for ((name, running), before) in running.iter().zip(before) {
        let part = (used(running) - before) / time;
        table.figure(WORK, what_of(name, "processor at 100 Hz"), part * 100.0, "% of a core");
        let memory: f64 = family(running.process).iter().map(|process| resident(&process.to_string())).sum();
        table.figure(WORK, what_of(name, "resident memory"), memory / 1048576.0, "MiB");
    }
}

/// A process, and all that came of it.
fn family(first: u32) -> Vec<u32> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let processes = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let parents: Vec<_> = processes.filter_map(|process| Some((process, parent(process)?))).collect();
    let mut family = vec![first];
    let mut place = 0;
    while let Some(parent) = family.get(place).copied() {
        family.extend(parents.iter().filter(|(_, its)| *its == parent).map(|(process, _)| *process));
        place += 1;
    }
    family
}

fn parent(process: u32) -> Option<u32> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
}

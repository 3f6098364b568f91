//! Many runs of an application, on all cores.

mod ending;
mod progress;

use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;

use clap::Args;
use clap_complete::ArgValueCompleter;
use slate::report::{Batch, Outcome, Summary};
use slate::runtime::Rate;
use slate_run::{ApplicationOptions, Folder, MAXIMUM_SEED, MissionOptions, MissionRun, ModeName, RunError};
use slate_sorted::SortedMap;

use crate::complete;
use crate::examples;
use crate::failure::Failure;
use crate::{number, output};
use ending::BatchEnding;
use progress::BatchProgress;

#[derive(Debug, Args)]
pub struct BatchOptions {
    /// Example or configuration file
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: String,

    #[command(flatten)]
    pub common: ApplicationOptions,

    /// Number of runs
    #[arg(long, default_value_t = 20, value_parser = number::whole::<u64>(1, u64::MAX))]
    pub runs: u64,

    /// Seed of the first run; the next run has the next seed
    #[arg(long, default_value_t = 1, value_parser = number::whole::<u64>(0, MAXIMUM_SEED))]
    pub seed: u64,

    /// Number of parallel runs; the results do not depend on it
    /// [default: number of cores; 1 in threaded mode]
    #[arg(long, value_parser = number::whole::<u16>(1, 1024))]
    pub jobs: Option<u16>,

    /// Folder of the statistics:
    /// `batch.txt` as printed, `batch.json` as with `--json`,
    /// and `batch.jsonl` with the summary of each run in a line
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Runs many seeds; true when all were run and succeeded.
pub fn batch(options: &BatchOptions) -> Result<bool, Failure> {
    // Before the first run, so that no work is lost.
    let last = options.seed.checked_add(options.runs - 1);
    if last.is_none_or(|last| last > MAXIMUM_SEED) {
        return Err(Failure::Seeds);
    }
    let folder = options.out.as_deref().map(Folder::take).transpose()?;
    let ending = BatchEnding::on_interrupt();
    let queue = SeedQueue { options, sets: sets(options)?, begun: AtomicU64::new(0), ending: &ending };
    let summaries = all(&queue)?;
    if ending.is_interrupted() {
        eprintln!("interrupted: {} of {} runs are done", summaries.len(), options.runs);
    }
    let batch = Batch::of(&summaries).out_of(options.runs);
    output::line(&batch);
    if let Some(folder) = folder {
        write(&folder, &batch, &summaries)?;
    }
    if options.common.json {
        output::document("slate.batch/1", &batch);
    }
    Ok(summaries.len() as u64 == options.runs && summaries.iter().all(Summary::succeeded))
}

/// Writes the statistics into a folder.
fn write(folder: &Folder, batch: &Batch, summaries: &[Summary]) -> Result<(), RunError> {
    let figures = output::named("slate.batch/1", batch).map(|figures| format!("{figures}\n"));
    let number = keep_earlier(&folder.path)?;
    let write = |name: &str, text: std::io::Result<String>| {
        let path = folder.path.join(name);
        let written = text.and_then(|text| std::fs::write(&path, text));
        written.map_err(|source| RunError::File { path, source })
    };
    write("batch.txt", Ok(batch.to_string()))?;
    write("batch.json", figures.map_err(Into::into))?;
    let line = |summary| serde_json::to_string(summary).map(|line| format!("{line}\n"));
    write("batch.jsonl", summaries.iter().map(line).collect::<Result<_, _>>().map_err(Into::into))?;
    if let Some(number) = number {
        let earlier = folder.path.join(format!("batch-{number}.json"));
        eprintln!("the statistics that were there before: {}", slate::runtime::printable(&earlier));
    }
    Ok(())
}

/// Renames existing statistics in a folder with the next free number; returns it.
/// Such as `batch-1.json`, as recordings do.
fn keep_earlier(folder: &Path) -> Result<Option<u64>, RunError> {
    const STATISTICS_EXTENSIONS: [&str; 3] = ["txt", "json", "jsonl"];
    let is_there = |name: String| folder.join(name).exists();
    if !STATISTICS_EXTENSIONS.iter().any(|file| is_there(format!("batch.{file}"))) {
        return Ok(None);
    }
    let is_taken =
        |number: &u64| STATISTICS_EXTENSIONS.iter().any(|file| is_there(format!("batch-{number}.{file}")));
    let number = (1..).find(|number| !is_taken(number)).unwrap_or(u64::MAX);
    for file in STATISTICS_EXTENSIONS {
        let path = folder.join(format!("batch.{file}"));
        match std::fs::rename(&path, folder.join(format!("batch-{number}.{file}"))) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(RunError::File { path, source });
            }
            _ => {}
        }
    }
    Ok(Some(number))
}

/// Time after which a step counts as hung, unless set otherwise, s.
/// A batch loads the machine by itself, and the limit is of the wall clock.
const HANG_LIMIT: u64 = 60;

/// Returns the settings of all runs; the later one of two applies.
fn sets(options: &BatchOptions) -> Result<Vec<String>, Failure> {
    let BatchOptions { name, common, .. } = options;
    let application = examples::find(name, None, Vec::new(), common.set.clone(), common.host.as_deref())?;
    let is_raised = application.configuration.hang().value < HANG_LIMIT * 1_000_000_000;
    let raised = is_raised.then(|| format!("loop.hang={HANG_LIMIT}s"));
    Ok(raised.into_iter().chain(common.set.iter().cloned()).collect())
}

/// Makes the runs, and returns their summaries in the order of their seeds.
fn all(queue: &SeedQueue<'_>) -> Result<Vec<Summary>, Failure> {
    let mut progress = BatchProgress::new(queue.options.runs);
    let mut summaries = SortedMap::new();
    let mut failures = SortedMap::new();
    thread::scope(|scope| {
        let (sender, results) = channel();
        for _ in 0..jobs(queue.options) {
            let sender = sender.clone();
            scope.spawn(move || queue.work(&sender));
        }
        // The channel closes when the last of the threads has no more seeds.
        drop(sender);
        loop {
            match results.recv_timeout(progress::CHECK_PERIOD) {
                Ok((seed, Ok(summary))) => {
                    progress.note(&summary);
                    summaries.insert(seed, summary);
                }
                Ok((seed, Err(failure))) => {
                    failures.insert(seed, failure);
                }
                Err(RecvTimeoutError::Timeout) => progress.show(),
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
    });
    drop(progress);
    // An error of one run mostly concerns all; it is reported once.
    if let Some((seed, failure)) = failures.pop_first() {
        if seed > queue.options.seed {
            eprintln!("seed {seed} can't be run");
        }
        return Err(failure);
    }
    Ok(summaries.into_values().collect())
}

/// Returns the number of parallel runs; the default is the number of cores.
/// Threads at the pace of the wall clock would miss their deadlines beside others.
fn jobs(options: &BatchOptions) -> u64 {
    let default = || match options.common.mode {
        ModeName::Threaded => 1,
        ModeName::Staged => {
            let cores = thread::available_parallelism().map_or(1, NonZero::get) as u64;
            cores.div_ceil(1 + u64::from(options.common.workers))
        }
    };
    options.jobs.map_or_else(default, u64::from).min(options.runs)
}

/// Seeds, which threads take one by one.
struct SeedQueue<'a> {
    options: &'a BatchOptions,
    sets: Vec<String>,
    /// Number of seeds taken.
    begun: AtomicU64,
    ending: &'a Arc<BatchEnding>,
}

impl SeedQueue<'_> {
    /// Makes runs in sequence until no seed is left, or a run is impossible.
    fn work(&self, results: &Sender<(u64, Result<Summary, Failure>)>) {
        while !self.ending.is_ended() {
            let taken = self.begun.fetch_add(1, Ordering::Relaxed);
            if taken >= self.options.runs {
                return;
            }
            let seed = self.options.seed + taken;
            let result = self.run(seed);
            if result.is_err() {
                self.ending.end();
            }
            // The reader stays until all writers are gone.
            let Some(result) = result.transpose() else { return };
            let _ = results.send((seed, result));
        }
    }

    /// Runs one seed; `None` when the run was cut off.
    fn run(&self, seed: u64) -> Result<Option<Summary>, Failure> {
        let BatchOptions { name, common, .. } = self.options;
        let rate = if common.mode == ModeName::Threaded { Rate::REALTIME } else { Rate::Max };
        // A line of the log would not name its run.
        let defaults = vec!["log.targets.console=false".into()];
        let mut sets = self.sets.clone();
        sets.push(format!("agent.seed={seed}"));
        let application = examples::find(name, None, defaults, sets, common.host.as_deref())?;
        // On the wall clock every run would be a real one, of robots or with others, and they would be at once.
        if application.configuration.time_source().is_none() {
            return Err(Failure::BatchOnWallClock { name: name.clone() });
        }
        if application.configuration.mission().is_none() {
            return Err(Failure::BatchWithoutMission { name: name.clone() });
        }
        let options = MissionOptions {
            mode: common.mode,
            rate,
            workers: common.workers.into(),
            log: Vec::new(),
            trajectory: false,
            follows: false,
            disarmed: false,
        };
        let mission = MissionRun::load(application, options)?;
        self.ending.add(seed, mission.agent.stopper());
        let finished = mission.run();
        self.ending.remove(seed);
        let summary = finished?.summary;
        let is_cut_off = self.ending.is_ended() && summary.outcome == Outcome::Stopped;
        Ok((!is_cut_off).then_some(summary))
    }
}

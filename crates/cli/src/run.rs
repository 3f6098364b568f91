use std::io::IsTerminal;
use std::path::Path;

use slate::control::Server;
use slate::record::{Recorded, Report};
use slate::runtime::Rate;
use slate::runtime::log::LogTarget;
use slate::runtime::snapshot::Snapshot;

use crate::arguments::{ModeName, RunOptions};
use crate::browse;
use crate::console;
use crate::deployment::{self, Tether};
use crate::display::{Display, Lines};
use crate::examples;
use crate::failure::Failure;
use crate::folder::ReportFolder;
use crate::mission::{How, Mission};
use crate::output;
use crate::stay::{Interrupt, stay};

/// Runs an application once, or all the agents of a file; returns what the process ends with.
pub fn run(options: &RunOptions) -> Result<u8, Failure> {
    let agents = match &options.name {
        Some(name) => examples::agents(name, options.common.host.as_deref())?,
        None => Vec::new(),
    };
    if options.agent.is_none() && !agents.is_empty() {
        return deployment::run(options, &agents);
    }
    warn_of_little_memory();
    let mut tether = options.supervised.then(Tether::new).transpose()?;
    let mut sets = options.common.set.clone();
    if let Some(seed) = options.seed {
        sets.push(format!("agent.seed={seed}"));
    }
    let live = !options.headless;
    // A live display owns the terminal, so it shows the log too, which is also written beside the report.
    let owns_terminal = live && std::io::stdout().is_terminal();
    let defaults = vec![format!("log.targets.console={}", !owns_terminal)];
    let snapshot = options.resume.as_ref().map(Snapshot::read).transpose()?;
    let application = match (&options.name, &snapshot) {
        // The snapshot has what suited the terminal of the other run.
        (None, Some(snapshot)) => examples::of(snapshot, [defaults, sets].concat())?,
        (name, _) => {
            let name = name.as_deref().unwrap_or_default();
            let (agent, host) = (options.agent.as_deref(), options.common.host.as_deref());
            examples::find(name, agent, defaults, sets, host)?
        }
    };
    let is_driven = application.configuration.time_source().is_some();
    if !is_driven && options.rate.is_some_and(|rate| rate != Rate::REALTIME) {
        return Err(Failure::WallClock);
    }
    // Nobody watches a headless run, so it need not go at the pace of the wall clock unless that, its threads, or other
    // agents are what it runs with.
    let is_threaded = options.common.mode == ModeName::Threaded;
    let needs_wall_clock = live || is_threaded || !is_driven || !agents.is_empty();
    let default = if needs_wall_clock { Rate::REALTIME } else { Rate::Max };
    let name = application.name.clone();
    let seed = application.configuration.seed().value;
    let log_lines = Lines::default();
    let log: Option<Box<dyn LogTarget>> = owns_terminal.then(|| Box::new(log_lines.clone()) as _);
    let how = How {
        mode: options.common.mode,
        rate: options.rate.unwrap_or(default),
        workers: options.common.workers.into(),
        log: log.into_iter().collect(),
        trajectory: true,
        follows: true,
        disarmed: options.disarmed,
    };
    let judge = application.configuration.mission().map(|mission| mission.outcome.agent().map(str::to_owned));
    let wish = console::Wish::of(&application.configuration)?;
    let mut mission = Mission::load(application, how)?;
    for end in mission.agent.composer().loose_ends() {
        eprintln!("warning: {}", slate::runtime::configuration::Report::from(vec![end]));
    }
    if let Some(snapshot) = &snapshot {
        mission.resume(snapshot)?;
    }
    drop(snapshot);
    let supervised = options.supervised;
    let interrupt = Interrupt::handle(mission.agent.stopper(), supervised);
    if let Some(tether) = &mut tether
        && !tether.wait()
    {
        // Another agent can't start, which is said; so none does.
        return Ok(0);
    }
    // A robot that `slate stop` does not find does not start.
    let server = Server::open(&mission.agent).map_err(Failure::Unreachable)?;
    // Only now, as a configuration that is refused leaves nothing behind.
    let place = ReportFolder::of(options, &name, seed, mission.keeps_report())?;
    let directory = place.path();
    mission.record(directory);
    if place.is_there() {
        mission.stream_trajectory(directory);
    }
    match judge {
        None => eprintln!("the configuration has no [mission], so the agent runs until it is interrupted"),
        // Whoever supervises both knows when that one has ended.
        Some(Some(_)) if supervised => {}
        Some(Some(agent)) => {
            eprintln!("agent `{agent}` has the mission, so this one runs until it is interrupted")
        }
        Some(None) => {}
    }
    if server.name() != mission.agent.board().agent() {
        eprintln!("another agent of this name runs: this one is reached with --agent {}", server.name());
    }
    let console = wish.open(&mission, live || options.open || options.watched)?;
    if options.open {
        match &console {
            Some(console) => browse::open(console.link())?,
            None => eprintln!("no browser is opened, as the configuration switches the console off"),
        }
    }
    let display = live.then(|| Display::start(&name, seed, &mission, &log_lines));
    let can_stay = mission.can_stay();
    let finished = mission.run();
    drop(display);
    let finished = finished?;
    if let Some(console) = &console {
        console.tell_over(&finished.summary.headline());
    }
    let is_lost = finished.remembered.is_err() || matches!(finished.recorded, Some(Err(_)));
    if let Err(error) = finished.remembered {
        // The report is written in any case, and if it can't be, that is told too.
        Failure::from(error).print();
    }
    let report =
        Report { summary: &finished.summary, scene: &finished.scene, trajectory: &finished.trajectory };
    // What came of the run is known also where the disk is full.
    output::line(&finished.summary);
    // A run that keeps no report has one beside what tools kept of it.
    let written = if place.is_there() { leave(&report, &log_lines, directory) } else { Ok(()) };
    if place.is_there() && written.is_ok() {
        output::line(format_args!("report: {}", slate::runtime::printable(directory)));
    }
    match finished.recorded {
        Some(Ok(recorded)) => tell(&recorded),
        Some(Err(error)) => Failure::from(error).print(),
        None => {}
    }
    if options.common.json {
        output::document("slate.run/1", &finished.summary);
    }
    if can_stay {
        stay(&interrupt, console.as_ref(), options.stay);
    } else if options.stay {
        eprintln!("the run does not stay, as the drivers of its actuators end with it");
    }
    drop((server, console));
    drop(finished.agent);
    written?;
    drop(place);
    Ok(if is_lost { 2 } else { u8::from(!finished.summary.succeeded()) })
}

/// Address space that the threads and the shared memory of an agent reserve, bytes; most of it is never used.
const ADDRESS_SPACE: u64 = 1 << 30;

/// Says what to do when the process may reserve less memory than an agent does: the system would end it without a word.
fn warn_of_little_memory() {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    if let Some(limit) = limit.filter(|limit| *limit < ADDRESS_SPACE) {
        eprintln!(
            "warning: the address space is limited to {} MiB, and an agent reserves up to {} MiB\n  help: if it ends \
             early, raise the limit: ulimit -v unlimited",
            limit >> 20,
            ADDRESS_SPACE >> 20
        );
    }
}

/// Writes what stays of a run.
fn leave(report: &Report<'_>, log: &Lines, directory: &Path) -> Result<(), Failure> {
    report.write(directory)?;
    let lines = log.kept.lines();
    if lines.is_empty() {
        return Ok(());
    }
    let path = directory.join("log.txt");
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    std::fs::write(&path, text).map_err(|source| Failure::File { path, source })
}

/// Says what is in the recording.
fn tell(recorded: &Recorded) {
    let file = slate::runtime::printable(&recorded.file);
    let dropped = match recorded.dropped {
        0 => String::new(),
        dropped => format!(", {dropped} dropped"),
    };
    output::line(format_args!("recording: {file} ({} values{dropped})", recorded.values));
    if let Some(earlier) = &recorded.earlier {
        output::line(format_args!(
            "the recording that was there before: {}",
            slate::runtime::printable(earlier)
        ));
    }
}

//! One run of an application.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;

use slate::control::{ControlSurface, Server};
use slate::record::{Recorded, Report};
use slate::runtime::Rate;
use slate::runtime::log::LogTarget;
use slate::runtime::snapshot::Snapshot;

use crate::browse;
use crate::console;
use crate::deployment::{self, Tether};
use crate::display::{DisplayLog, LiveDisplay, RunTitle};
use crate::examples::{self, Application};
use crate::failure::Failure;
use crate::folder::ReportFolder;
use crate::mission::{Finished, How, MissionRun};
use crate::output;
use crate::run_options::{ModeName, RunOptions};
use crate::stay::{Interrupt, stay};

/// Runs an application once, or all agents of a file; returns the exit code.
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
    // A live display owns the terminal, so it shows the log too; the report contains a copy.
    let owns_terminal = !options.headless && std::io::stdout().is_terminal();
    let snapshot = options.resume.as_ref().map(Snapshot::read).transpose()?;
    let application = application(options, owns_terminal, snapshot.as_ref())?;
    let log = DisplayLog::default();
    let how = how(options, &application, !agents.is_empty(), owns_terminal.then(|| log.clone()))?;
    let title = RunTitle { name: application.name.clone(), seed: application.configuration.seed().value };
    let judge = application.configuration.mission().map(|mission| mission.outcome.agent().map(str::to_owned));
    let wish = console::Wish::of(&application.configuration)?;
    let mut mission = MissionRun::load(application, how)?;
    for end in mission.agent.composer().loose_ends() {
        eprintln!("warning: {}", slate::runtime::configuration::Report::from(vec![end]));
    }
    if let Some(snapshot) = snapshot {
        mission.resume(&snapshot)?;
    }
    let interrupt = Interrupt::handle(mission.agent.stopper(), options.supervised);
    if let Some(tether) = &mut tether
        && !tether.wait()
    {
        // Another agent failed to start and has reported why, so none starts.
        return Ok(0);
    }
    // A robot that `slate stop` can't find must not start.
    let surface =
        Arc::new(ControlSurface::new(&mission.agent).map_err(|error| Failure::Unreachable(error.into()))?);
    let server = Server::open_on(Arc::clone(&surface)).map_err(Failure::Unreachable)?;
    // Created last, so that a refused configuration leaves nothing behind.
    let folder = ReportFolder::of(options, &title.name, title.seed, mission.keeps_report())?;
    mission.record(folder.path());
    if folder.is_there() {
        mission.stream_trajectory(folder.path());
    }
    announce(judge, &server, &mission, options.supervised);
    let console = wish.open(&mission, surface, !options.headless || options.open || options.watched)?;
    if options.open {
        match &console {
            Some(console) => browse::open(console.link())?,
            None => eprintln!("warning: --open has no effect: the configuration disables the console"),
        }
    }
    let display = (!options.headless).then(|| LiveDisplay::start(&title, &mission, &log));
    let can_stay = mission.can_stay();
    let finished = mission.run();
    drop(display);
    let mut finished = finished?;
    if let Some(console) = &console {
        console.tell_over(&finished.summary.headline());
    }
    let (is_lost, written) = conclude(&mut finished, &log, &folder, options.common.json);
    if can_stay {
        stay(&interrupt, console.as_ref(), options.stay);
    } else if options.stay {
        eprintln!(
            "--stay has no effect without [time]: on the system's clock, actuators count as real, and their drivers end with \
             the run"
        );
    }
    drop((server, console));
    drop(finished.agent);
    written?;
    drop(folder);
    Ok(if is_lost { 2 } else { u8::from(!finished.summary.succeeded()) })
}

/// Finds what is run: an example, a configuration file, or the application of a snapshot.
fn application(
    options: &RunOptions,
    owns_terminal: bool,
    snapshot: Option<&Snapshot>,
) -> Result<Application, Failure> {
    let mut sets = options.common.set.clone();
    if let Some(seed) = options.seed {
        sets.push(format!("agent.seed={seed}"));
    }
    let defaults = vec![format!("log.targets.console={}", !owns_terminal)];
    match (&options.name, snapshot) {
        // The snapshot has what suited the terminal of the other run.
        (None, Some(snapshot)) => examples::of(snapshot, [defaults, sets].concat()),
        (name, _) => {
            let name = name.as_deref().unwrap_or_default();
            let (agent, host) = (options.agent.as_deref(), options.common.host.as_deref());
            examples::find(name, agent, defaults, sets, host)
        }
    }
}

/// Decides how the application is run; `has_team` says whether it is one of several agents.
fn how(
    options: &RunOptions,
    application: &Application,
    has_team: bool,
    log: Option<DisplayLog>,
) -> Result<How, Failure> {
    let is_driven = application.configuration.time_source().is_some();
    if !is_driven && options.rate.is_some_and(|rate| rate != Rate::REALTIME) {
        return Err(Failure::WallClock);
    }
    // A headless run in lockstep has no viewer, so it runs as fast as it can, unless threads or other agents set the pace.
    let is_threaded = options.common.mode == ModeName::Threaded;
    let needs_wall_clock = !options.headless || is_threaded || !is_driven || has_team;
    let default = if needs_wall_clock { Rate::REALTIME } else { Rate::Max };
    Ok(How {
        mode: options.common.mode,
        rate: options.rate.unwrap_or(default),
        workers: options.common.workers.into(),
        log: log.into_iter().map(|log| Box::new(log) as Box<dyn LogTarget>).collect(),
        trajectory: true,
        follows: true,
        disarmed: options.disarmed,
    })
}

/// Prints until when the agent runs, whether its actuators are disarmed, and by which name it is reached, where that is not
/// obvious. The `judge` is the agent
/// that judges the mission, if there is one, or this agent.
fn announce(judge: Option<Option<String>>, server: &Server, mission: &MissionRun, is_supervised: bool) {
    match judge {
        None => eprintln!("the configuration has no [mission]: the agent runs until Ctrl-C"),
        // The supervisor of both ends this one, too.
        Some(Some(agent)) if !is_supervised => {
            eprintln!("the mission belongs to agent `{agent}`: this agent runs until Ctrl-C")
        }
        Some(_) => {}
    }
    let disarmed = mission.disarmed();
    if !disarmed.is_empty() {
        let (names, agent) = (disarmed.join(", "), server.name());
        eprintln!(
            "warning: the actuators are disarmed, so no command reaches {names}\n  help: arm them: slate arm --agent {agent}"
        );
    }
    if server.name() != mission.agent.board().agent() {
        eprintln!("another agent has this name: reach this one with --agent {}", server.name());
    }
}

/// Prints the result of a run, and writes its report. Returns whether data was lost, and whether the report was written.
fn conclude(
    finished: &mut Finished,
    log: &DisplayLog,
    folder: &ReportFolder,
    json: bool,
) -> (bool, Result<(), Failure>) {
    let mut is_lost = matches!(finished.recorded, Some(Err(_)));
    if let Err(error) = std::mem::replace(&mut finished.remembered, Ok(())) {
        is_lost = true;
        // The report is written in any case.
        Failure::from(error).print();
    }
    let recorded = finished.recorded.take();
    let report =
        Report { summary: &finished.summary, scene: &finished.scene, trajectory: &finished.trajectory };
    // The result is printed even if the disk is full.
    output::line(&finished.summary);
    // A run without a report gets one if a tool has recorded it.
    let written = if folder.is_there() { leave(&report, log, folder.path()) } else { Ok(()) };
    if folder.is_there() && written.is_ok() {
        output::line(format_args!("report: {}", slate::runtime::printable(folder.path())));
    }
    match recorded {
        Some(Ok(recorded)) => tell(&recorded),
        Some(Err(error)) => Failure::from(error).print(),
        None => {}
    }
    if json {
        output::document("slate.run/1", &finished.summary);
    }
    (is_lost, written)
}

/// Address space that the threads and the shared memory of an agent reserve, bytes; most of it is never used.
const ADDRESS_SPACE: u64 = 1 << 30;

/// Warns if the process may reserve less memory than an agent does: the system would end it without a message.
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

/// Writes the report of a run, with its log.
fn leave(report: &Report<'_>, log: &DisplayLog, directory: &Path) -> Result<(), Failure> {
    report.write(directory)?;
    let lines = log.kept.lines();
    if lines.is_empty() {
        return Ok(());
    }
    let path = directory.join("log.txt");
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    std::fs::write(&path, text).map_err(|source| Failure::File { path, source })
}

/// Prints what was recorded.
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

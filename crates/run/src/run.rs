//! Single run of an application.

use std::path::Path;
use std::sync::Arc;

use slate_control::{ControlSurface, Server};
use slate_record::Recorded;
use slate_report::Report;
use slate_runtime::Rate;
use slate_runtime::log::LogTarget;
use slate_runtime::snapshot::Snapshot;

use crate::bridges::check_bridges;
use crate::console::{ConsoleOptions, open_browser};
use crate::display::{DisplayLog, LiveDisplay, RunTitle};
use crate::folder::ReportFolder;
use crate::groot::GrootRun;
use crate::network::{connect, network_settings};
use crate::ros::RosBridges;
use crate::stay::{Interrupt, stay};
use crate::{Application, Finished, MissionOptions, MissionRun, ModeName, RunError, RunOptions, output};

/// Context of a run beside its options.
#[derive(Default)]
pub struct RunContext {
    /// Snapshot that the run resumes from.
    pub snapshot: Option<Snapshot>,
    /// Team: the agent is one of several of its configuration.
    pub has_team: bool,
    /// Web console for several agents, served by this one.
    pub is_watched: bool,
    /// Process that started the agent together with others.
    pub supervision: Option<Supervision>,
}

/// Connection of a run to the process that supervises it.
pub struct Supervision {
    /// Reports that the agent is ready, and waits for the others.
    /// Returns false if one of them fails.
    pub wait: Box<dyn FnOnce() -> bool>,
    /// Ends this process some time after it was asked to end, if it still runs.
    pub end_later: fn(),
}

/// Runs an application once; returns the exit code.
/// 0 when the mission succeeds, else 1, and 2 when data is lost.
///
/// # Errors
/// If the run can't start, or its report can't be written.
pub fn run(application: Application, options: &RunOptions, context: RunContext) -> Result<u8, RunError> {
    warn_of_little_memory();
    let RunContext { snapshot, has_team, is_watched, supervision } = context;
    // A live display owns the terminal, so it shows the log too; the report contains a copy.
    let log = DisplayLog::default();
    let load_options =
        mission_options(options, &application, has_team, options.owns_terminal().then(|| log.clone()))?;
    let title = RunTitle { name: application.name.clone(), seed: application.configuration.seed().value };
    let judge = application.configuration.mission().map(|mission| mission.outcome.agent().map(str::to_owned));
    let console_options = ConsoleOptions::of(&application.configuration)?;
    check_bridges(&application.configuration)?;
    let network_settings = network_settings(&application.configuration)?;
    let configuration = Arc::clone(&application.configuration);
    let mut mission = MissionRun::load(application, load_options)?;
    for end in mission.agent.composer().loose_ends() {
        let heading = end.heading("warning");
        eprintln!("{heading}: {}", slate_runtime::configuration::Report::from(vec![end]));
    }
    if let Some(snapshot) = snapshot {
        mission.resume(&snapshot)?;
    }
    let is_supervised = supervision.is_some();
    let end_later = supervision.as_ref().map(|supervision| supervision.end_later);
    let interrupt = Interrupt::handle(mission.agent.stopper(), end_later);
    if let Some(supervision) = supervision
        && !(supervision.wait)()
    {
        // Another agent failed to start and has reported why, so none starts.
        return Ok(0);
    }
    let surface =
        Arc::new(ControlSurface::new(&mission.agent).map_err(|error| RunError::Unreachable(error.into()))?);
    // Its address is known before the agent is reached at its socket.
    let is_watched = !options.headless || options.open || is_watched;
    let console = console_options.open(&mission, Arc::clone(&surface), is_watched)?;
    // A robot that `slate stop` can't find must not start.
    let server = Server::open_on(Arc::clone(&surface)).map_err(RunError::Unreachable)?;
    let join = |settings| connect(&surface, settings, &configuration);
    let network = network_settings.as_ref().map(join).transpose()?;
    let mut ros = RosBridges::open(&mission.agent, &surface)?;
    let groot = GrootRun::open(&mission.agent)?;
    // Created last, so that a refused configuration leaves nothing behind.
    let folder = ReportFolder::of(options, &title.name, title.seed, mission.keeps_report())?;
    mission.record(folder.path());
    // Values from outside are part of the recording.
    ros.start(&mission.agent)?;
    if folder.is_there() {
        mission.stream_trajectory(folder.path());
    }
    announce(judge, &server, &mission, is_supervised);
    if options.open {
        match &console {
            Some(console) => open_browser(console.link())?,
            None => eprintln!("warning: --open has no effect: the configuration disables the console"),
        }
    }
    let display = (!options.headless).then(|| LiveDisplay::start(&title, &mission, &log));
    let can_stay = mission.can_stay();
    let finished = mission.run();
    drop(display);
    let mut finished = finished?;
    surface.announce_end(&finished.summary.headline());
    let (is_lost, written) = conclude(&mut finished, &log, &folder, options.common.json);
    if can_stay {
        stay(&interrupt, console.as_ref(), options.stay);
    } else if options.stay {
        eprintln!(
            "warning: --stay has no effect without [time]: actuators on the system's clock count as real, and their drivers \
             end with the run"
        );
    }
    drop((server, console, network, ros, groot));
    drop(finished.agent);
    written?;
    drop(folder);
    Ok(if is_lost { 2 } else { u8::from(!finished.summary.succeeded()) })
}

/// Returns the options of the application's run.
/// `has_team` tells whether it is one of several agents.
fn mission_options(
    options: &RunOptions,
    application: &Application,
    has_team: bool,
    log: Option<DisplayLog>,
) -> Result<MissionOptions, RunError> {
    let is_driven = application.configuration.time_source().is_some();
    if !is_driven && options.rate.is_some_and(|rate| rate != Rate::REALTIME) {
        return Err(RunError::WallClock);
    }
    // A headless run in lockstep has no viewer, so it runs as fast as it can, unless threads or other agents set the pace.
    let is_threaded = options.common.mode == ModeName::Threaded;
    let needs_wall_clock = !options.headless || is_threaded || !is_driven || has_team;
    let default = if needs_wall_clock { Rate::REALTIME } else { Rate::Max };
    Ok(MissionOptions {
        mode: options.common.mode,
        rate: options.rate.unwrap_or(default),
        workers: options.common.workers.into(),
        log: log.into_iter().map(|log| Box::new(log) as Box<dyn LogTarget>).collect(),
        trajectory: true,
        follows: true,
        disarmed: options.disarmed,
    })
}

/// Prints the duration of the run, the disarmed actuators and the agent's name.
/// The name for tools is printed only if it is not obvious.
///
/// `judge` is the agent that judges the mission; its inner value is empty for this agent.
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

/// Prints the result of a run, and writes its report.
/// Returns whether data was lost, and whether the report was written.
fn conclude(
    finished: &mut Finished,
    log: &DisplayLog,
    folder: &ReportFolder,
    json: bool,
) -> (bool, Result<(), RunError>) {
    let mut is_lost = matches!(finished.recorded, Some(Err(_)));
    if let Err(error) = std::mem::replace(&mut finished.remembered, Ok(())) {
        is_lost = true;
        // The report is written in any case.
        RunError::from(error).print();
    }
    let recorded = finished.recorded.take();
    let report =
        Report { summary: &finished.summary, scene: &finished.scene, trajectory: &finished.trajectory };
    // The result is printed even if the disk is full.
    output::line(&finished.summary);
    // A run without a report gets one if a tool has recorded it.
    let written = if folder.is_there() { leave(&report, log, folder.path()) } else { Ok(()) };
    if folder.is_there() && written.is_ok() {
        output::line(format_args!("report: {}", slate_runtime::printable(folder.path())));
    }
    match recorded {
        Some(Ok(recorded)) => print_recorded(&recorded),
        Some(Err(error)) => RunError::from(error).print(),
        None => {}
    }
    if json {
        output::document("slate.run/1", &finished.summary);
    }
    (is_lost, written)
}

/// Address space that an agent's threads and shared memory reserve, bytes.
/// Most of it is never used.
const REQUIRED_ADDRESS_SPACE: u64 = 1 << 30;

/// Warns if the process may reserve less memory than an agent does.
/// The system would end it without a message.
fn warn_of_little_memory() {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    if let Some(limit) = limit.filter(|limit| *limit < REQUIRED_ADDRESS_SPACE) {
        eprintln!(
            "warning: the address space is limited to {} MiB, and an agent reserves up to {} MiB\n  help: if it ends \
             early, raise the limit: ulimit -v unlimited",
            limit >> 20,
            REQUIRED_ADDRESS_SPACE >> 20
        );
    }
}

/// Writes the report of a run, with its log.
fn leave(report: &Report<'_>, log: &DisplayLog, directory: &Path) -> Result<(), RunError> {
    report.write(directory)?;
    let lines = log.kept.lines();
    if lines.is_empty() {
        return Ok(());
    }
    let path = directory.join("log.txt");
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    std::fs::write(&path, text).map_err(|source| RunError::File { path, source })
}

/// Prints the recorded files.
fn print_recorded(recorded: &Recorded) {
    let file = slate_runtime::printable(&recorded.file);
    let dropped = match recorded.dropped {
        0 => String::new(),
        dropped => format!(", {dropped} dropped"),
    };
    output::line(format_args!("recording: {file} ({} values{dropped})", recorded.values));
    if let Some(earlier) = &recorded.earlier {
        output::line(format_args!(
            "the recording that was there before: {}",
            slate_runtime::printable(earlier)
        ));
    }
}

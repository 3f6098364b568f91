//! An agent: one process with one blackboard and a name.

mod build;
mod changes;
mod composer;
mod composition;
mod consent;
mod deepening;
mod logging;
mod looping;
mod memory;
mod playing;
mod relinking;
mod requests;
mod settings;
mod sharing;
mod snapshot;
mod target;
mod unlinked;

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;
use std::sync::{Arc, Weak};
use std::time::Duration;

use slate_blackboard::Board;
use slate_module::Plugin;
use slate_safety::StopLatch;

use crate::aspects::{Means, PluginControl, SettingsControl, ThreadKeeper};
use crate::clock::{Calendar, Clock, TimeSource};
use crate::configuration::{Configuration, Database, Report};
use crate::isolation::Arenas;
use crate::log::{LogTarget, Logger};
use crate::main_loop::{
    End, Flow, Observer, Pace, Parameters, Rate, Shared, Watchdog, Workers, cycle, drive,
};
use crate::playback::Playback;
use crate::plugin::KnownLibraries;
use crate::recording::Recording;
use crate::sharing::Sharing;
use build::Ground;
pub use composer::RemoteEnd;
pub use composer::{
    Composer, ControlsError, ControlsHolder, LinkStatus, Loaded, ModuleStatus, NewLink, PluginError,
    PluginStatus, Reload, Teleoperation, WeakComposer, catalogue,
};
use composition::Composition;
pub use looping::SystemClock;
use memory::Memories;
use settings::Settings;
use sharing::Remotes;

/// How the modules of an agent are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// All on the main loop, stage by stage; in lockstep under a time source.
    Staged,
    /// Modules that wait for something or have a period get threads of their own.
    Threaded,
}

/// How an agent is started.
pub struct Options {
    /// How the modules are run.
    pub mode: Mode,
    /// How fast virtual time goes.
    pub rate: Rate,
    /// Threads that help the main loop with independent modules.
    pub workers: usize,
    /// Uses the workers also where it does not pay; the result is the same.
    pub always_help: bool,
    /// Where the log goes, beside the targets of the configuration.
    pub log: Vec<Box<dyn LogTarget>>,
    /// Arms the actuators at the start, as robots in the simulator do.
    pub armed: bool,
    /// The stop that all gates obey.
    pub stop: StopLatch,
    /// Sets the agent's time, in place of a module that the configuration names as its time source, or beside it.
    pub time_source: Option<Box<dyn TimeSource>>,
    /// Says the date, for logs; the system's if there is none.
    pub calendar: Option<Calendar>,
    /// What is started to run isolated modules: a program whose `main` calls [`isolation::enter`](crate::isolation::enter)
    /// first, with the same plugins. Nothing for this program.
    pub isolation_program: Option<PathBuf>,
    /// A file in which libraries are known as they were when they were loaded last: one that has changed since is told of
    /// before it is opened, and one that is damaged is refused. Made when it is needed.
    pub known_libraries: Option<PathBuf>,
    /// Whether [`Agent::remember`] is to write what modules remember; their files are kept from other runs until then.
    pub keeps_memory: bool,
    /// Whether files of the configuration that are edited are taken over, when the agent is loaded with a database.
    pub follows_files: bool,
    /// What carries values to other agents and from them, if links or `[share]` want that.
    pub sharing: Option<Box<dyn Sharing>>,
    /// What records the agent.
    pub recording: Option<Arc<dyn Recording>>,
    /// What plays a recording in it: the time is as that says.
    pub playback: Option<Box<dyn Playback>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: Mode::Staged,
            rate: Rate::REALTIME,
            workers: 0,
            always_help: false,
            log: Vec::new(),
            armed: false,
            stop: StopLatch::in_memory(),
            time_source: None,
            calendar: None,
            isolation_program: None,
            known_libraries: None,
            keeps_memory: false,
            follows_files: true,
            sharing: None,
            recording: None,
            playback: None,
        }
    }
}

impl std::fmt::Debug for Options {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Options").field("mode", &self.mode).field("rate", &self.rate).finish_non_exhaustive()
    }
}

/// Why an agent does not start.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum StartError {
    /// The configuration and the plugins don't fit together.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Configuration(#[from] Report),
    /// A plugin can't be loaded.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Plugin(PluginError),
    /// Virtual time as fast as it goes is for lockstep.
    #[error("threaded mode runs on the wall clock: it has no rate `max`")]
    #[diagnostic(help("use `realtime` or a factor, or staged mode"))]
    ThreadedMax,
    /// The system has no thread left.
    #[error("a thread can't be started: {0}")]
    Thread(#[from] std::io::Error),
}

impl From<PluginError> for StartError {
    fn from(error: PluginError) -> Self {
        match error {
            PluginError::Unfit(report) => Self::Configuration(report),
            other => Self::Plugin(other),
        }
    }
}

/// An agent, loaded and ready.
pub struct Agent {
    shared: Arc<Shared>,
    composer: Composer,
    hang: Duration,
    threads: Arc<ThreadKeeper>,
    /// What its modules remember.
    memories: Memories,
    /// Those that change while it runs.
    settings: Option<Settings>,
}

impl std::fmt::Debug for Agent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Agent").field("name", &self.shared.board.agent()).finish_non_exhaustive()
    }
}

impl Agent {
    /// Loads what the configuration asks for. Either all of it fits and is made, or nothing is.
    ///
    /// # Errors
    /// Everything that does not fit, with file, line and caret.
    pub fn load(
        configuration: &Configuration,
        plugins: &[Plugin],
        options: Options,
    ) -> Result<Self, StartError> {
        if options.mode == Mode::Threaded && options.rate == Rate::Max {
            return Err(StartError::ThreadedMax);
        }
        let (memories, states) = Memories::read(configuration, options.keeps_memory)?;
        let plays = options.playback.is_some();
        let driven = configuration.time_source().is_some() || options.time_source.is_some() || plays;
        let lockstep = driven && options.mode == Mode::Staged;
        let logger = Arc::new(Logger::new(logging::settings(configuration, lockstep), options.log)?);
        let clock = Arc::new(Clock::new(driven, options.calendar));
        // What is measured in lockstep is no reason to wait.
        let minimum = if lockstep { 0 } else { configuration.minimum().map_or(0, |minimum| minimum.value) };
        let board = Arc::new(Board::new(configuration.agent_name()));
        if let Some(recording) = &options.recording {
            // First, so that it sees all that is ever written.
            board.tap_with(Arc::clone(recording) as _);
        }
        let played: Arc<[_]> =
            options.playback.as_ref().map_or_else(Vec::new, |playback| playback.properties()).into();
        let shared = Arc::new(Shared::new(Parameters {
            board: Arc::clone(&board),
            clock,
            logger: Arc::clone(&logger),
            period: configuration.period().value,
            lockstep,
            schedule: configuration.schedule().clone(),
            workers: Workers::start(options.workers, options.always_help)?,
            pace: Pace::new(options.rate, minimum),
            time_source: options.time_source,
        }));
        let hang = Duration::from_nanos(configuration.hang().value);
        let threads = ThreadKeeper::new(hang, lockstep, &logger, &shared.clock);
        let control = Arc::new(PluginControl::default());
        let changes = SettingsControl::new(lockstep);
        let means = means(&shared, &threads, &control, &changes);
        let arenas = Arenas::new(options.isolation_program);
        let ground = Ground::new(means, hang, lockstep, options.mode, options.stop, arenas);
        let mut catalogue = composer::host_catalogue(options.sharing.as_deref());
        catalogue.played = Arc::clone(&played);
        let remotes = Remotes::new(options.sharing);
        let configured = Arc::new(configuration.clone());
        let mut composition = Composition::new(configured, catalogue, ground, remotes, options.armed);
        composition.libraries = options.known_libraries.map(KnownLibraries::at);
        let composer = Composer::new(Arc::clone(&shared), composition, options.recording);
        control.connect(Box::new(composer.downgrade()));
        changes.connect(Box::new(composer.downgrade()));
        shared.change_with(changes);
        logging::show(&shared.logger, &shared.board)?;
        let restored = composer.start(plugins, &states)?;
        memories
            .check(configuration, &restored, |module| composer.composition().present.contains_key(module))?;
        if let Some(playback) = options.playback {
            playing::begin(playback, &played, configuration, &composer, &shared)?;
        }
        // Only now, as a configuration that is refused leaves no file behind.
        logging::configure(&shared.logger, configuration)?;
        if let Some(watch) = snapshot::Watch::of(configuration, &shared, &composer)? {
            composer.composition().watch = Some(Arc::clone(&watch));
            shared.watch_cycles(Box::new(move |shared, now| watch.look(shared, now)));
        }
        composer.check_facts(configuration)?;
        composer.share().map_err(|error| sharing::refused(configuration, error))?;
        Ok(Self { shared, composer, hang, threads, memories, settings: None })
    }

    /// As [`load`](Agent::load), and the agent follows what is changed in the database while it is there: parameters,
    /// values of inputs, links, `enabled` and log levels, all that is changed of one module between two of its ticks. Files
    /// that are edited are taken over too. What else is changed, or does not fit, is refused and changes nothing.
    ///
    /// # Errors
    /// As [`load`](Agent::load).
    pub fn load_with(database: &Database, plugins: &[Plugin], options: Options) -> Result<Self, StartError> {
        let follows_files = options.follows_files;
        let mut agent = Self::load(&database.current(), plugins, options)?;
        agent.settings = Some(Settings::follow(database, &agent.composer, follows_files)?);
        Ok(agent)
    }

    /// Where its configuration is changed; none when it was loaded without one.
    pub fn database(&self) -> Option<&Database> {
        self.settings.as_ref().map(|settings| &settings.database)
    }

    /// What it was loaded with, and with what was changed since.
    pub fn configuration(&self) -> Arc<Configuration> {
        Arc::clone(&self.composer.composition().configuration)
    }

    /// Whether a time source sets its time and all runs on the loop, so that the same configuration and seed give the same
    /// bytes.
    pub fn is_lockstep(&self) -> bool {
        self.shared.lockstep
    }

    /// Whether its actuators are armed as soon as they are there.
    pub fn begins_armed(&self) -> bool {
        self.composer.composition().armed
    }

    /// What changes the agent, also while it runs and from any thread.
    pub fn composer(&self) -> Composer {
        self.composer.clone()
    }

    /// Everything that the robot knows.
    pub fn board(&self) -> &Arc<Board> {
        &self.shared.board
    }

    /// What the agent and its modules log with.
    pub fn logger(&self) -> &Arc<Logger> {
        &self.shared.logger
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.shared.clock.now()
    }

    /// Reads the agent's time from any thread, nanoseconds.
    pub fn clock(&self) -> impl Fn() -> u64 + Send + 'static {
        let clock = Arc::clone(&self.shared.clock);
        move || clock.now()
    }

    /// The names of the modules.
    pub fn modules(&self) -> Vec<String> {
        self.composer.composition().present.keys().cloned().collect()
    }

    /// How often a module has ticked, missed its deadline and panicked.
    pub fn counts(&self, module: &str) -> Option<(u64, u64, u64)> {
        let composition = self.composer.composition();
        let seat = &composition.present.get(module)?.seat;
        let load = |counter: &std::sync::atomic::AtomicU64| counter.load(Ordering::Relaxed);
        Some((seat.ticks(), load(&seat.health.misses), load(&seat.health.panics)))
    }

    /// A fingerprint of everything that modules wrote in lockstep so far; nothing on the wall clock.
    pub fn digest(&mut self) -> Option<u64> {
        // SAFETY: `&mut self` says that no run is going on in another thread, and jobs don't use the digest.
        unsafe { self.shared.core() }.digest.as_ref().map(crate::digest::Digest::value)
    }

    /// Stops all actuators, and keeps them stopped until [`reset`](Agent::reset) and [`arm`](Agent::arm).
    pub fn stop_actuators(&self, reason: &str) {
        self.composer.stop_actuators(reason);
    }

    /// Ends a stop of the actuators.
    pub fn reset(&self) {
        self.composer.reset();
    }

    /// Lets commands through to the actuators; false when one is still stopped.
    pub fn arm(&self) -> bool {
        self.composer.arm()
    }

    /// What ends a run from another thread.
    pub fn stopper(&self) -> Stopper {
        Stopper { shared: Arc::downgrade(&self.shared) }
    }

    /// One cycle of the main loop, in the caller's thread and without a watchdog.
    ///
    /// Only in lockstep: on the wall clock modules have threads of their own.
    pub fn step(&mut self) -> bool {
        if !self.shared.lockstep {
            return false;
        }
        self.shared.take_token();
        let flow = cycle(&self.shared);
        self.shared.give_token_back();
        if flow != Flow::Lost {
            self.shared.change();
        }
        flow != Flow::Lost
    }

    /// Runs until the observer, a [`Stopper`] or a fault ends it.
    ///
    /// # Errors
    /// When a thread can't be started.
    ///
    /// # Panics
    /// When the observer does.
    pub fn run(&mut self, observer: Observer) -> Result<End, StartError> {
        let shared = &self.shared;
        let watchdog = Watchdog::new(Arc::clone(shared), self.hang);
        // Before the token is taken: who changes the agent at this moment waits for who has it.
        let composition = self.composer.composition();
        shared.begin();
        // SAFETY: `begin` took the token.
        unsafe { shared.core() }.observer = Some(observer);
        let watchdog = std::thread::Builder::new().name("watchdog".into()).spawn(move || watchdog.watch());
        let measured = Arc::clone(shared);
        let timing = std::thread::Builder::new().name("timing".into());
        let timing = timing.spawn(move || measured.publish_until_over());
        let driver = Arc::clone(shared);
        let main_loop = std::thread::Builder::new().name("main loop".into());
        let (changing, free) = channel::<()>();
        let started = match (&watchdog, &timing) {
            (Ok(_), Ok(_)) => {
                let threads = composition.start_threads(shared);
                // It begins when the agent can be changed again: a cycle may have to look at what it is made of.
                let begin = move || {
                    // Nothing is ever sent.
                    let _ = free.recv();
                    drive(&driver);
                };
                threads.and_then(|()| main_loop.spawn(begin).map(drop))
            }
            (Err(error), _) | (_, Err(error)) => Err(error.kind().into()),
        };
        if started.is_err() {
            shared.finish(End::Stopped);
            shared.put_token_down();
        }
        drop(composition);
        drop(changing);
        let end = shared.wait();
        shared.threads().join();
        let panic = shared.close();
        for thread in [watchdog, timing].into_iter().flatten() {
            // They have nothing that panics.
            let _ = thread.join();
        }
        shared.take_token();
        // SAFETY: the token was taken.
        unsafe { shared.core() }.observer = None;
        shared.give_token_back();
        let watch = self.composer.composition().watch.clone();
        if let Some(watch) = watch {
            watch.wait();
        }
        shared.logger.flush(LAST_LINES);
        if let Some(panic) = panic {
            std::panic::resume_unwind(panic);
        }
        started?;
        Ok(end)
    }
}

/// What the services of the host are made of.
fn means(
    shared: &Shared,
    threads: &Arc<ThreadKeeper>,
    plugins: &Arc<PluginControl>,
    settings: &Arc<SettingsControl>,
) -> Means {
    Means {
        board: Arc::clone(&shared.board),
        actuators: Arc::default(),
        logger: Arc::clone(&shared.logger),
        clock: Arc::clone(&shared.clock),
        synchronization: Arc::clone(&shared.synchronization),
        threads: Arc::clone(threads),
        plugins: Arc::clone(plugins),
        settings: Arc::clone(settings),
        takeovers: Arc::default(),
        time: Arc::default(),
    }
}

/// How long the end of a run waits for the last lines of the log.
const LAST_LINES: Duration = Duration::from_secs(1);

impl Drop for Agent {
    fn drop(&mut self) {
        self.shared.finish(End::Stopped);
        self.composer.end_sharing();
        self.threads.end();
        self.shared.logger.flush(LAST_LINES);
    }
}

/// Ends a run from another thread. It keeps nothing of its agent: a handler of signals has it until the process ends.
#[derive(Clone)]
pub struct Stopper {
    shared: Weak<Shared>,
}

impl Stopper {
    /// Ends the run after the present cycle, if the agent is still there. Before the first run this ends that one before
    /// its first cycle.
    pub fn stop(&self) {
        if let Some(shared) = self.shared.upgrade() {
            shared.stop();
        }
    }
}

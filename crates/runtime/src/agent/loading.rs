//! Loading of an agent: either the whole configuration is built, or nothing.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::Board;
use slate_module::Plugin;

use super::assembly::Assembly;
use super::build::HostResources;
use super::composition::Composition;
use super::handle::AgentHandle;
use super::memories::Memories;
use super::plugins::{self, PluginError, PluginLoader, host_catalogue};
use super::remote_links::RemoteLinks;
use super::remotes::Remotes;
use super::settings::FollowedSettings;
use super::snapshot::SnapshotWatch;
use super::{Agent, Mode, Options, logging, playing};
use crate::aspects::{PluginControl, ServiceContext, SettingsControl, ThreadRegistry};
use crate::sharing::Sharing;
use slate_composition::{Catalogue, check_facts};
use slate_configuration::{Configuration, Database, Report};
use slate_engine::clock::Clock;
use slate_engine::isolation::Arenas;
use slate_engine::log::Logger;
use slate_engine::main_loop::{Pace, Parameters, Rate, SharedLoop, Workers};
use slate_engine::plugin::KnownLibraries;

/// Error of starting an agent.
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
    /// Maximum rate outside of lockstep.
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

/// Returns the components from which a configuration's agent can be made.
/// These are the kinds of the linked plugins and of those that it names, links to other agents if there is a carrier
/// for them, and the services of the host.
///
/// # Errors
/// When a plugin can't be loaded.
pub fn catalogue(
    configuration: &Configuration,
    linked: &[Plugin],
    sharing: Option<&dyn Sharing>,
) -> Result<Catalogue, StartError> {
    Ok(plugins::catalogue(configuration, linked, sharing)?)
}

impl Agent {
    /// Loads an agent from its configuration: either all of it, or nothing.
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
        // Lockstep measurements need no wait.
        let minimum = if lockstep { 0 } else { configuration.minimum().map_or(0, |minimum| minimum.value) };
        let board = Arc::new(Board::new(configuration.agent_name()));
        if let Some(recording) = &options.recording {
            // First, so that it sees all that is ever written.
            board.tap_with(Arc::clone(recording) as _);
        }
        let played: Arc<[_]> =
            options.playback.as_ref().map_or_else(Vec::new, |playback| playback.properties()).into();
        let shared = Arc::new(SharedLoop::new(Parameters {
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
        let threads = ThreadRegistry::new(hang, lockstep, &logger, &shared.clock);
        let control = Arc::new(PluginControl::default());
        let changes = SettingsControl::new(lockstep);
        let service_context = service_context(&shared, &threads, &control, &changes);
        let arenas = Arenas::new(options.isolation_program);
        let resources =
            HostResources::new(service_context, hang, lockstep, options.mode, options.stop, arenas);
        let mut catalogue = host_catalogue(options.sharing.as_deref());
        catalogue.played = Arc::clone(&played);
        let remotes = Remotes::new(options.sharing);
        let configured = Arc::new(configuration.clone());
        let assembly = Assembly::new(resources);
        let mut composition = Composition::new(configured, catalogue, assembly, remotes, options.armed);
        composition.plugins.known = options.known_libraries.map(KnownLibraries::at);
        let handle = AgentHandle::new(Arc::clone(&shared), composition, options.recording);
        control.connect(Box::new(handle.downgrade()));
        changes.connect(Box::new(handle.downgrade()));
        shared.hooks.set_requested_changes(changes);
        logging::show(&shared.logger, &shared.board)?;
        let restored = PluginLoader::new(&handle).start(plugins, &states)?;
        memories.check(configuration, &restored, |module| {
            handle.composition().assembly.modules.contains_key(module)
        })?;
        if let Some(playback) = options.playback {
            playing::begin(playback, &played, configuration, &handle, &shared)?;
        }
        // Only now, as a configuration that is refused leaves no file behind.
        logging::configure(&shared.logger, configuration)?;
        if let Some(watch) = SnapshotWatch::of(configuration, &shared, &handle)? {
            handle.composition().snapshots.automatic = Some(Arc::<SnapshotWatch>::clone(&watch));
            shared.hooks.set_after_cycle(Box::new(move |shared, now| watch.check(shared, now)));
        }
        check_facts(configuration, &**handle.board(), |module| {
            handle.composition().assembly.modules.contains_key(module)
        })?;
        RemoteLinks::new(&handle).share().map_err(|error| error.report(configuration))?;
        Ok(Self { handle, hang, threads, memories, settings: None })
    }

    /// Loads an agent as [`load`](Agent::load), and follows its database.
    /// Changes of parameters, values of inputs, links, `enabled` and log levels take effect while the agent runs; all
    /// changes of one module take effect between two of its ticks. Edited files are read again too. Other changes, and
    /// those that do not fit, are refused and have no effect.
    ///
    /// # Errors
    /// As [`load`](Agent::load).
    pub fn load_with(database: &Database, plugins: &[Plugin], options: Options) -> Result<Self, StartError> {
        let follows_files = options.follows_files;
        let mut agent = Self::load(&database.current(), plugins, options)?;
        agent.settings = Some(FollowedSettings::follow(database, &agent.handle, follows_files)?);
        Ok(agent)
    }
}

/// Makes the means of the host's services.
fn service_context(
    shared: &SharedLoop,
    threads: &Arc<ThreadRegistry>,
    plugins: &Arc<PluginControl>,
    settings: &Arc<SettingsControl>,
) -> ServiceContext {
    ServiceContext {
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

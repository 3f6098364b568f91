//! Present composition of an agent, and its changes.
//! A change is checked as a whole and exchanged between two cycles, or it has no effect.

mod change;
mod links;
mod target;

use std::path::PathBuf;
use std::sync::Arc;

use slate_module::{ModuleKind, Plugin};
use slate_sorted::SortedMap;

use super::assembly::Assembly;
use super::remotes::Remotes;
use crate::playback::PlaybackControl;
use crate::snapshot::ApplicationState;
pub(super) use links::{LinkRetry, WaitingLinks};
use slate_composition::Catalogue;
use slate_configuration::{Configuration, Database, Diagnostic, Report};
use slate_engine::main_loop::SharedLoop;
use slate_engine::plugin::{KnownLibraries, Residence};
pub(super) use target::{CompositionChange, CompositionTarget, Fitting};

/// Origin of a plugin's code.
#[derive(Clone, Debug)]
pub(super) struct LibraryOrigin {
    pub file: PathBuf,
    pub residence: Residence,
}

/// Plugin with a shadow.
pub(super) struct PluginTrial {
    pub plugin: Plugin,
    pub origin: LibraryOrigin,
    pub modules: Vec<String>,
}

/// Code of the plugins.
#[derive(Default)]
pub(super) struct PluginCode {
    /// The plugins that are linked into the program.
    pub linked: Vec<Plugin>,
    /// Known state of libraries at their last load.
    pub known: Option<KnownLibraries>,
    /// Origins of the libraries' code, by plugin.
    pub origins: SortedMap<String, LibraryOrigin>,
    /// Plugins with a shadow.
    pub trials: SortedMap<String, PluginTrial>,
}

/// Automatic snapshots of a configuration.
pub(super) trait AutomaticSnapshot: Send + Sync {
    /// Starts anew; conditions that hold now do not count as changes.
    fn begin(&self, shared: &SharedLoop);

    /// Waits until the last snapshot is written.
    /// The loop must not call it, as the writer may wait for the loop.
    fn wait(&self);
}

/// Snapshots of an agent: additional content, and automatic snapshots.
#[derive(Default)]
pub(super) struct SnapshotSettings {
    /// Content of the application in snapshots.
    pub application_states: SortedMap<String, Arc<dyn ApplicationState>>,
    /// Automatic snapshots.
    pub automatic: Option<Arc<dyn AutomaticSnapshot>>,
}

/// Composition of an agent.
pub(super) struct Composition {
    pub configuration: Arc<Configuration>,
    pub catalogue: Catalogue,
    /// Modules and links made from the two.
    pub assembly: Assembly,
    pub plugins: PluginCode,
    /// Links that are not made yet.
    pub waiting: WaitingLinks,
    pub remotes: Remotes,
    pub snapshots: SnapshotSettings,
    /// True if new actuators are armed.
    pub armed: bool,
    /// Database of the configuration.
    pub database: Option<Database>,
    /// Control of the playback, if a recording is played.
    pub playback: Option<Arc<dyn PlaybackControl>>,
}

impl Composition {
    /// Makes a composition without modules.
    pub fn new(
        configuration: Arc<Configuration>,
        catalogue: Catalogue,
        assembly: Assembly,
        remotes: Remotes,
        armed: bool,
    ) -> Self {
        Self {
            configuration,
            catalogue,
            assembly,
            plugins: PluginCode::default(),
            waiting: WaitingLinks::default(),
            remotes,
            snapshots: SnapshotSettings::default(),
            armed,
            database: None,
            playback: None,
        }
    }

    /// The modules that run code of those plugins.
    pub fn modules_of(&self, plugins: &[String]) -> Vec<String> {
        let of = |kind: &ModuleKind| {
            self.catalogue
                .plugin_of(kind)
                .is_some_and(|plugin| plugins.iter().any(|own| own == plugin.name()))
        };
        let modules = self.assembly.modules.iter().filter(|(_, loaded)| of(&loaded.kind));
        modules.map(|(name, _)| name.clone()).collect()
    }

    /// Returns the database of the configuration.
    ///
    /// # Errors
    /// When the agent was loaded without a database.
    pub fn database(&self) -> Result<Database, Report> {
        self.database.clone().ok_or_else(|| {
            let message = "the configuration of this agent can't change while it runs";
            Diagnostic::without_place(message, Some("load it with a database".into())).into()
        })
    }
}

//! What an agent is made of at present, and how that changes: everything fits and is exchanged between two cycles, or
//! nothing happens.

mod change;
mod links;
mod target;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use slate_module::{ModuleKind, Plugin};

use super::assembly::Assembly;
use super::remotes::Remotes;
use crate::playback::PlaybackControl;
use crate::snapshot::Keepsake;
pub(super) use links::{LinkRetry, WaitingLinks};
use slate_composition::Catalogue;
use slate_configuration::{Configuration, Database, Diagnostic, Report};
use slate_engine::main_loop::SharedLoop;
use slate_engine::plugin::{KnownLibraries, Residence};
pub(super) use target::{CompositionChange, CompositionTarget, Fitting};

/// Where a plugin's code comes from.
#[derive(Clone, Debug)]
pub(super) struct LibraryOrigin {
    pub file: PathBuf,
    pub residence: Residence,
}

/// A plugin whose new code runs beside the old.
pub(super) struct PluginTrial {
    pub plugin: Plugin,
    pub origin: LibraryOrigin,
    pub modules: Vec<String>,
}

/// Where the code of the plugins is.
#[derive(Default)]
pub(super) struct PluginCode {
    /// The plugins that are linked into the program.
    pub linked: Vec<Plugin>,
    /// Libraries as they were when they were loaded last.
    pub known: Option<KnownLibraries>,
    /// Where the code of libraries comes from, by plugin.
    pub origins: BTreeMap<String, LibraryOrigin>,
    /// Plugins whose new code runs beside the old.
    pub trials: BTreeMap<String, PluginTrial>,
}

/// Takes snapshots by itself, as the configuration says.
pub(super) trait AutomaticSnapshot: Send + Sync {
    /// Begins anew: what holds now was no change.
    fn begin(&self, shared: &SharedLoop);

    /// Waits until the last snapshot is written. Must not be called by the loop, as the writer may wait for it.
    fn wait(&self);
}

/// What an agent takes into snapshots, and when.
#[derive(Default)]
pub(super) struct SnapshotSettings {
    /// What the application takes into snapshots.
    pub keepsakes: BTreeMap<String, Arc<dyn Keepsake>>,
    /// What takes snapshots by itself.
    pub automatic: Option<Arc<dyn AutomaticSnapshot>>,
}

/// All that an agent is made of.
pub(super) struct Composition {
    pub configuration: Arc<Configuration>,
    pub catalogue: Catalogue,
    /// The modules and links that are made of the two.
    pub assembly: Assembly,
    pub plugins: PluginCode,
    /// Links that are not made yet.
    pub waiting: WaitingLinks,
    pub remotes: Remotes,
    pub snapshots: SnapshotSettings,
    /// Whether actuators that come are armed.
    pub armed: bool,
    /// Where the configuration is changed.
    pub database: Option<Database>,
    /// What the playback is controlled by, if a recording is played.
    pub playback: Option<Arc<dyn PlaybackControl>>,
}

impl Composition {
    /// Of no module yet.
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

    /// Where the configuration is changed.
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

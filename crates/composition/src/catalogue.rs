//! Plugins with their kinds of modules, and known properties of other agents.

use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::aspect::ServiceDescription;
use slate_module::{ModuleKind, Plugin};
use slate_sorted::{SortedMap, SortedSet};

use crate::Played;
use crate::RemotePath;
use crate::setup::{Describe, SetUp, describe, set_up};

/// Loaded plugins, dormant kinds of modules, and capabilities of the host.
/// A kind is dormant when its plugin is known but not loaded.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// Plugins in the order of loading.
    pub plugins: Vec<Plugin>,
    /// Kinds by name, with the plugin that brings them.
    pub dormant: SortedMap<String, String>,
    /// Mirrored properties of other agents, by the paths that links name.
    pub remote: SortedMap<RemotePath, RemoteProperty>,
    /// Properties that are played from a recording.
    pub played: Arc<[Played]>,
    /// Support for links to other agents.
    pub shares: bool,
    /// Carriers of their values; any carrier when this is empty.
    pub carriers: SortedSet<String>,
    /// Support for JPEG compression of these values.
    pub has_jpeg: bool,
    /// Services of the host.
    pub services: Vec<ServiceDescription>,
    /// Function that asks a kind for its ports and parameters.
    pub describe: Describe,
    /// Function that makes an instance of a kind on trial.
    pub set_up: SetUp,
}

impl Default for Catalogue {
    /// Creates an empty catalogue.
    /// Kinds describe themselves and are set up in the calling thread.
    fn default() -> Self {
        Self {
            plugins: Vec::new(),
            dormant: SortedMap::new(),
            remote: SortedMap::new(),
            played: Arc::default(),
            shares: false,
            carriers: SortedSet::new(),
            has_jpeg: false,
            services: Vec::new(),
            describe,
            set_up,
        }
    }
}

/// Mirror of another agent's property on the board.
#[derive(Clone, Debug)]
pub struct RemoteProperty {
    /// Path in the other agent.
    pub path: String,
    /// Interface of the property.
    pub descriptor: &'static Descriptor,
    /// Part of the architecture that writes it, such as `monitor`; empty for none.
    pub part: String,
    /// Number of the mirror: how many times the property was put on the board.
    pub epoch: u64,
}

impl Catalogue {
    /// Returns all available kinds.
    pub fn kinds(&self) -> impl Iterator<Item = &ModuleKind> + Clone {
        self.plugins.iter().flat_map(Plugin::kinds)
    }

    /// Returns the kind with that name.
    pub fn kind(&self, name: &str) -> Option<&ModuleKind> {
        self.kinds().find(|kind| kind.name() == name)
    }

    /// Returns whether the kind is dormant: known, but its plugin is not loaded.
    pub fn is_dormant(&self, kind: &str) -> bool {
        self.dormant.contains_key(kind) && self.kind(kind).is_none()
    }

    /// Returns the plugin with that name.
    pub fn plugin(&self, name: &str) -> Option<&Plugin> {
        self.plugins.iter().find(|plugin| plugin.name() == name)
    }

    /// Returns the plugin that brings a kind.
    pub fn plugin_of(&self, kind: &ModuleKind) -> Option<&Plugin> {
        self.plugins.iter().find(|plugin| plugin.kinds().iter().any(|own| own.is(kind)))
    }

    /// Lists all plugins, one per line, as tab-separated columns.
    /// The columns are the name, the version, and 1 if the plugin is loaded, else 0.
    pub fn list(&self) -> String {
        let loaded =
            self.plugins.iter().map(|plugin| format!("{}\t{}\t1\n", plugin.name(), plugin.version_text()));
        let dormant: SortedSet<&String> = self.dormant.values().collect();
        loaded.chain(dormant.into_iter().map(|name| format!("{name}\t\t0\n"))).collect()
    }

    /// Adds a plugin; its kinds are no longer dormant.
    pub fn add(&mut self, plugin: Plugin) {
        self.dormant.retain(|_, owner| owner != plugin.name());
        self.plugins.push(plugin);
    }

    /// Replaces a plugin by another version.
    pub fn replace(&mut self, plugin: &Plugin) {
        let known = self.plugins.iter_mut().find(|other| other.name() == plugin.name());
        if let Some(known) = known {
            *known = plugin.clone();
        }
    }

    /// Removes a plugin; its kinds stay known.
    pub fn remove(&mut self, name: &str) {
        self.plugins.retain(|plugin| {
            let stays = plugin.name() != name;
            if !stays {
                self.dormant.extend(plugin.kinds().iter().map(|kind| (kind.name().into(), name.into())));
            }
            stays
        });
    }
}

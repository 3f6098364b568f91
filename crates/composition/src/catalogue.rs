//! Plugins with their kinds of modules, and known properties of other agents.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::{ModuleKind, Plugin};

use crate::Played;
use crate::RemotePath;
use crate::setup::{Describe, describe};

/// The plugins that are loaded, and kinds of modules whose plugin is known but not loaded.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// In the order of loading.
    pub plugins: Vec<Plugin>,
    /// Kinds by name, with the plugin that brings them.
    pub dormant: BTreeMap<String, String>,
    /// The properties of other agents that are on the board, by what links name.
    pub remote: BTreeMap<RemotePath, RemoteProperty>,
    /// Properties that are played from a recording.
    pub played: Arc<[Played]>,
    /// Whether links may lead to other agents.
    pub shares: bool,
    /// Carriers of their values; any carrier when this is empty.
    pub carriers: BTreeSet<String>,
    /// Whether they can be compressed as JPEG.
    pub has_jpeg: bool,
    /// The services that the host has.
    pub services: Vec<&'static Descriptor>,
    /// Asks a kind for its ports and parameters.
    pub describe: Describe,
}

impl Default for Catalogue {
    /// Empty; kinds describe themselves in the calling thread.
    fn default() -> Self {
        Self {
            plugins: Vec::new(),
            dormant: BTreeMap::new(),
            remote: BTreeMap::new(),
            played: Arc::default(),
            shares: false,
            carriers: BTreeSet::new(),
            has_jpeg: false,
            services: Vec::new(),
            describe,
        }
    }
}

/// A property of another agent, as it is on the board.
#[derive(Clone, Debug)]
pub struct RemoteProperty {
    /// Its path in the other agent.
    pub path: String,
    /// Its interface.
    pub descriptor: &'static Descriptor,
    /// Part of the architecture that writes it, such as `monitor`; empty for none.
    pub part: String,
    /// Number of the time that it was put on the board.
    pub epoch: u64,
}

impl Catalogue {
    /// All kinds that can be used.
    pub fn kinds(&self) -> impl Iterator<Item = &ModuleKind> + Clone {
        self.plugins.iter().flat_map(Plugin::kinds)
    }

    /// The kind of that name.
    pub fn kind(&self, name: &str) -> Option<&ModuleKind> {
        self.kinds().find(|kind| kind.name() == name)
    }

    /// Whether the kind is known, but its plugin is not loaded.
    pub fn is_dormant(&self, kind: &str) -> bool {
        self.dormant.contains_key(kind) && self.kind(kind).is_none()
    }

    /// The plugin of that name.
    pub fn plugin(&self, name: &str) -> Option<&Plugin> {
        self.plugins.iter().find(|plugin| plugin.name() == name)
    }

    /// The plugin that brings a kind.
    pub fn plugin_of(&self, kind: &ModuleKind) -> Option<&Plugin> {
        self.plugins.iter().find(|plugin| plugin.kinds().iter().any(|own| own.is(kind)))
    }

    /// All plugins, a line each: name, version, and whether it is loaded, with tabs between.
    pub fn list(&self) -> String {
        let loaded =
            self.plugins.iter().map(|plugin| format!("{}\t{}\t1\n", plugin.name(), plugin.version_text()));
        let dormant: BTreeSet<&String> = self.dormant.values().collect();
        loaded.chain(dormant.into_iter().map(|name| format!("{name}\t\t0\n"))).collect()
    }

    /// Adds a plugin; its kinds are no longer dormant.
    pub fn add(&mut self, plugin: Plugin) {
        self.dormant.retain(|_, owner| owner != plugin.name());
        self.plugins.push(plugin);
    }

    /// Replaces a plugin by another version.
    pub fn replace(&mut self, plugin: &Plugin) {
        let place = self.plugins.iter_mut().find(|other| other.name() == plugin.name());
        if let Some(place) = place {
            *place = plugin.clone();
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

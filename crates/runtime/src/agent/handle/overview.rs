//! Lists of plugins and modules that are read without a lock of the composition: a change may take long, as it runs
//! modules' code.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};

use slate_blackboard::Board;

use crate::agent::assembly::LoadedModule;
use crate::agent::composition::Composition;
use slate_engine::main_loop::Seat;
use slate_engine::runner::{Health, ModuleCondition};
use slate_module::{Description, Parameter, PortDescription};

/// A plugin of an agent.
#[derive(Clone, Debug)]
pub struct PluginStatus {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// The library that its code comes from, or will when it is loaded by name; none when it is linked in.
    pub file: Option<PathBuf>,
    /// Whether it is loaded; else it is only known.
    pub loaded: bool,
    /// The kinds of modules that it brings.
    pub kinds: Vec<String>,
    /// The modules that run its code.
    pub modules: Vec<String>,
    /// The library with new code that runs beside it, if any does.
    pub shadow: Option<PathBuf>,
}

/// A module of an agent.
#[derive(Clone, Debug)]
pub struct ModuleStatus {
    /// Its name.
    pub name: String,
    /// The kind that it is of.
    pub kind: String,
    /// The plugin that brings the kind.
    pub plugin: String,
    /// How it is, as in its `state`.
    pub condition: &'static str,
    /// The required input without a value, or the service, that it waits for while it is `WAITING`.
    pub waiting_for: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// Ticks beyond the deadline.
    pub misses: u64,
    /// Panics caught; of an isolated module also each other end of its process: a fault, a kill, a step that hung.
    pub panics: u64,
    /// Whether new code runs beside it; how that goes is at its `shadow`.
    pub has_shadow: bool,
}

/// What the agent was made of after the last change.
pub(in crate::agent) struct Overview {
    plugins: Vec<PluginStatus>,
    modules: Vec<ListedModule>,
    /// The module that is the clock.
    time_source: Option<String>,
}

/// A module as it is listed; it keeps neither the module nor its library.
struct ListedModule {
    name: String,
    kind: String,
    plugin: String,
    has_shadow: bool,
    description: Arc<Description>,
    seat: Weak<Seat>,
    health: Arc<Health>,
}

impl Overview {
    pub fn of(composition: &Composition) -> Self {
        let time_source = composition.configuration.time_source().map(|source| source.value.clone());
        Self { plugins: plugins(composition), modules: modules(composition), time_source }
    }

    /// The plugins that are loaded, and those of the configuration that are not.
    pub fn plugins(&self) -> &[PluginStatus] {
        &self.plugins
    }

    /// The modules that there are, with how they are at this moment.
    pub fn modules(&self, board: &Board) -> Vec<ModuleStatus> {
        self.modules.iter().map(|listed| listed.status(board)).collect()
    }

    /// The parameters of a module, with their defaults and ranges; none of one that there is not.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        let listed = self.modules.iter().find(|listed| listed.name == module);
        listed.map(|listed| listed.description.parameters.clone()).unwrap_or_default()
    }

    /// The port of a module at a path.
    pub fn port(&self, path: &str) -> Option<PortDescription> {
        let of = |name: &str| path.strip_prefix(name)?.strip_prefix('/');
        let (port, listed) = self
            .modules
            .iter()
            .filter_map(|listed| Some((of(&listed.name)?, listed)))
            .min_by_key(|(port, _)| port.len())?;
        listed.description.ports.iter().find(|known| known.name == port).cloned()
    }

    /// Whether a module is the agent's clock.
    pub fn is_time_source(&self, module: &str) -> bool {
        self.time_source.as_deref() == Some(module)
    }
}

impl ListedModule {
    fn status(&self, board: &Board) -> ModuleStatus {
        ModuleStatus {
            name: self.name.clone(),
            kind: self.kind.clone(),
            plugin: self.plugin.clone(),
            condition: self.health.condition().name(),
            waiting_for: self.waiting_for(board),
            ticks: self.seat.upgrade().map_or(0, |seat| seat.ticks()),
            misses: self.health.misses.load(Ordering::Relaxed),
            panics: self.health.panics.load(Ordering::Relaxed),
            has_shadow: self.has_shadow,
        }
    }

    /// The port that it waits for, as its state says.
    fn waiting_for(&self, board: &Board) -> Option<String> {
        if self.health.condition() != ModuleCondition::WAITING {
            return None;
        }
        let (value, _) = board.read(&format!("{}/state/waiting_for", self.name)).ok()??;
        value.as_str().filter(|port| !port.is_empty()).map(str::to_owned)
    }
}

fn plugins(composition: &Composition) -> Vec<PluginStatus> {
    let loaded = composition.catalogue.plugins.iter().map(|plugin| PluginStatus {
        name: plugin.name().into(),
        version: plugin.version_text().into(),
        file: composition.plugins.origins.get(plugin.name()).map(|origin| origin.file.clone()),
        loaded: true,
        kinds: plugin.kinds().iter().map(|kind| kind.name().into()).collect(),
        modules: composition.modules_of(&[plugin.name().to_owned()]),
        shadow: composition.plugins.trials.get(plugin.name()).map(|trial| trial.origin.file.clone()),
    });
    let known: BTreeMap<&str, Vec<String>> =
        composition.catalogue.dormant.iter().fold(BTreeMap::new(), |mut known, (kind, plugin)| {
            known.entry(plugin.as_str()).or_default().push(kind.clone());
            known
        });
    // A plugin of the configuration is loaded rather than one of its name that is linked in.
    let entries = composition.configuration.plugins();
    let file = |name: &str| {
        let entry = entries.iter().find(|entry| entry.name.value == name)?;
        entry.file.as_ref().map(|file| file.value.clone())
    };
    let dormant = known.into_iter().map(|(name, kinds)| PluginStatus {
        name: name.into(),
        version: String::new(),
        file: file(name),
        loaded: false,
        kinds,
        modules: Vec::new(),
        shadow: None,
    });
    loaded.chain(dormant).collect()
}

fn modules(composition: &Composition) -> Vec<ListedModule> {
    let listed = |(name, loaded): (&String, &LoadedModule)| {
        let plugin = composition.catalogue.plugin_of(&loaded.kind);
        ListedModule {
            name: name.clone(),
            kind: loaded.kind.name().into(),
            plugin: plugin.map(|plugin| plugin.name().into()).unwrap_or_default(),
            has_shadow: composition.plugins.trials.values().any(|trial| trial.modules.contains(name)),
            description: Arc::clone(&loaded.description),
            seat: Arc::downgrade(&loaded.seat),
            health: Arc::clone(&loaded.seat.health),
        }
    };
    composition.assembly.modules.iter().map(listed).collect()
}

//! Lists of plugins and modules, readable without the composition's lock.
//! A change holds the lock and may take long, as it runs modules' code.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};

use slate_blackboard::Board;
use slate_sorted::SortedMap;

use crate::agent::assembly::LoadedModule;
use crate::agent::composition::Composition;
use slate_engine::main_loop::RunnerCell;
use slate_engine::runner::{Health, ModuleCondition};
use slate_module::{Description, Parameter, PortDescription};

/// State of a plugin.
#[derive(Clone, Debug)]
pub struct PluginStatus {
    /// Name.
    pub name: String,
    /// Version.
    pub version: String,
    /// Library of its code, also before it is loaded by name; `None` if linked in.
    pub file: Option<PathBuf>,
    /// True if it is loaded; else it is only known.
    pub loaded: bool,
    /// Kinds of modules in it.
    pub kinds: Vec<String>,
    /// The modules that run its code.
    pub modules: Vec<String>,
    /// Library of its shadow, if any.
    pub shadow: Option<PathBuf>,
}

/// State of a module.
#[derive(Clone, Debug)]
pub struct ModuleStatus {
    /// Name.
    pub name: String,
    /// Kind of the module.
    pub kind: String,
    /// Plugin of the kind.
    pub plugin: String,
    /// Condition, as in its `state`.
    pub condition: &'static str,
    /// Required input without a value, or service, that it waits for.
    /// Only while it is `WAITING`.
    pub waiting_for: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// Ticks beyond the deadline.
    pub misses: u64,
    /// Panics caught.
    /// For an isolated module also each other end of its process: a fault, a kill, a step that hung.
    pub panics: u64,
    /// True if a shadow runs beside it; the comparison is at its `shadow`.
    pub has_shadow: bool,
}

/// Composition of the agent after the last change.
pub(in crate::agent) struct Overview {
    plugins: Vec<PluginStatus>,
    modules: Vec<ListedModule>,
    /// Module that is the time source.
    time_source: Option<String>,
}

/// Module in a list; it keeps neither the module nor its library.
struct ListedModule {
    name: String,
    kind: String,
    /// Documentation of the kind.
    doc: String,
    plugin: String,
    has_shadow: bool,
    description: Arc<Description>,
    cell: Weak<RunnerCell>,
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

    /// Lists the modules with their present conditions.
    pub fn modules(&self, board: &Board) -> Vec<ModuleStatus> {
        self.modules.iter().map(|listed| listed.status(board)).collect()
    }

    /// Parameters of a module with their defaults and ranges; empty if it is unknown.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        let listed = self.modules.iter().find(|listed| listed.name == module);
        listed.map(|listed| listed.description.parameters.clone()).unwrap_or_default()
    }

    /// Documentation of a module's kind, and its description; `None` if unknown.
    pub fn documentation(&self, module: &str) -> Option<(String, Arc<Description>)> {
        let listed = self.modules.iter().find(|listed| listed.name == module)?;
        Some((listed.doc.clone(), Arc::clone(&listed.description)))
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

    /// Returns true if a module is the agent's time source.
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
            ticks: self.cell.upgrade().map_or(0, |cell| cell.ticks()),
            misses: self.health.misses.load(Ordering::Relaxed),
            panics: self.health.panics.load(Ordering::Relaxed),
            has_shadow: self.has_shadow,
        }
    }

    /// Returns the port that the module waits for, according to its state.
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
    let known: SortedMap<&str, Vec<String>> =
        composition.catalogue.dormant.iter().fold(SortedMap::new(), |mut known, (kind, plugin)| {
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
            doc: loaded.kind.doc().into(),
            plugin: plugin.map(|plugin| plugin.name().into()).unwrap_or_default(),
            has_shadow: composition.plugins.trials.values().any(|trial| trial.modules.contains(name)),
            description: Arc::clone(&loaded.description),
            cell: Arc::downgrade(&loaded.cell),
            health: Arc::clone(&loaded.cell.health),
        }
    };
    composition.assembly.modules.iter().map(listed).collect()
}

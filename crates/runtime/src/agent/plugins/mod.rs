//! Loading, unloading and code exchange of plugins.

mod error;
mod exchange;
mod gather;
mod reload;
mod removal;
mod shadow;
mod trial;
mod version;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_blackboard::nearest_names;
use slate_module::{ModuleKind, Plugin, Setup};
use slate_sorted::{SortedMap, SortedSet};

use super::assembly::ModuleStates;
use super::composition::{Composition, CompositionTarget};
use super::handle::AgentHandle;
use crate::recording::Change;
pub use error::PluginError;
use gather::Gathered;
pub(super) use gather::{catalogue, host_catalogue};
pub(super) use reload::Reloader;
use removal::ModuleRemoval;
pub(super) use shadow::ShadowRunner;
use slate_composition::{Catalogue, scope};
use slate_configuration::Configuration;
use slate_engine::plugin;
use trial::ModuleTrials;

/// Modules, each with the result for its state.
/// The state is carried over, or the error is the reason for which the module began afresh.
pub type CarriedStates = Vec<(String, Result<(), String>)>;

/// Result of loading plugins.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// Plugins, each with its library; `None` if linked in.
    pub plugins: Vec<(String, Option<PathBuf>)>,
    /// The modules.
    pub modules: Vec<String>,
}

/// Result of a reload.
#[derive(Clone, Debug)]
pub struct Reload {
    /// The plugin.
    pub plugin: String,
    /// Modules.
    pub modules: CarriedStates,
    /// True if all modules kept their ports, with an exchange between two ticks.
    /// Else the ports are new, and the modules were absent for some cycles.
    pub in_place: bool,
    /// State of the old library's memory.
    pub old_library: &'static str,
}

/// Returns the part that is unique in a robot, such as its Plan.
/// Empty for kinds of modules that are no such part.
fn unique_part(kind: &ModuleKind) -> String {
    let setup = Setup { name: kind.name(), seed: 0, period: 20_000_000, section: None, params: None };
    // A kind that refuses these settings is reported when its module is created.
    kind.describe(&setup).map(|own| own.unique).unwrap_or_default()
}

/// Returns the unique parts of the configuration's unnamed robot.
fn own_parts(target: &CompositionTarget) -> SortedSet<String> {
    let modules = target.configuration.modules().iter();
    let own = modules.filter(|module| scope(&module.name.value).is_empty());
    own.filter_map(|module| target.catalogue.kind(&module.kind.value)).map(unique_part).collect()
}

/// Loader of plugins.
pub(super) struct PluginLoader<'c> {
    agent: &'c AgentHandle,
}

impl<'c> PluginLoader<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Loads the plugins of the start: linked ones, and the configuration's.
    /// Returns the modules that took over a state, or the reason for which they did not.
    pub fn start(
        &self,
        linked: &[Plugin],
        states: &ModuleStates,
    ) -> Result<SortedMap<String, Result<(), String>>, PluginError> {
        let mut composition = self.agent.composition();
        composition.plugins.linked = linked.to_vec();
        let mut gathered = Gathered::new(&composition);
        gathered.all()?;
        let (catalogue, origins, _) = gathered.done();
        composition.plugins.origins = origins;
        let target = composition.target(|known| *known = catalogue);
        Ok(composition.change(target, &self.agent.shared, states)?.restored)
    }

    /// Loads a plugin, or a list of plugins, of the configuration.
    /// The plugins that it depends on are loaded too.
    pub fn load(&self, name: &str) -> Result<Loaded, PluginError> {
        self.bring(name, None, |gathered| gathered.named_afresh(name))
    }

    /// Loads a plugin's library, as [`load`](PluginLoader::load) does.
    pub fn load_library(&self, file: &Path) -> Result<Loaded, PluginError> {
        let path = std::path::absolute(file).unwrap_or_else(|_| file.into());
        self.bring("", Some(path), |gathered| gathered.library(file, None))
    }

    fn bring(
        &self,
        name: &str,
        file: Option<PathBuf>,
        gather: impl FnOnce(&mut Gathered<'_>) -> Result<(), PluginError>,
    ) -> Result<Loaded, PluginError> {
        let mut composition = self.agent.composition();
        let mut gathered = Gathered::new(&composition);
        gather(&mut gathered)?;
        let (catalogue, origins, came) = gathered.done();
        let mut target = composition.target(|known| *known = catalogue);
        let mut parts = own_parts(&target);
        for (plugin, kind) in
            came.iter().flat_map(|plugin| plugin.kinds().iter().map(move |kind| (plugin, kind)))
        {
            let modules = target.configuration.modules();
            let wanted = modules.iter().any(|module| module.kind.value == kind.name());
            let taken = modules.iter().any(|module| module.name.value == kind.name());
            // A robot has one Plan, one Execute and one Knowledge: a second kind of them gets no module.
            let part = unique_part(kind);
            let fits = part.is_empty() || !parts.contains(&part);
            if !wanted && !taken && fits {
                parts.insert(part);
                let origin = origins.get(plugin.name());
                let origin = origin.map_or_else(
                    || plugin.name().into(),
                    |origin| slate_configuration::printable(&origin.file),
                );
                let with = target.configuration.with_module(kind.name(), kind.name(), &origin);
                target.configuration = Arc::new(with);
            }
        }
        let codes = came.iter().filter_map(|plugin| plugin.kinds().iter().find_map(plugin::code_of));
        let load = Change::Load { name: name.into(), file, hash: codes.fold(0, u64::wrapping_add) };
        let changed = self
            .agent
            .recorder
            .make(vec![load], || composition.change(target, &self.agent.shared, &ModuleStates::new()))?;
        composition.plugins.origins = origins;
        let file = |name: &str| composition.plugins.origins.get(name).map(|origin| origin.file.clone());
        let plugins: Vec<_> = came.iter().map(|plugin| (plugin.name().into(), file(plugin.name()))).collect();
        for (name, file) in &plugins {
            let code =
                file.as_ref().map_or_else(|| "linked in".into(), |file| slate_configuration::printable(file));
            self.agent.say(&format!("plugin {name} is loaded ({code}); modules: {}", list(&changed.arrived)));
        }
        Ok(Loaded { plugins, modules: changed.arrived })
    }

    /// Unloads a plugin, or the plugins of a list in reverse order.
    /// Their modules end, their outputs take their safe values, and their last values stay where others read them.
    pub fn unload(&self, name: &str) -> Result<Vec<(String, &'static str)>, PluginError> {
        let mut composition = self.agent.composition();
        let configuration = Arc::clone(&composition.configuration);
        let mut names = Vec::new();
        gather::expand(configuration.plugins(), name, &mut names);
        names.reverse();
        names.retain(|name| composition.catalogue.plugin(name).is_some());
        if names.is_empty() {
            return Err(match not_loaded(&composition, name) {
                PluginError::List { name, .. } => PluginError::NoneLoaded { name },
                other => other,
            });
        }
        for name in &names {
            let others = composition
                .catalogue
                .plugins
                .iter()
                .filter(|plugin| !names.iter().any(|own| own == plugin.name()));
            let by: Vec<String> = others
                .filter(|plugin| plugin.dependencies().contains(name))
                .map(|plugin| plugin.name().to_owned())
                .collect();
            if !by.is_empty() {
                return Err(PluginError::Needed { name: name.clone(), by });
            }
        }
        let leaving = composition.modules_of(&names);
        let unload = Change::Unload { name: name.into() };
        let _closed = self.agent.recorder.make(vec![unload], || -> Result<_, PluginError> {
            let removal = ModuleRemoval::new(&self.agent.shared, &leaving);
            removal.check_vetoes(&composition)?;
            let mut target =
                composition.target(|catalogue| names.iter().for_each(|name| catalogue.remove(name)));
            target.configuration = Arc::new(target.configuration.without_loaded(&leaving));
            // Before anything is ended for it.
            composition.check(&target)?;
            let closed = removal.end_threads(&composition)?;
            // New code beside a module ends with it.
            for name in &names {
                ModuleTrials::new(&self.agent.shared).end(&mut composition, name);
            }
            // Removed parts are dropped before the libraries are checked.
            drop(composition.change(target, &self.agent.shared, &ModuleStates::new())?);
            Ok(closed)
        })?;
        let residence = |name: String| {
            let origin = composition.plugins.origins.remove(&name);
            let state = origin.map_or("linked in", |origin| origin.residence.describe());
            self.agent.say(&format!("plugin {name} is unloaded; its library is {state}"));
            (name, state)
        };
        Ok(names.into_iter().map(residence).collect())
    }

    /// Returns true if a module runs code of a plugin, or of one of a list.
    pub fn runs(&self, module: &str, name: &str) -> bool {
        let composition = self.agent.composition();
        let mut names = Vec::new();
        // A list in a circle is refused when it is unloaded.
        gather::expand(composition.configuration.plugins(), name, &mut names);
        composition.modules_of(&names).iter().any(|own| own == module)
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

/// Returns the error for a plugin that has no code to exchange or unload.
fn not_loaded(composition: &Composition, name: &str) -> PluginError {
    let entries = composition.configuration.plugins();
    let entry = entries.iter().find(|entry| entry.name.value == name);
    if entry.is_some_and(|entry| entry.members.is_some()) {
        let mut members = Vec::new();
        gather::expand(entries, name, &mut members);
        return PluginError::List { name: name.into(), members };
    }
    let is_known = entry.is_some()
        || composition.plugins.linked.iter().any(|plugin| plugin.name() == name)
        || composition.catalogue.dormant.values().any(|plugin| plugin == name);
    if is_known {
        PluginError::NotLoaded { name: name.into() }
    } else {
        unknown(&composition.configuration, &composition.catalogue, name)
    }
}

fn unknown(configuration: &Configuration, catalogue: &Catalogue, name: &str) -> PluginError {
    let loaded = catalogue.plugins.iter().map(Plugin::name);
    let known = configuration.plugins().iter().map(|entry| entry.name.value.as_str());
    PluginError::Unknown { name: name.into(), near: nearest_names(name, loaded.chain(known)) }
}

//! Plugins come, go, and exchange their code.

mod departure;
mod error;
mod exchange;
mod gather;
mod reload;
mod shadow;
mod trial;
mod version;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_blackboard::nearest_names;
use slate_module::{ModuleKind, Plugin, Setup};

use super::assembly::ModuleStates;
use super::composition::{Composition, CompositionTarget};
use super::handle::AgentHandle;
use crate::recording::Change;
use departure::Departure;
pub use error::PluginError;
use gather::Gathered;
pub(super) use gather::{catalogue, host_catalogue};
pub(super) use reload::Reloader;
pub(super) use shadow::ShadowRunner;
use slate_composition::{Catalogue, scope};
use slate_configuration::Configuration;
use slate_engine::plugin;
use trial::ModuleTrials;

/// Modules, each with what became of its state: carried over, or why it began afresh.
pub type CarriedStates = Vec<(String, Result<(), String>)>;

/// What a load has brought.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The plugins, each with its library; none when it is linked in.
    pub plugins: Vec<(String, Option<PathBuf>)>,
    /// The modules.
    pub modules: Vec<String>,
}

/// What a reload came to.
#[derive(Clone, Debug)]
pub struct Reload {
    /// The plugin.
    pub plugin: String,
    /// Its modules.
    pub modules: CarriedStates,
    /// Whether each module went on with its ports, between two ticks; else they are other ports now, and the modules
    /// were away for some cycles.
    pub in_place: bool,
    /// What became of the old library's memory.
    pub old_library: &'static str,
}

/// What a robot has once that a kind of module is, such as its Plan; empty for others.
fn unique_part(kind: &ModuleKind) -> String {
    let setup = Setup { name: kind.name(), seed: 0, period: 20_000_000, section: None, params: None };
    // A kind that refuses these settings is reported when its module is created.
    kind.describe(&setup).map(|own| own.unique).unwrap_or_default()
}

/// The parts of the robot without a name that the configuration has.
fn own_parts(target: &CompositionTarget) -> BTreeSet<String> {
    let modules = target.configuration.modules().iter();
    let own = modules.filter(|module| scope(&module.name.value).is_empty());
    own.filter_map(|module| target.catalogue.kind(&module.kind.value)).map(unique_part).collect()
}

/// Loads and unloads plugins.
pub(super) struct PluginLoader<'c> {
    agent: &'c AgentHandle,
}

impl<'c> PluginLoader<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Loads what the agent begins with: the plugins that are linked in, and those of the configuration. Returns which modules
    /// took over a state, or why they did not.
    pub fn start(
        &self,
        linked: &[Plugin],
        states: &ModuleStates,
    ) -> Result<BTreeMap<String, Result<(), String>>, PluginError> {
        let mut composition = self.agent.composition();
        composition.plugins.linked = linked.to_vec();
        let mut gathered = Gathered::new(&composition);
        gathered.all()?;
        let (catalogue, origins, _) = gathered.done();
        composition.plugins.origins = origins;
        let target = composition.target(|known| *known = catalogue);
        Ok(composition.change(target, &self.agent.shared, states)?.restored)
    }

    /// Loads a plugin, or a list of plugins, of the configuration, with the plugins that it needs.
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

    /// Unloads a plugin, or the plugins of a list in reverse order: their modules end, their outputs get their safe
    /// values, and what they wrote last stays where others read it.
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
            let departure = Departure::new(self.agent, &leaving);
            departure.ask(&composition)?;
            let mut target =
                composition.target(|catalogue| names.iter().for_each(|name| catalogue.remove(name)));
            target.configuration = Arc::new(target.configuration.without_loaded(&leaving));
            // Before anything is ended for it.
            composition.check(&target)?;
            let closed = departure.end_threads(&composition)?;
            // New code beside a module ends with it.
            for name in &names {
                ModuleTrials::new(self.agent).end(&mut composition, name);
            }
            // What left is dropped before the libraries are looked at.
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

    /// Whether a module runs code of that plugin, or of one of that list.
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

/// Why there is no code of a plugin that could be exchanged or unloaded.
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

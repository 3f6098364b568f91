//! Changes of an agent while it runs: plugins come, go, and exchange their code.

mod actuators;
mod error;
mod exchange;
mod gather;
mod links;
mod overview;
mod reload;
mod shadow;
mod teleoperation;
mod threads;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, TryLockError, Weak};
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_blackboard::{Board, BoardError, nearest_names};
use slate_module::{Level, ModuleKind, Parameter, Plugin, PortDescription};

use super::composition::Composition;
use super::memory::States;
use crate::configuration::Configuration;
use crate::log::Levels;
use crate::main_loop::Shared;
use crate::plugin::{self, Residence};
use crate::recording::{Change, Recording};
pub use error::PluginError;
pub use gather::catalogue;
pub(super) use gather::host_catalogue;
use gather::{Gathered, LibraryWatch, PluginSources};
pub use links::RemoteEnd;
pub use links::{LinkStatus, NewLink};
use overview::{Held, Overview};
pub use reload::Reload;
pub(super) use shadow::Trial;
use slate_composition::Catalogue;
pub use teleoperation::{ControlsError, ControlsHolder, Teleoperation};

/// Changes an agent, from any thread and while it runs. One change is made at a time.
#[derive(Clone)]
pub struct Composer {
    pub(super) shared: Arc<Shared>,
    composition: Arc<Mutex<Composition>>,
    overview: Arc<Mutex<Overview>>,
    /// What records the agent.
    pub(super) recording: Option<Arc<dyn Recording>>,
}

impl std::fmt::Debug for Composer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Composer").field("agent", &self.shared.board.agent()).finish_non_exhaustive()
    }
}

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

/// What a load has brought.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The plugins, each with its library; none when it is linked in.
    pub plugins: Vec<(String, Option<PathBuf>)>,
    /// The modules.
    pub modules: Vec<String>,
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
    /// Ticks made.
    pub ticks: u64,
    /// Ticks beyond the deadline.
    pub misses: u64,
    /// Panics caught; of an isolated module also each other end of its process: a fault, a kill, a step that hung.
    pub panics: u64,
    /// Whether new code runs beside it; how that goes is at its `shadow`.
    pub has_shadow: bool,
}

/// Where a plugin's code comes from.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    pub file: PathBuf,
    pub residence: Residence,
}

/// A composer that does not keep its agent.
#[derive(Clone, Default)]
pub struct WeakComposer {
    shared: Weak<Shared>,
    composition: Weak<Mutex<Composition>>,
    overview: Weak<Mutex<Overview>>,
    recording: Option<Weak<dyn Recording>>,
}

impl std::fmt::Debug for WeakComposer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WeakComposer").finish_non_exhaustive()
    }
}

impl WeakComposer {
    /// The composer, as long as the agent is there.
    pub fn upgrade(&self) -> Option<Composer> {
        Some(Composer {
            shared: self.shared.upgrade()?,
            composition: self.composition.upgrade()?,
            overview: self.overview.upgrade()?,
            recording: match &self.recording {
                Some(recording) => Some(recording.upgrade()?),
                None => None,
            },
        })
    }
}

impl Composer {
    /// This composer, for somebody who does not keep the agent.
    pub fn downgrade(&self) -> WeakComposer {
        WeakComposer {
            shared: Arc::downgrade(&self.shared),
            composition: Arc::downgrade(&self.composition),
            overview: Arc::downgrade(&self.overview),
            recording: self.recording.as_ref().map(Arc::downgrade),
        }
    }

    pub(super) fn new(
        shared: Arc<Shared>,
        composition: Composition,
        recording: Option<Arc<dyn Recording>>,
    ) -> Self {
        let overview = Arc::new(Mutex::new(Overview::of(&composition)));
        let composer = Self { shared, composition: Arc::new(Mutex::new(composition)), overview, recording };
        let own = composer.downgrade();
        composer.composition().own = own;
        composer
    }

    /// What the agent is made of, for one change at a time; what came of it is shown when it is let go.
    pub(super) fn composition(&self) -> Held<'_> {
        let composition = self.composition.lock().unwrap_or_else(PoisonError::into_inner);
        Held { composition, overview: &self.overview }
    }

    /// What the agent is made of, unless somebody else has it now.
    pub(super) fn try_composition(&self) -> Option<Held<'_>> {
        let composition = match self.composition.try_lock() {
            Ok(composition) => composition,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        Some(Held { composition, overview: &self.overview })
    }

    /// Loads what the agent begins with: the plugins that are linked in, and those of the configuration. Returns which modules
    /// took over a state, or why they did not.
    pub(super) fn start(
        &self,
        linked: &[Plugin],
        states: &States,
    ) -> Result<BTreeMap<String, Result<(), String>>, PluginError> {
        let mut composition = self.composition();
        composition.linked = linked.to_vec();
        let mut gathered = Gathered::new(&composition);
        gathered.all()?;
        let (catalogue, origins, _) = gathered.done();
        composition.origins = origins;
        let target = composition.target(|present| *present = catalogue);
        Ok(composition.change(target, &self.shared, states)?.restored)
    }

    /// Loads a plugin, or a list of plugins, of the configuration, with the plugins that it needs. The modules of the
    /// configuration that are of its kinds begin; a kind of which there is none gets a module of its name.
    ///
    /// # Errors
    /// What does not fit; nothing is loaded then.
    pub fn load(&self, name: &str) -> Result<Loaded, PluginError> {
        self.bring(name, None, |gathered| gathered.named_afresh(name))
    }

    /// Loads a plugin's library, as [`load`](Composer::load) does.
    ///
    /// # Errors
    /// What does not fit; nothing is loaded then.
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
        let mut composition = self.composition();
        let mut gathered = Gathered::new(&composition);
        gather(&mut gathered)?;
        let (catalogue, origins, came) = gathered.done();
        let mut target = composition.target(|present| *present = catalogue);
        for (plugin, kind) in
            came.iter().flat_map(|plugin| plugin.kinds().iter().map(move |kind| (plugin, kind)))
        {
            let modules = target.configuration.modules();
            let wanted = modules.iter().any(|module| module.kind.value == kind.name());
            let taken = modules.iter().any(|module| module.name.value == kind.name());
            if !wanted && !taken {
                let origin = origins.get(plugin.name());
                let origin =
                    origin.map_or_else(|| plugin.name().into(), |origin| crate::printable(&origin.file));
                let with = target.configuration.with_module(kind.name(), kind.name(), &origin);
                target.configuration = Arc::new(with);
            }
        }
        let codes = came.iter().filter_map(|plugin| plugin.kinds().iter().find_map(plugin::code_of));
        let load = Change::Load { name: name.into(), file, hash: codes.fold(0, u64::wrapping_add) };
        let changed =
            self.make_recorded(vec![load], || composition.change(target, &self.shared, &BTreeMap::new()))?;
        composition.origins = origins;
        let file = |name: &str| composition.origins.get(name).map(|origin| origin.file.clone());
        let plugins: Vec<_> = came.iter().map(|plugin| (plugin.name().into(), file(plugin.name()))).collect();
        for (name, file) in &plugins {
            let code = file.as_ref().map_or_else(|| "linked in".into(), |file| crate::printable(file));
            self.say(&format!("plugin {name} is loaded ({code}); modules: {}", list(&changed.arrived)));
        }
        Ok(Loaded { plugins, modules: changed.arrived })
    }

    /// Unloads a plugin, or the plugins of a list in reverse order: their modules end, their outputs get their safe
    /// values, and what they wrote last stays where others read it. Says what became of each library's memory.
    ///
    /// # Errors
    /// When another plugin needs it, a module does not let itself be unloaded, or has not returned from its tick.
    pub fn unload(&self, name: &str) -> Result<Vec<(String, &'static str)>, PluginError> {
        let mut composition = self.composition();
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
        let _closed = self.make_recorded(vec![unload], || -> Result<_, PluginError> {
            self.ask(&composition, &leaving)?;
            let mut target =
                composition.target(|catalogue| names.iter().for_each(|name| catalogue.remove(name)));
            target.configuration = Arc::new(target.configuration.without_loaded(&leaving));
            // Before anything is ended for it.
            composition.check(&target)?;
            let closed = self.end_threads(&composition, &leaving)?;
            // New code beside a module ends with it.
            for name in &names {
                self.end_trial(&mut composition, name);
            }
            // What left is dropped before the libraries are looked at.
            drop(composition.change(target, &self.shared, &BTreeMap::new())?);
            Ok(closed)
        })?;
        let residence = |name: String| {
            let origin = composition.origins.remove(&name);
            let state = origin.map_or("linked in", |origin| origin.residence.describe());
            self.say(&format!("plugin {name} is unloaded; its library is {state}"));
            (name, state)
        };
        Ok(names.into_iter().map(residence).collect())
    }

    /// Whether modules may be unloaded now.
    fn ask(&self, composition: &Composition, modules: &[String]) -> Result<(), PluginError> {
        if let Some(source) = composition.configuration.time_source()
            && modules.contains(&source.value)
        {
            return Err(PluginError::TimeSource { module: source.value.clone() });
        }
        for module in modules {
            let present = &composition.present[module];
            let (own, seat) = (present.own_thread, Arc::clone(&present.seat));
            let veto = self.shared.with_seats(&[Arc::clone(&seat)], own, move || {
                let (kind, instance) = {
                    // SAFETY: between two steps the runner is not in use; the reference ends before the call.
                    let runner = unsafe { seat.runner() };
                    (runner.kind.clone(), runner.instance)
                };
                if instance.is_null() {
                    // It has failed for good, so nobody is left to object.
                    return Some(Ok(()));
                }
                // SAFETY: the instance is of that kind, and between two ticks it belongs to this call.
                seat.call(own, || unsafe { kind.may_unload(instance) })
            });
            match veto {
                Some(Ok(())) => {}
                Some(Err(refusal)) => {
                    return Err(PluginError::Veto { module: module.clone(), reason: refusal.0 });
                }
                None => return Err(PluginError::Late { module: module.clone() }),
            }
        }
        Ok(())
    }

    /// Whether a module runs code of that plugin, or of one of that list.
    pub(crate) fn runs(&self, module: &str, name: &str) -> bool {
        let composition = self.composition();
        let mut names = Vec::new();
        // A list in a circle is refused when it is unloaded.
        gather::expand(composition.configuration.plugins(), name, &mut names);
        composition.modules_of(&names).iter().any(|own| own == module)
    }

    /// Switches a module on or off.
    ///
    /// # Errors
    /// When there is no such module, or another module switches it.
    pub fn enable(&self, module: &str, on: bool) -> Result<(), BoardError> {
        let (path, value) = (format!("{module}/enabled/value"), Value::Bool(on));
        let change = Change::Setting { path: format!("{module}/enabled"), value: Some(on.to_string()) };
        self.make_recorded(vec![change], || self.shared.board.write(&path, &value, self.now()).map(drop))
    }

    /// The parameters of a module, with their defaults and ranges; none of one that there is not.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        self.composition()
            .present
            .get(module)
            .map(|seat| seat.description.parameters.clone())
            .unwrap_or_default()
    }

    /// The port of a module at a path.
    pub fn port(&self, path: &str) -> Option<PortDescription> {
        let composition = self.composition();
        let of = |name: &String| path.strip_prefix(name.as_str())?.strip_prefix('/');
        let (port, seat) = composition
            .present
            .iter()
            .filter_map(|(name, seat)| Some((of(name)?, seat)))
            .min_by_key(|(port, _)| port.len())?;
        seat.description.ports.iter().find(|known| known.name == port).cloned()
    }

    /// The default of a module's parameter.
    pub(crate) fn default_of(&self, module: &str, parameter: &str) -> Option<Value> {
        let composition = self.composition();
        let parameters = &composition.present.get(module)?.description.parameters;
        parameters.iter().find(|known| known.name == parameter).map(|known| known.default.clone())
    }

    /// What records the agent, if anything does.
    pub fn recording(&self) -> Option<&dyn Recording> {
        self.recording.as_deref()
    }

    /// Everything that the robot knows.
    pub fn board(&self) -> &Arc<Board> {
        &self.shared.board
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.shared.clock.now()
    }

    /// Writes a line into the log.
    pub fn say(&self, text: &str) {
        self.log(Level::Info, text);
    }

    pub(super) fn set_log_levels(&self, levels: Levels) {
        self.shared.logger.set_levels(levels);
    }

    /// Waits until what was logged so far is written, but not longer than `limit`.
    pub fn flush_log(&self, limit: Duration) {
        self.shared.logger.flush(limit);
    }

    /// Writes a line of that level into the log.
    pub fn log(&self, level: Level, text: &str) {
        self.shared.logger.log(self.now(), level, text);
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
        || composition.linked.iter().any(|plugin| plugin.name() == name)
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

impl Composition {
    /// Starts the threads of modules that have their own.
    pub(super) fn start_threads(&self, shared: &Arc<Shared>) -> std::io::Result<()> {
        let mut threads = shared.threads();
        self.present
            .values()
            .filter(|present| present.own_thread)
            .try_for_each(|present| threads.start(shared, &present.seat))
    }

    /// Where plugins come from.
    fn sources(&self) -> PluginSources<'_> {
        PluginSources {
            configuration: &self.configuration,
            linked: &self.linked,
            program: self.ground.arenas.program.as_deref(),
            watch: self.libraries.as_ref().map(|known| LibraryWatch {
                known,
                logger: &self.ground.logger,
                clock: &self.ground.means.clock,
            }),
        }
    }

    /// The modules that run code of those plugins.
    fn modules_of(&self, plugins: &[String]) -> Vec<String> {
        let of = |kind: &ModuleKind| {
            self.catalogue
                .plugin_of(kind)
                .is_some_and(|plugin| plugins.iter().any(|own| own == plugin.name()))
        };
        self.present.iter().filter(|(_, present)| of(&present.kind)).map(|(name, _)| name.clone()).collect()
    }
}

//! What an agent is made of, for who only looks: a change may take long, as it runs modules' code, and nobody waits for
//! it to read a list.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use super::{Composer, ModuleStatus, PluginStatus};
use crate::agent::composition::Composition;
use crate::main_loop::Seat;
use crate::runner::{Health, ModuleCondition};

/// What the agent was made of after the last change.
pub(crate) struct Overview {
    plugins: Vec<PluginStatus>,
    modules: Vec<Listed>,
    /// The module that is the clock.
    time_source: Option<String>,
}

/// A module as it is listed; it keeps neither the module nor its library.
struct Listed {
    name: String,
    kind: String,
    plugin: String,
    has_shadow: bool,
    seat: Weak<Seat>,
    health: Arc<Health>,
}

/// What the agent is made of, held for a change or a look.
pub(in crate::agent) struct Held<'c> {
    pub(super) composition: MutexGuard<'c, Composition>,
    pub(super) overview: &'c Mutex<Overview>,
}

impl Deref for Held<'_> {
    type Target = Composition;

    fn deref(&self) -> &Composition {
        &self.composition
    }
}

impl DerefMut for Held<'_> {
    fn deref_mut(&mut self) -> &mut Composition {
        &mut self.composition
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        let overview = Overview::of(&self.composition);
        *self.overview.lock().unwrap_or_else(PoisonError::into_inner) = overview;
    }
}

impl Overview {
    pub(super) fn of(composition: &Composition) -> Self {
        let time_source = composition.configuration.time_source().map(|source| source.value.clone());
        Self { plugins: plugins(composition), modules: modules(composition), time_source }
    }
}

fn plugins(composition: &Composition) -> Vec<PluginStatus> {
    let loaded = composition.catalogue.plugins.iter().map(|plugin| PluginStatus {
        name: plugin.name().into(),
        version: plugin.version_text().into(),
        file: composition.origins.get(plugin.name()).map(|origin| origin.file.clone()),
        loaded: true,
        kinds: plugin.kinds().iter().map(|kind| kind.name().into()).collect(),
        modules: composition.modules_of(&[plugin.name().to_owned()]),
        shadow: composition.trials.get(plugin.name()).map(|trial| trial.origin.file.clone()),
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

fn modules(composition: &Composition) -> Vec<Listed> {
    let listed = |(name, present): (&String, &crate::agent::composition::Present)| {
        let plugin = composition.catalogue.plugin_of(&present.kind);
        Listed {
            name: name.clone(),
            kind: present.kind.name().into(),
            plugin: plugin.map(|plugin| plugin.name().into()).unwrap_or_default(),
            has_shadow: composition.trials.values().any(|trial| trial.modules.contains(name)),
            seat: Arc::downgrade(&present.seat),
            health: Arc::clone(&present.seat.health),
        }
    };
    composition.present.iter().map(listed).collect()
}

impl Composer {
    fn overview(&self) -> MutexGuard<'_, Overview> {
        self.overview.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The plugins that are loaded, and those of the configuration that are not. During a change they are those from
    /// before it.
    pub fn plugins(&self) -> Vec<PluginStatus> {
        self.overview().plugins.clone()
    }

    /// The modules that there are, with how they are at this moment. During a change they are those from before it.
    pub fn modules(&self) -> Vec<ModuleStatus> {
        let status = |listed: &Listed| ModuleStatus {
            name: listed.name.clone(),
            kind: listed.kind.clone(),
            plugin: listed.plugin.clone(),
            condition: listed.health.condition().name(),
            waiting_for: self.waiting_for(listed),
            ticks: listed.seat.upgrade().map_or(0, |seat| seat.ticks()),
            misses: listed.health.misses.load(Ordering::Relaxed),
            panics: listed.health.panics.load(Ordering::Relaxed),
            has_shadow: listed.has_shadow,
        };
        self.overview().modules.iter().map(status).collect()
    }

    /// The port that a module waits for, as its state says.
    fn waiting_for(&self, listed: &Listed) -> Option<String> {
        if listed.health.condition() != ModuleCondition::WAITING {
            return None;
        }
        let (value, _) = self.shared.board.read(&format!("{}/state/waiting_for", listed.name)).ok()??;
        value.as_str().filter(|port| !port.is_empty()).map(str::to_owned)
    }

    /// Whether a module is the agent's clock.
    pub fn is_time_source(&self, module: &str) -> bool {
        self.overview().time_source.as_deref() == Some(module)
    }
}

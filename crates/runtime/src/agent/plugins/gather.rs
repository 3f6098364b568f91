//! Collection of new plugins, in the order of their dependencies.
//! The result is a catalogue that contains them; the agent is not changed yet.

use std::path::Path;

use slate_blackboard::interface::Descriptor;
use slate_module::{Level, Plugin, Setup};
use slate_sorted::SortedMap;

use super::{PluginError, unknown};
use crate::agent::composition::{Composition, LibraryOrigin};
use crate::sharing::Sharing;
use slate_composition::Catalogue;
use slate_configuration::{Configuration, PluginEntry};
use slate_engine::clock::Clock;
use slate_engine::log::Logger;
use slate_engine::plugin::{self, KnownLibraries, LibraryError, LibraryOutline, Residence};

/// Sources of plugins.
#[derive(Clone, Copy)]
pub(super) struct PluginSources<'a> {
    pub configuration: &'a Configuration,
    /// The plugins that are linked into the program.
    pub linked: &'a [Plugin],
    /// Program that runs isolated modules; `None` for this program.
    pub program: Option<&'a Path>,
    /// Watch for changed libraries, if any.
    pub watch: Option<LibraryWatch<'a>>,
    /// Log of the agent; `None` if there is no agent.
    pub log: Option<PluginLog<'a>>,
}

/// Log of an agent, with its time.
#[derive(Clone, Copy)]
pub(super) struct PluginLog<'a> {
    logger: &'a Logger,
    clock: &'a Clock,
}

impl PluginLog<'_> {
    fn log(self, level: Level, text: &str) {
        self.logger.log(self.clock.now(), level, text);
    }
}

/// Watch for libraries that have changed since their last load.
#[derive(Clone, Copy)]
pub(super) struct LibraryWatch<'a> {
    known: &'a KnownLibraries,
    log: PluginLog<'a>,
}

pub(super) struct Gathered<'a> {
    sources: PluginSources<'a>,
    catalogue: Catalogue,
    origins: SortedMap<String, LibraryOrigin>,
    came: Vec<Plugin>,
    /// Plugins whose dependencies are being loaded.
    open: Vec<String>,
    /// True if errors of a library point to its line of the configuration.
    /// This is the case when no other request caused the load.
    shows_places: bool,
}

impl<'a> Gathered<'a> {
    pub fn new(composition: &'a Composition) -> Self {
        let catalogue = composition.catalogue.clone();
        let origins = composition.plugins.origins.clone();
        Self { origins, ..Self::with(PluginSources::of(composition), catalogue) }
    }

    pub fn with(sources: PluginSources<'a>, catalogue: Catalogue) -> Self {
        Self {
            sources,
            catalogue,
            origins: SortedMap::new(),
            came: Vec::new(),
            open: Vec::new(),
            shows_places: false,
        }
    }

    /// Returns the catalogue, the origins of libraries, and the new plugins.
    pub fn done(self) -> (Catalogue, SortedMap<String, LibraryOrigin>, Vec<Plugin>) {
        (self.catalogue, self.origins, self.came)
    }

    /// Collects the plugins of the start: linked ones, and the configuration's.
    pub fn all(&mut self) -> Result<(), PluginError> {
        self.shows_places = true;
        self.linked(self.sources.linked)?;
        let configured = self.sources.configuration.plugins();
        // Modules in Python name interfaces of plugins that are loaded before; they can't name the plugins.
        let (mut python, others): (Vec<_>, Vec<_>) =
            configured.iter().partition(|entry| is_python_entry(entry));
        python.sort_by_key(|entry| entry.name.span);
        for entry in others.into_iter().chain(python) {
            if entry.load {
                self.named(&entry.name.value)?;
            } else {
                self.dormant(entry);
            }
        }
        Ok(())
    }

    /// Collects the linked plugins, in the order of their dependencies.
    fn linked(&mut self, plugins: &[Plugin]) -> Result<(), PluginError> {
        for plugin in plugins {
            self.linked_one(plugins, plugin)?;
        }
        Ok(())
    }

    fn linked_one(&mut self, all: &[Plugin], plugin: &Plugin) -> Result<(), PluginError> {
        if self.came.iter().any(|other| other.name() == plugin.name()) {
            let same = all.iter().filter(|other| other.name() == plugin.name()).count() > 1;
            return if same { Err(PluginError::Loaded { name: plugin.name().into() }) } else { Ok(()) };
        }
        self.enter(plugin.name())?;
        for dependency in plugin.dependencies() {
            match all.iter().find(|other| other.name() == dependency) {
                Some(other) => self.linked_one(all, other)?,
                None => self.dependency(plugin.name(), dependency)?,
            }
        }
        self.open.pop();
        self.add(plugin.clone())
    }

    /// Collects a plugin, or the plugins of a list; loaded ones are left unchanged.
    pub fn named(&mut self, name: &str) -> Result<(), PluginError> {
        let mut names = Vec::new();
        expand(self.sources.configuration.plugins(), name, &mut names);
        for name in names {
            if self.catalogue.plugin(&name).is_none() {
                self.entry(&name)?;
            }
        }
        Ok(())
    }

    /// Collects as [`named`](Gathered::named); fails if the plugin is loaded.
    pub fn named_afresh(&mut self, name: &str) -> Result<(), PluginError> {
        if self.catalogue.plugin(name).is_some() {
            return Err(PluginError::Loaded { name: name.into() });
        }
        self.named(name)
    }

    fn entry(&mut self, name: &str) -> Result<(), PluginError> {
        let entry = self.sources.configuration.plugins().iter().find(|entry| entry.name.value == name);
        let linked = self.sources.linked.iter().find(|plugin| plugin.name() == name);
        match (entry.and_then(|entry| entry.file.as_ref()), linked) {
            (Some(file), _) => self.library(&file.value, Some(name)).map_err(|error| match error {
                PluginError::Library(_) | PluginError::OtherPlugin { .. } if self.shows_places => {
                    let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
                    let configuration = &self.sources.configuration;
                    let shown = configuration.diagnostic(file.span, error.to_string(), help);
                    PluginError::Unfit(vec![shown].into())
                }
                other => other,
            }),
            (None, Some(plugin)) => self.linked_one(self.sources.linked, plugin),
            (None, None) if entry.is_some() => Err(PluginError::NoFile { name: name.into() }),
            (None, None) => Err(unknown(self.sources.configuration, &self.catalogue, name)),
        }
    }

    /// Collects a library, which must be of the plugin `expected`.
    pub fn library(&mut self, file: &Path, expected: Option<&str>) -> Result<(), PluginError> {
        let (plugin, residence) = self.sources.open(file, &self.catalogue)?;
        if let Some(expected) = expected.filter(|expected| *expected != plugin.name()) {
            return Err(other_plugin(file, &plugin, expected));
        }
        if self.catalogue.plugin(plugin.name()).is_some() {
            return Err(PluginError::Loaded { name: plugin.name().into() });
        }
        self.enter(plugin.name())?;
        for dependency in plugin.dependencies() {
            self.dependency(plugin.name(), dependency)?;
        }
        self.open.pop();
        self.origins.insert(plugin.name().into(), LibraryOrigin { file: file.into(), residence });
        self.add(plugin)
    }

    fn dependency(&mut self, name: &str, dependency: &str) -> Result<(), PluginError> {
        if self.catalogue.plugin(dependency).is_some() {
            return Ok(());
        }
        if self.open.iter().any(|open| open == dependency) {
            return self.enter(dependency);
        }
        let known = self.sources.configuration.plugins().iter().any(|entry| entry.name.value == dependency);
        if known || self.sources.linked.iter().any(|plugin| plugin.name() == dependency) {
            return self.named(dependency);
        }
        Err(PluginError::Missing { name: name.into(), dependency: dependency.into() })
    }

    fn enter(&mut self, name: &str) -> Result<(), PluginError> {
        if let Some(at) = self.open.iter().position(|open| open == name) {
            let circle = self.open[at..].iter().cloned().chain([name.to_owned()]).collect();
            return Err(PluginError::Circle { circle });
        }
        self.open.push(name.into());
        Ok(())
    }

    fn add(&mut self, plugin: Plugin) -> Result<(), PluginError> {
        check_kinds(&self.catalogue, &plugin)?;
        self.came.push(plugin.clone());
        self.catalogue.add(plugin);
        Ok(())
    }

    /// Notes the kinds of a plugin that is not loaded.
    /// They are read from its file, if possible.
    fn dormant(&mut self, entry: &PluginEntry) {
        // A list may have loaded it.
        let is_loaded = self.catalogue.plugin(&entry.name.value).is_some();
        let Some(file) = entry.file.as_ref().filter(|_| !is_loaded) else { return };
        match plugin::outline(&file.value, || interfaces(&self.catalogue)) {
            Ok(outline) => {
                let kinds = outline.modules.into_iter().map(|module| (module.name, entry.name.value.clone()));
                self.catalogue.dormant.extend(kinds);
            }
            // A library may not be built yet; a mistake in a source is the author's.
            Err(error) if is_python_entry(entry) => {
                if let Some(log) = self.sources.log {
                    let name = &entry.name.value;
                    log.log(
                        Level::Warn,
                        &format!("plugin {name} with `load = false` can't be read: {error}"),
                    );
                }
            }
            Err(_) => {}
        }
    }
}

impl<'a> PluginSources<'a> {
    /// Returns the sources of an agent's plugins.
    pub fn of(composition: &'a Composition) -> Self {
        let resources = &composition.assembly.resources;
        let log = PluginLog { logger: &resources.logger, clock: &resources.service_context.clock };
        Self {
            configuration: &composition.configuration,
            linked: &composition.plugins.linked,
            program: resources.arenas.program.as_deref(),
            watch: composition.plugins.known.as_ref().map(|known| LibraryWatch { known, log }),
            log: Some(log),
        }
    }

    /// Loads a library for the modules of the configuration.
    pub fn open(&self, file: &Path, catalogue: &Catalogue) -> Result<(Plugin, Residence), LibraryError> {
        self.check_file(file)?;
        let modules = self.configuration.modules();
        let are_isolated = |outline: &LibraryOutline| {
            outline.modules.iter().all(|kind| {
                let mut own = modules.iter().filter(|module| module.kind.value == kind.name).peekable();
                own.peek().is_some() && own.all(|module| module.isolated.value)
            })
        };
        let (plugin, _, residence) =
            plugin::load_for(file, self.program, || interfaces(catalogue), are_isolated)?;
        Ok((plugin, residence))
    }

    /// Reports a library that has changed since its last load.
    /// A damaged one is refused.
    pub fn check_file(&self, file: &Path) -> Result<(), LibraryError> {
        let Some(watch) = self.watch else { return Ok(()) };
        if watch.known.check(file)? {
            let text = format!(
                "{} was built or copied anew since it was loaded last",
                slate_configuration::printable(file)
            );
            watch.log.log(Level::Info, &text);
        }
        Ok(())
    }
}

/// Returns the components from which a configuration's agent can be made.
/// These are the kinds of the linked plugins and of those that it names, links to other agents if there is a carrier
/// for them, and the services of the host.
///
/// # Errors
/// When a plugin can't be loaded.
pub(in crate::agent) fn catalogue(
    configuration: &Configuration,
    linked: &[Plugin],
    sharing: Option<&dyn Sharing>,
) -> Result<Catalogue, PluginError> {
    let sources = PluginSources { configuration, linked, program: None, watch: None, log: None };
    let mut gathered = Gathered::with(sources, host_catalogue(sharing));
    gathered.all()?;
    Ok(gathered.done().0)
}

fn is_python_entry(entry: &PluginEntry) -> bool {
    entry.file.as_ref().is_some_and(|file| slate_engine::isolation::is_python(&file.value))
}

/// Returns the interfaces of a catalogue's modules.
/// Those of modules that refuse an empty setup are left out.
fn interfaces(catalogue: &Catalogue) -> Vec<&'static Descriptor> {
    let descriptors = catalogue.kinds().filter_map(|kind| {
        let setup = Setup { name: kind.name(), seed: 0, period: 20_000_000, section: None, params: None };
        let ports = kind.describe(&setup).ok()?.ports.into_iter();
        Some(ports.map(|port| port.descriptor).collect::<Vec<_>>())
    });
    descriptors.flatten().collect()
}

/// Returns the catalogue of the host, without any plugin.
pub(in crate::agent) fn host_catalogue(sharing: Option<&dyn Sharing>) -> Catalogue {
    Catalogue {
        shares: sharing.is_some(),
        carriers: sharing.map(Sharing::carriers).unwrap_or_default(),
        has_jpeg: sharing.is_some_and(Sharing::has_jpeg),
        services: crate::aspects::services().collect(),
        describe: slate_engine::runner::describe,
        set_up: slate_engine::set_up,
        ..Catalogue::default()
    }
}

pub(super) fn other_plugin(file: &Path, plugin: &Plugin, expected: &str) -> PluginError {
    PluginError::OtherPlugin { file: file.into(), found: plugin.name().into(), expected: expected.into() }
}

/// Checks that no other plugin has the same kind of module.
pub(super) fn check_kinds(catalogue: &Catalogue, plugin: &Plugin) -> Result<(), PluginError> {
    for other in &catalogue.plugins {
        let same =
            |kind: &&slate_module::ModuleKind| other.kinds().iter().any(|known| known.name() == kind.name());
        if let Some(kind) = plugin.kinds().iter().find(same) {
            return Err(PluginError::SameKind {
                name: plugin.name().into(),
                kind: kind.name().into(),
                other: other.name().into(),
            });
        }
    }
    Ok(())
}

/// Expands a name into plugins: itself, or the members of a list.
/// Lists may contain other lists, but not themselves.
pub(super) fn expand(entries: &[PluginEntry], name: &str, names: &mut Vec<String>) {
    let entry = entries.iter().find(|entry| entry.name.value == name);
    let Some(members) = entry.and_then(|entry| entry.members.as_ref()) else {
        if !names.iter().any(|known| known == name) {
            names.push(name.into());
        }
        return;
    };
    for member in members {
        expand(entries, &member.value, names);
    }
}

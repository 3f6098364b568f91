//! Control of an agent for its operations.

mod messages;
mod own;
mod peers;
mod properties;
mod refusal;
mod remote;
mod settings;
mod trace;
mod values;

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_blackboard::{Url, interface};
use slate_runtime::configuration::{Configuration, Database};
use slate_runtime::playback::Order;
use slate_runtime::recording::{self, RecordingControl};
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Composer, ControlsHolder, ErrorCode, Loaded, NewLink, Reload};

use crate::entries::{
    EnableResult, HolderEntry, LinkEntry, LoadedPlugin, LoadedPlugins, ModuleDocumentation, ModuleEntry,
    ParameterDocumentation, PluginEntry, PortDocumentation, Refusal, ReloadedPlugin, SnapshotEntry,
    UnloadedPlugin,
};

use messages::MessageSender;
pub use messages::missing_fields;
pub(crate) use own::own_url;
pub use peers::{PeerEntry, PeerList, ReadEntry, RejectedEntry, ServedEntry};
use properties::PropertyDirectory;
pub use refusal::Done;
pub(crate) use refusal::{KNOWN, absolute, no_playback, no_recorder, refusal};
use refusal::{result, unknown};
use settings::ConfigurationControl;
pub(crate) use trace::ToolTrace;
pub use values::MAX_CALL_DURATION;
use values::ValueWatch;

/// Content of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingRequest {
    /// Patterns of the properties, such as `/r2/**`; empty for all.
    #[serde(default)]
    pub select: Vec<String>,
    /// Patterns of properties to leave out.
    #[serde(default)]
    pub exclude: Vec<String>,
    /// Maximum rate of each property, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Recording of a value only if it differs from the last one recorded.
    #[serde(default)]
    pub on_change: bool,
}

/// Control of an agent: the part of it that can be read and changed while it runs.
/// Calls may come from several threads at once; those that change the agent's composition wait for each other.
#[derive(Clone)]
pub struct AgentControl {
    composer: Composer,
    /// Configuration.
    pub(crate) settings: ConfigurationControl,
    /// Properties, and those of other agents.
    pub(crate) properties: PropertyDirectory,
    /// Messages to its mailboxes.
    pub(crate) messages: MessageSender,
    /// Values as they come.
    pub(crate) values: ValueWatch,
}

impl std::fmt::Debug for AgentControl {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AgentControl").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl AgentControl {
    /// Creates the control of an agent, which it keeps.
    pub fn new(agent: &Agent) -> Self {
        let composer = agent.composer();
        let properties = PropertyDirectory::new(&composer);
        Self {
            settings: ConfigurationControl::new(&composer, agent.database().cloned()),
            messages: MessageSender::new(&properties),
            values: ValueWatch::new(&properties),
            properties,
            composer,
        }
    }

    /// Returns the composer, which changes the agent.
    pub fn composer(&self) -> &Composer {
        &self.composer
    }

    /// Waits until all changes so far are recorded, even if this process dies.
    pub fn settle(&self) {
        self.composer.settle_changes();
    }

    /// Unloads a plugin, or those of a list.
    pub(crate) fn unload(&self, name: &str) -> Done {
        let unloaded = self.composer.unload(name)?.into_iter();
        let unloaded = unloaded.map(|(name, library)| UnloadedPlugin { name, library: library.into() });
        result(unloaded.collect::<Vec<_>>())
    }

    /// Runs trial code beside that of a plugin.
    /// Returns the modules, each with the path of the comparison.
    pub(crate) fn shadow(&self, name: &str, file: &Path) -> Done {
        let modules = self.composer.shadow(name, absolute(file)?)?.into_iter();
        result(modules.map(|module| (module.clone(), format!("/{module}/shadow"))).collect::<Vec<_>>())
    }

    /// Discards the trial code of a plugin.
    pub(crate) fn end_shadow(&self, name: &str) -> Done {
        result(self.composer.end_shadow(name)?)
    }

    /// Lets the new code beside a plugin take over.
    pub(crate) fn promote(&self, name: &str) -> Done {
        reloaded(self.composer.promote(name)?)
    }

    /// Links an input, or only finds out whether that can be done.
    pub(crate) fn link(&self, to: &str, from: &str, options: Vec<(String, String)>, dry_run: bool) -> Done {
        let link = options
            .into_iter()
            .fold(NewLink::new(to.to_owned(), from), |link, (name, value)| link.with(name, value));
        let composer = &self.composer;
        let changes = if dry_run { composer.check_link(&link) } else { composer.link(&link) };
        let changes = changes.map_err(Refusal::from)?;
        match dry_run {
            true => self.properties.remote.check_link(&link)?,
            false => self.composer.say_changes("a tool has linked", &changes),
        }
        let mut changed = self.settings.changed(changes);
        if let Some(first) = changed.first_mut() {
            first.conversion = self.conversion(to, from);
        }
        result(changed)
    }

    /// Removes the link of an input, or only finds out whether that can be done.
    pub(crate) fn unlink(&self, to: &str, from: Option<&str>, dry_run: bool) -> Done {
        let composer = &self.composer;
        let changes = match dry_run {
            true => composer.check_unlink_from(to, from),
            false => composer.unlink_from(to, from),
        };
        let changes = changes.map_err(Refusal::from)?;
        if !dry_run {
            self.composer.say_changes("a tool has unlinked", &changes);
        }
        result(self.settings.changed(changes))
    }

    /// Returns the links.
    pub(crate) fn links(&self) -> Done {
        let entry = |link: slate_runtime::LinkStatus| LinkEntry {
            to: link.to,
            from: link.from,
            sends: link.sends,
            inferred: link.inferred,
            options: link.options,
            queue: link.queue,
            age: link.age,
            evicted: link.evicted,
            trouble: link.trouble,
        };
        result(self.composer.links().into_iter().map(entry).collect::<Vec<_>>())
    }

    /// Returns the other agents that are known.
    pub(crate) fn peers(&self) -> Done {
        result(peers::peers(&self.composer))
    }

    /// Takes a snapshot.
    pub(crate) fn save_snapshot(&self, file: &Path) -> Done {
        snapshot(&self.composer.save_snapshot(absolute(file)?)?)
    }

    /// Resumes from a snapshot.
    pub(crate) fn load_snapshot(&self, file: &Path) -> Done {
        let read = Snapshot::read(absolute(file)?)?;
        self.composer.restore(&read, self.settings.database.as_ref())?;
        snapshot(&read)
    }

    /// Begins to record into a file that does not exist yet.
    pub fn start_recording(&self, file: &Path, what: &RecordingRequest) -> Done {
        let selection = recording::selection(&what.select, &what.exclude, what.rate, what.on_change)?;
        result(self.recordings()?.start(&self.composer, absolute(file)?, &selection)?)
    }

    /// Ends a recording, the only one without a file.
    pub(crate) fn stop_recording(&self, file: Option<&Path>) -> Done {
        let file = file.map(absolute).transpose()?;
        result(self.recordings()?.stop(&self.composer, file)?)
    }

    /// Returns the state of the recordings.
    pub(crate) fn recording_status(&self) -> Done {
        result(self.recordings()?.status())
    }

    /// Saves the last seconds into a file that does not exist yet.
    pub(crate) fn save_flight(&self, file: &Path) -> Done {
        result(self.recordings()?.save(&self.composer, absolute(file)?)?)
    }

    /// Returns the actuators, and the holder of each control lease.
    pub(crate) fn holders(&self) -> Done {
        let entry = |ControlsHolder { actuator, holder }: ControlsHolder| {
            let (holder, since) = holder.unzip();
            HolderEntry { actuator, holder, since }
        };
        result(self.composer.controls().into_iter().map(entry).collect::<Vec<_>>())
    }

    /// Controls the playback of a recording.
    pub(crate) fn replay(&self, order: Order) -> Done {
        let control = self.composer.playback().ok_or_else(no_playback)?;
        result(control.order(order).map_err(|(message, help)| refusal(message, &help))?)
    }

    /// Stops all actuators until they are reset and armed; never blocks.
    /// See [`reset`](AgentControl::reset) and [`arm`](AgentControl::arm).
    pub fn stop(&self, reason: &str) {
        self.composer.stop_actuators(if reason.is_empty() { "by a tool" } else { reason });
    }

    /// Ends a stop of the actuators; false when none was stopped.
    pub fn reset(&self) -> bool {
        let was_stopped = self.composer.actuators().iter().any(|(_, reason)| reason.is_some());
        self.composer.reset();
        was_stopped
    }

    /// Describes the conversion of a link whose two ends have different interfaces.
    fn conversion(&self, to: &str, from: &str) -> Option<String> {
        let path = Url::parse(to).ok()?.path_in("");
        let input = self.composer.port(&path)?.descriptor;
        let (property, field) = self.composer.board().find(&self.properties.path_of(from).ok()?).ok()?;
        let source = property.descriptor();
        let is_other = field.is_empty() && source.hash != input.hash;
        is_other.then(|| format!("{} of {}, field by field", input.name, source.name))
    }

    /// Returns the plugins.
    pub(crate) fn plugins(&self) -> Done {
        let entry = |plugin: slate_runtime::PluginStatus| PluginEntry {
            name: plugin.name,
            version: plugin.version,
            file: plugin.file,
            loaded: plugin.loaded,
            kinds: plugin.kinds,
            modules: plugin.modules,
            shadow: plugin.shadow,
        };
        result(self.composer.plugins().into_iter().map(entry).collect::<Vec<_>>())
    }

    /// Loads a plugin of the configuration by name, or a library.
    pub(crate) fn load(&self, name: Option<&str>, file: Option<&Path>) -> Done {
        match (name, file) {
            (Some(name), None) => loaded(self.composer.load(name)?),
            (None, Some(file)) => loaded(self.composer.load_library(absolute(file)?)?),
            _ => Err(refusal("expected the name of a plugin or the file of a library, not both", "omit one")),
        }
    }

    /// Exchanges the code of a plugin.
    pub(crate) fn reload(&self, name: &str, file: Option<&Path>) -> Done {
        reloaded(self.composer.reload(name, file.map(absolute).transpose()?)?)
    }

    fn recordings(&self) -> Result<&dyn RecordingControl, Refusal> {
        self.composer.recording().and_then(|recording| recording.control()).ok_or_else(no_recorder)
    }

    /// Arms all actuators, or one.
    ///
    /// # Errors
    /// When one of them is stopped, or none has that name.
    pub fn arm(&self, actuator: Option<&str>) -> Result<(), Refusal> {
        let actuators = self.composer.actuators();
        let armed = match actuator {
            None => self.composer.arm(),
            Some(name) => self.composer.arm_one(name).ok_or_else(|| {
                let names: Vec<_> = actuators.iter().map(|(name, _)| name.clone()).collect();
                unknown("actuator", name, &names, "all of them are armed without a name")
            })?,
        };
        if armed {
            return Ok(());
        }
        let of = |name: &String| actuator.is_none_or(|actuator| actuator == name);
        let stopped = actuators.into_iter().filter(|(name, _)| of(name));
        let stopped: Vec<_> =
            stopped.filter_map(|(name, reason)| Some(format!("`{name}` ({})", reason?))).collect();
        let message = format!("still stopped: {}", stopped.join(", "));
        Err(refusal(message, "end the stop first: `slate reset`, then `slate arm`"))
    }

    /// Returns the modules.
    pub(crate) fn modules(&self) -> Done {
        let entry = |module: slate_runtime::ModuleStatus| ModuleEntry {
            name: module.name,
            kind: module.kind,
            plugin: module.plugin,
            condition: module.condition.into(),
            waiting_for: module.waiting_for,
            ticks: module.ticks,
            misses: module.misses,
            panics: module.panics,
            has_shadow: module.has_shadow,
        };
        result(self.composer.modules().into_iter().map(entry).collect::<Vec<_>>())
    }

    /// Returns the documentation of a module, its ports and its parameters.
    pub(crate) fn describe(&self, name: &str) -> Done {
        let Some((doc, description)) = self.composer.documentation(name) else {
            let names: Vec<_> = self.composer.modules().into_iter().map(|module| module.name).collect();
            return Err(unknown("module", name, &names, "see the list of modules"));
        };
        let ports = description.ports.iter().map(|port| PortDocumentation {
            name: port.name.clone(),
            direction: port.direction.name().into(),
            interface: port.descriptor.name.into(),
            role: port.role.clone(),
            doc: if port.doc.is_empty() { port.descriptor.doc.into() } else { port.doc.clone() },
        });
        let parameters = description.params.fields.iter().map(|field| ParameterDocumentation {
            name: field.name.into(),
            unit: field.unit.into(),
            doc: field.doc.into(),
        });
        result(ModuleDocumentation {
            name: name.into(),
            doc,
            ports: ports.collect(),
            parameters: parameters.collect(),
        })
    }

    /// Enables or disables a module.
    pub(crate) fn enable(&self, name: &str, on: bool) -> Result<EnableResult, Refusal> {
        let known = |database: &&Database| {
            database.current().modules().iter().any(|module| module.name.value == name)
        };
        let modules = self.composer.modules();
        let Some(module) = modules.iter().find(|module| module.name == name) else {
            let names: Vec<_> = modules.into_iter().map(|module| module.name).collect();
            return Err(unknown("module", name, &names, "see the list of modules"));
        };
        if !on && self.composer.is_time_source(name) {
            let message = ErrorCode::TimeSource
                .of(format!("`{name}` is the time source, and without it the world stands still"));
            return Err(refusal(message, "end the agent instead"));
        }
        let switch = format!("{name}/enabled");
        if let Some(link) = self.composer.links().into_iter().find(|link| link.to == switch) {
            let message = ErrorCode::Linked.of(format!("`{name}` is switched by a link, from {}", link.from));
            return Err(refusal(message, &format!("remove the link first: slate unlink {switch}")));
        }
        let has_failed = on && module.condition == "FAULTED";
        let present = self.composer.board().read(&format!("{name}/enabled/value"));
        if present.ok().flatten().is_some_and(|(value, _)| value == interface::Value::Bool(on)) {
            if has_failed {
                let message = format!("`{name}` has failed for good, so switching it on does nothing");
                let help = format!("reload its plugin: slate plugin reload {}", module.plugin);
                return Err(refusal(message, &help));
            }
            return Ok(EnableResult { changed: false, needs_reload: None });
        }
        match self.settings.database.as_ref().filter(known) {
            Some(database) => {
                let path = enabled(name);
                // Back to what the files say is no change that is to be saved.
                let is_on = |configuration: &Configuration| {
                    let mut modules = configuration.modules().iter();
                    modules.any(|module| module.name.value == name && module.enabled.value == on)
                };
                match database.revert(&path) {
                    Ok(back) if is_on(back.configuration()) => drop(back.commit()?),
                    _ => drop(database.set(&[(path, on.to_string())])?),
                }
            }
            // One that came with a plugin which was loaded by hand is in no file.
            None => self.composer.enable(name, on)?,
        }
        self.composer.say(&format!("a tool has switched {name} {}", if on { "on" } else { "off" }));
        Ok(EnableResult { changed: true, needs_reload: has_failed.then(|| module.plugin.clone()) })
    }
}

/// Returns the setting that switches a module.
pub(crate) fn enabled(module: &str) -> String {
    format!("modules.{}.enabled", toml_edit::Key::new(module).display_repr())
}

fn loaded(loaded: Loaded) -> Done {
    let plugin = |(name, file)| LoadedPlugin { name, file };
    let plugins = loaded.plugins.into_iter().map(plugin).collect();
    result(LoadedPlugins { plugins, modules: loaded.modules })
}

fn reloaded(reload: Reload) -> Done {
    result(ReloadedPlugin {
        plugin: reload.plugin,
        modules: reload.modules.into_iter().map(|(name, state)| (name, state.err())).collect(),
        in_place: reload.in_place,
        old_library: reload.old_library.into(),
    })
}

fn snapshot(snapshot: &Snapshot) -> Done {
    let agent = snapshot.agent().into();
    result(SnapshotEntry { agent, time: snapshot.time(), cycle: snapshot.cycle() })
}

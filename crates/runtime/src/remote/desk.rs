//! Does what tools ask for.

use std::path::Path;
use std::time::Duration;

use serde::Serialize;
use slate_blackboard::interface;
use slate_blackboard::{BoardError, Url};

use super::protocol::{
    Call, Changed, LinkEntry, LoadedPlugin, LoadedPlugins, ModuleEntry, PluginEntry, Refusal, Reloaded,
    SnapshotEntry, Switched, UnloadedPlugin,
};
use super::visit::Visit;
use crate::configuration::{Configuration, Database, Diagnostic, Report};
use crate::recording::{self, RecordingControl, RecordingRefusal};
use crate::snapshot::{Snapshot, SnapshotError};
use crate::{Agent, Composer, Loaded, NewLink, PluginError, Reload};
use slate_configuration::{Message, Mistake};

/// Does what tools ask for, whichever way they come: each [`Call`] as its documentation says. Calls may be made from several
/// threads at once; those that change what the agent is made of wait for each other.
#[derive(Clone)]
pub struct Desk {
    pub(super) composer: Composer,
    pub(super) database: Option<Database>,
}

impl std::fmt::Debug for Desk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Desk").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

/// What comes of a call.
pub(super) type Done = Result<serde_json::Value, Refusal>;

/// What a line asks for.
pub(super) fn read(line: &[u8]) -> Result<Call, Refusal> {
    serde_json::from_slice(line).map_err(|error| {
        refusal(
            format!("the line is no call: {error}"),
            r#"send a call a line, such as {"call":"plugin/list"}"#,
        )
    })
}

impl Desk {
    /// That of an agent, which it keeps.
    pub fn new(agent: &Agent) -> Self {
        Self { composer: agent.composer(), database: agent.database().cloned() }
    }

    /// What changes the agent.
    pub fn composer(&self) -> &Composer {
        &self.composer
    }

    /// Where its configuration is changed; none when it was loaded without one.
    pub fn settings(&self) -> Option<&Database> {
        self.database.as_ref()
    }

    /// Does what a call asks for. Traces are recorded, and controls taken, for tools with a connection of their own alone:
    /// see [`make_for`](Desk::make_for).
    ///
    /// # Errors
    /// When it can't be done; nothing is changed then.
    pub fn make(&self, call: Call) -> Result<serde_json::Value, Refusal> {
        match call {
            Call::TraceRecord { .. } | Call::TraceProgress {} | Call::TraceEnd {} => {
                Err(refusal("a trace needs a connection of its own", "record it with `slate trace`"))
            }
            Call::ControlsTake { .. } | Call::ControlsCommand { .. } | Call::ControlsRelease {} => {
                Err(refusal(
                    "controls need a connection of their own",
                    "drive with `slate teleop`, or take the controls by `Composer::take_controls`",
                ))
            }
            call => self.make_for(&mut Visit::default(), call),
        }
    }

    /// Changes settings as [`Call::ConfigSet`] does, if `holds` still says so right before; it is asked again when somebody
    /// else was faster.
    ///
    /// # Errors
    /// What `holds` says, or that the changes don't fit.
    pub fn set_if<E: From<Refusal>>(
        &self,
        changes: &[(String, String)],
        holds: impl Fn() -> Result<(), E>,
    ) -> Result<Vec<Changed>, E> {
        loop {
            let proposal = self.proposal(changes).map_err(E::from)?;
            holds()?;
            if let Some(changed) = proposal.apply() {
                self.composer.say_changes("a tool has changed", &changed);
                self.composer.settle_changes();
                return Ok(self.changed(changed));
            }
        }
    }

    /// Does what a tool asks for that has a connection of its own.
    ///
    /// # Errors
    /// When it can't be done; nothing is changed then.
    pub fn make_for(&self, visit: &mut Visit, call: Call) -> Result<serde_json::Value, Refusal> {
        let done = self.carry_out(call, visit);
        // A tool that is told of a change finds it in the recording, whatever becomes of this process.
        self.composer.settle_changes();
        done
    }

    fn carry_out(&self, call: Call, visit: &mut Visit) -> Done {
        match call {
            Call::PluginList {} => self.plugins(),
            Call::PluginLoad { name, file } => self.load(name.as_deref(), file.as_deref()),
            Call::PluginUnload { name } => {
                let unloaded = self.composer.unload(&name)?.into_iter();
                result(
                    unloaded
                        .map(|(name, library)| UnloadedPlugin { name, library: library.into() })
                        .collect::<Vec<_>>(),
                )
            }
            Call::PluginReload { name, file } => self.reload(&name, file.as_deref()),
            Call::PluginShadow { name, file } => {
                let modules = self.composer.shadow(&name, absolute(&file)?)?;
                let entry = |module: String| (format!("/{module}/shadow"), module);
                result(
                    modules.into_iter().map(entry).map(|(path, module)| (module, path)).collect::<Vec<_>>(),
                )
            }
            Call::PluginEndShadow { name } => result(self.composer.end_shadow(&name)?),
            Call::PluginPromote { name } => reloaded(self.composer.promote(&name)?),
            Call::TraceRecord { file } => result(visit.trace.record(&self.composer, absolute(&file)?)?),
            Call::TraceProgress {} => result(visit.trace.progress()?),
            Call::TraceEnd {} => result(visit.trace.end()?),
            Call::ModuleList {} => self.modules(),
            Call::ModuleEnable { name } => self.enable(&name, true),
            Call::ModuleDisable { name } => self.enable(&name, false),
            Call::Link { to, from, options, dry_run } => {
                let input = to.clone();
                let link = options
                    .into_iter()
                    .fold(NewLink::new(to, &from), |link, (name, value)| link.with(name, value));
                let composer = &self.composer;
                let changes = if dry_run { composer.check_link(&link) } else { composer.link(&link) };
                let changes = changes.map_err(Refusal::from)?;
                if dry_run {
                    self.check_remote(&link)?;
                }
                if !dry_run {
                    self.composer.say_changes("a tool has linked", &changes);
                }
                let mut changed = self.changed(changes);
                if let Some(first) = changed.first_mut() {
                    first.conversion = self.conversion(&input, &from);
                }
                result(changed)
            }
            Call::Unlink { to, from, dry_run } => {
                let (composer, from) = (&self.composer, from.as_deref());
                let changes = match dry_run {
                    true => composer.check_unlink_from(&to, from),
                    false => composer.unlink_from(&to, from),
                };
                let changes = changes.map_err(Refusal::from)?;
                if !dry_run {
                    self.composer.say_changes("a tool has unlinked", &changes);
                }
                result(self.changed(changes))
            }
            Call::LinkList {} => {
                let entry = |link: crate::LinkStatus| LinkEntry {
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
            Call::Peers {} => result(super::peers::peers(&self.composer)),
            Call::ConfigGet { path } => self.settings_at(&path),
            Call::ConfigSet { changes, dry_run } => self.set(&changes, dry_run),
            Call::ConfigRevert { path } => self.revert(&path),
            Call::ConfigDiff {} => self.differences(),
            Call::ConfigRefused {} => result(self.database()?.refused_edit().map(Refusal::from)),
            Call::ConfigSave { to, dry_run } => self.save(to, dry_run),
            Call::PropertyList { pattern } => self.properties(pattern.as_deref()),
            Call::SnapshotSave { file } => snapshot(&self.composer.save_snapshot(absolute(&file)?)?),
            Call::SnapshotLoad { file } => {
                let read = Snapshot::read(absolute(&file)?)?;
                self.composer.restore(&read, self.database.as_ref())?;
                snapshot(&read)
            }
            Call::SnapshotRemote { url, file } => self.remote_snapshot(&url, absolute(&file)?),
            Call::RecordStart { file, select, exclude, rate, on_change } => {
                let what = recording::selection(&select, &exclude, rate, on_change)?;
                result(self.recordings()?.start(&self.composer, absolute(&file)?, &what)?)
            }
            Call::RecordStop { file } => {
                let file = file.as_deref().map(absolute).transpose()?;
                result(self.recordings()?.stop(&self.composer, file)?)
            }
            Call::RecordStatus {} => result(self.recordings()?.status()),
            Call::RecordSnapshot { file } => {
                result(self.recordings()?.save(&self.composer, absolute(&file)?)?)
            }
            Call::Read { url } => self.read(&url),
            Call::ReadHistory { url } => self.history(&url),
            Call::Watch { of, within } => self.watch(&of, Duration::from_millis(within)),
            Call::Measure { urls, time } => self.measure(&urls, Duration::from_millis(time)),
            Call::MessageSend { url, value, dry_run } => self.send(&url, &value, dry_run),
            Call::PropertySet { url, value } => self.set_property(&url, &value),
            Call::Stop { reason } => {
                let reason = if reason.is_empty() { "by a tool" } else { &reason };
                self.composer.stop_actuators(reason);
                result(())
            }
            Call::ControlsTake { actuator, who } => self.take_controls(visit, &actuator, &who),
            Call::ControlsCommand { command } => self.command(visit, &command),
            Call::ControlsRelease {} => self.release(visit),
            Call::ControlsLeave {} => {
                visit.controls = None;
                result(())
            }
            Call::ControlsList {} => self.holders(),
            Call::Replay { order } => {
                let control = self.composer.playback().ok_or_else(|| {
                    refusal(
                        "the agent plays no recording",
                        "start one that does: slate replay FILE; or name it with --agent",
                    )
                })?;
                result(control.order(order).map_err(|(message, help)| refusal(message, &help))?)
            }
            Call::Reset {} => {
                let was_stopped = self.composer.actuators().iter().any(|(_, reason)| reason.is_some());
                self.composer.reset();
                result(was_stopped)
            }
            Call::Arm { actuator } => self.arm(actuator.as_deref()),
        }
    }

    /// What a link makes of what, when its two ends are of different interfaces.
    fn conversion(&self, to: &str, from: &str) -> Option<String> {
        let path = Url::parse(to).ok()?.path_in("");
        let input = self.composer.port(&path)?.descriptor;
        let (property, field) = self.composer.board().find(&self.path_of(from).ok()?).ok()?;
        let source = property.descriptor();
        let is_other = field.is_empty() && source.hash != input.hash;
        is_other.then(|| format!("{} of {}, field by field", input.name, source.name))
    }

    fn plugins(&self) -> Done {
        let entry = |plugin: crate::PluginStatus| PluginEntry {
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

    fn load(&self, name: Option<&str>, file: Option<&Path>) -> Done {
        match (name, file) {
            (Some(name), None) => loaded(self.composer.load(name)?),
            (None, Some(file)) => loaded(self.composer.load_library(absolute(file)?)?),
            _ => Err(refusal("plugin/load takes a name or a file", "give one of the two")),
        }
    }

    fn reload(&self, name: &str, file: Option<&Path>) -> Done {
        reloaded(self.composer.reload(name, file.map(absolute).transpose()?)?)
    }

    fn recordings(&self) -> Result<&dyn RecordingControl, Refusal> {
        let help = "`slate run` has one; a program gives its agent one with `Options::recording`";
        let control = self.composer.recording().and_then(|recording| recording.control());
        control.ok_or_else(|| refusal("this agent has nothing that records", help))
    }

    fn arm(&self, actuator: Option<&str>) -> Done {
        let actuators = self.composer.actuators();
        let armed = match actuator {
            None => self.composer.arm(),
            Some(name) => self.composer.arm_one(name).ok_or_else(|| {
                let names: Vec<_> = actuators.iter().map(|(name, _)| name.clone()).collect();
                unknown("actuator", name, &names, "all of them are armed without a name")
            })?,
        };
        if armed {
            return result(());
        }
        let of = |name: &String| actuator.is_none_or(|actuator| actuator == name);
        let stopped = actuators.into_iter().filter(|(name, _)| of(name));
        let stopped: Vec<_> =
            stopped.filter_map(|(name, reason)| Some(format!("`{name}` ({})", reason?))).collect();
        let message = format!("still stopped: {}", stopped.join(", "));
        Err(refusal(message, "end the stop first: `slate reset`, then `slate arm`"))
    }

    fn modules(&self) -> Done {
        let entry = |module: crate::ModuleStatus| ModuleEntry {
            name: module.name,
            kind: module.kind,
            plugin: module.plugin,
            condition: module.condition.into(),
            ticks: module.ticks,
            misses: module.misses,
            panics: module.panics,
            has_shadow: module.has_shadow,
        };
        result(self.composer.modules().into_iter().map(entry).collect::<Vec<_>>())
    }

    pub(super) fn enable(&self, name: &str, on: bool) -> Done {
        let known = |database: &&Database| {
            database.current().modules().iter().any(|module| module.name.value == name)
        };
        let modules = self.composer.modules();
        let Some(module) = modules.iter().find(|module| module.name == name) else {
            let names: Vec<_> = modules.into_iter().map(|module| module.name).collect();
            return Err(unknown("module", name, &names, "see the list of modules"));
        };
        if !on && self.composer.is_time_source(name) {
            let message = Mistake::TimeSource
                .of(format!("`{name}` is the time source, and without it the world stands still"));
            return Err(refusal(message, "end the agent instead"));
        }
        let switch = format!("{name}/enabled");
        if let Some(link) = self.composer.links().into_iter().find(|link| link.to == switch) {
            let message = Mistake::Linked.of(format!("`{name}` is switched by a link, from {}", link.from));
            return Err(refusal(message, &format!("take the link away first: slate unlink {switch}")));
        }
        let has_failed = on && module.condition == "FAULTED";
        let present = self.composer.board().read(&format!("{name}/enabled/value"));
        if present.ok().flatten().is_some_and(|(value, _)| value == interface::Value::Bool(on)) {
            if has_failed {
                let message = format!("`{name}` has failed for good, so switching it on does nothing");
                let help = format!("reload its plugin: slate plugin reload {}", module.plugin);
                return Err(refusal(message, &help));
            }
            return result(Switched { changed: false, needs_reload: None });
        }
        match self.database.as_ref().filter(known) {
            Some(database) => {
                let path = format!("modules.{}.enabled", toml_edit::Key::new(name).display_repr());
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
        result(Switched { changed: true, needs_reload: has_failed.then(|| module.plugin.clone()) })
    }
}

fn loaded(loaded: Loaded) -> Done {
    let plugin = |(name, file)| LoadedPlugin { name, file };
    let plugins = loaded.plugins.into_iter().map(plugin).collect();
    result(LoadedPlugins { plugins, modules: loaded.modules })
}

fn reloaded(reload: Reload) -> Done {
    result(Reloaded {
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

pub(super) fn result(value: impl Serialize) -> Done {
    serde_json::to_value(value)
        .map_err(|error| refusal(format!("the answer can't be written: {error}"), "ask for less of it"))
}

/// The agent's own folder is not that of the tool.
fn absolute(file: &Path) -> Result<&Path, Refusal> {
    if file.is_absolute() {
        return Ok(file);
    }
    Err(refusal(format!("{} is a relative path", crate::printable(file)), "give its absolute path"))
}

pub(super) fn refusal(message: impl Into<Message>, help: &str) -> Refusal {
    let Message { text, mistake } = message.into();
    Refusal { message: text, help: help.into(), code: code(mistake), report: None }
}

fn code(mistake: Option<Mistake>) -> Option<String> {
    mistake.map(|mistake| mistake.code().to_owned())
}

/// There is nothing of that name; `help` is for when there is nothing like it either.
fn unknown(what: &str, name: &str, names: &[String], help: &str) -> Refusal {
    let near = slate_blackboard::nearest_names(name, names.iter().map(String::as_str)).join(" or ");
    let help = if near.is_empty() { help.into() } else { format!("did you mean {near}?") };
    refusal(Mistake::Name.of(format!("no {what} is called `{name}`")), &help)
}

impl From<Report> for Refusal {
    fn from(report: Report) -> Self {
        let diagnostics = report.diagnostics();
        // Of several, each has its help beside it.
        let line = |one: &Diagnostic| match one.help_text() {
            Some(help) => format!("{} ({help})", one.placed()),
            None => one.placed(),
        };
        let (message, help) = match diagnostics {
            [one] => (one.placed(), one.help_text().unwrap_or_default().to_owned()),
            several => (several.iter().map(line).collect::<Vec<_>>().join("\n"), String::new()),
        };
        let is_written = diagnostics.iter().any(Diagnostic::is_written);
        let report_text = is_written.then(|| report.render(false));
        Self { message, help, code: code(report.mistake()), report: report_text }
    }
}

impl From<PluginError> for Refusal {
    fn from(error: PluginError) -> Self {
        match error {
            PluginError::Unfit(report) => report.into(),
            other => {
                let help = miette::Diagnostic::help(&other).map(|help| help.to_string());
                let message = Message { text: other.to_string(), mistake: other.mistake() };
                refusal(message, &help.unwrap_or_default())
            }
        }
    }
}

impl From<RecordingRefusal> for Refusal {
    fn from(refused: RecordingRefusal) -> Self {
        refusal(refused.message, &refused.help)
    }
}

impl From<SnapshotError> for Refusal {
    fn from(error: SnapshotError) -> Self {
        match error {
            SnapshotError::Configuration(report) => report.into(),
            other => {
                let help = miette::Diagnostic::help(&other).map(|help| help.to_string());
                refusal(other.to_string(), &help.unwrap_or_default())
            }
        }
    }
}

impl From<BoardError> for Refusal {
    fn from(error: BoardError) -> Self {
        refusal(
            Message::from(&error),
            "name a module of the agent; one that a link switches can't be switched by hand",
        )
    }
}

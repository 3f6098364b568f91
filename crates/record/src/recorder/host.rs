//! The recorded agent, as a recorder knows it from the start.

use std::sync::Arc;
use std::time::UNIX_EPOCH;

use slate_blackboard::Board;
use slate_runtime::log::Logger;
use slate_runtime::recording::RecordedAgent;
use slate_runtime::{Agent, WeakComposer};
use slate_sorted::SortedMap;

use super::run::{CONFIGURATION, RecordingHeader, stage_modules};

/// The agent that is recorded.
pub(super) struct Host {
    /// Composer of the agent; the agent itself has the recorder.
    pub composer: WeakComposer,
    pub logger: Arc<Logger>,
    clock: Box<dyn Fn() -> u64 + Send + Sync>,
    /// Offset from the agent's time to that of the file, nanoseconds.
    /// In lockstep it is 0, and otherwise the date of the agent's start, so that recordings of several robots fit
    /// together.
    pub epoch: u64,
    pub is_lockstep: bool,
    /// Cycle period, nanoseconds.
    pub period: u64,
    /// Time and preface of the last seconds before any change.
    /// `None` if none are kept.
    pub began: Option<(u64, RecordingHeader)>,
    /// Metadata of the run.
    pub run: SortedMap<String, String>,
    /// Stored memories of modules at its beginning.
    pub memories: SortedMap<String, String>,
    /// Files attached beside the configuration: names and content.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Host {
    pub fn of(agent: &Agent, files: Vec<(String, Vec<u8>)>) -> Self {
        let date = |time| {
            let date = agent.date_of(time).duration_since(UNIX_EPOCH).unwrap_or_default();
            u64::try_from(date.as_nanos()).unwrap_or_default()
        };
        let (is_lockstep, name) = (agent.is_lockstep(), agent.board().agent());
        let epoch = if is_lockstep { 0 } else { date(0) };
        let run = [
            ("agent", name.to_owned()),
            // The name and the date are enough to tell one run from another.
            ("run", format!("{name}-{:x}-{:x}", date(agent.now()), std::process::id())),
            ("seed", agent.configuration().seed().value.to_string()),
            ("clock", if is_lockstep { "lockstep" } else { "wall" }.into()),
            ("epoch_ns", epoch.to_string()),
            ("armed", agent.begins_armed().to_string()),
            ("slate", env!("CARGO_PKG_VERSION").into()),
        ];
        let memories = agent.memories().map(|(module, began)| {
            (module.to_owned(), began.map_or_else(|| "none".into(), |hash| format!("{hash:016x}")))
        });
        Self {
            composer: agent.composer().downgrade(),
            logger: Arc::clone(agent.logger()),
            clock: Box::new(agent.clock()),
            epoch,
            is_lockstep,
            period: agent.configuration().period().value,
            began: None,
            run: run.map(|(key, value)| (key.to_owned(), value)).into(),
            memories: memories.collect(),
            files,
        }
    }

    /// Returns the agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        (self.clock)()
    }

    /// Returns the preface of a file.
    /// `is_whole` says whether all is recorded, and `is_first` whether the recording covers the run from its start.
    pub fn recording_header(
        &self,
        content: &AgentContent,
        board: &Board,
        is_whole: bool,
        is_first: bool,
    ) -> RecordingHeader {
        let mut run = self.run.clone();
        run.insert("from_cycle".into(), content.cycles.to_string());
        run.insert("whole".into(), is_whole.to_string());
        // Recordings of before have none.
        run.insert("messages".into(), "true".into());
        run.insert("begins".into(), if is_first { "with the run" } else { "in the run" }.into());
        let mut metadata = vec![("run", run), ("memories", self.memories.clone())];
        metadata.extend(content.metadata.iter().cloned());
        let properties = board.properties();
        let external = properties.iter().map(|property| (property.path().to_owned(), property.external()));
        let external: SortedMap<_, _> = external.filter(|(_, source)| !source.is_empty()).collect();
        if !external.is_empty() {
            metadata.push(("external", external));
        }
        let text = content.configuration.clone().into_bytes();
        let own = (CONFIGURATION.to_owned(), "application/toml", text);
        let others = self.files.iter().map(|(name, bytes)| (name.clone(), "application/toml", bytes.clone()));
        let attachments = std::iter::once(own).chain(others).collect();
        RecordingHeader { epoch: self.epoch, metadata, attachments }
    }
}

/// Plugins, modules, links and configuration of an agent at one moment.
pub(super) struct AgentContent {
    /// Cycles begun.
    cycles: u64,
    /// Plugins, modules, stages and links.
    metadata: Vec<(&'static str, SortedMap<String, String>)>,
    /// The configuration, as TOML.
    configuration: String,
}

impl AgentContent {
    pub fn of(agent: &dyn RecordedAgent) -> Self {
        let plugins = agent.plugin_marks().into_iter();
        let plugins = plugins.map(|plugin| (plugin.name, format!("{} {:016x}", plugin.version, plugin.hash)));
        let mut metadata = vec![
            ("plugins", plugins.collect()),
            ("modules", agent.kinds().into_iter().collect()),
            ("stages", stage_modules(agent.order())),
            ("links", agent.links().into_iter().collect()),
        ];
        let inboxes: SortedMap<_, _> =
            agent.inboxes().into_iter().map(|inbox| (inbox, String::new())).collect();
        if !inboxes.is_empty() {
            metadata.push(("inboxes", inboxes));
        }
        Self { cycles: agent.cycles(), metadata, configuration: agent.configuration_text() }
    }
}

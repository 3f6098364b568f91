//! Snapshot of an agent, in a file from which it can be restored.
//! It contains properties with their stamps, queues with every reader's cursor, waiting messages, states of modules,
//! gates, the clock, the digest, and the configuration at that time.
//!
//! [`Composer::snapshot`](crate::Composer::snapshot) takes one between two cycles, and
//! [`Composer::restore`](crate::Composer::restore) restores one: in the running agent, or in one of another process
//! that was just loaded with the snapshot's [`configuration`](Snapshot::configuration).

mod error;
mod file;
mod image;

use std::path::Path;

pub use error::SnapshotError;
pub use file::PluginMark;
pub(crate) use image::{ClockSnapshot, ModuleSnapshot, PortSnapshot, SnapshotImage};
pub use slate_configuration::{Comparison, SnapshotCondition, SnapshotTrigger};
pub(crate) use slate_engine::{Bytes, MailboxSnapshot, PropertySnapshot};

use slate_configuration::{Database, Report, extra_tables, recorded_configuration};

/// Content of the application in snapshots, such as the data of an observer.
pub trait ApplicationState: Send + Sync {
    /// Returns the state to restore from.
    /// Called between two cycles, so it only copies.
    fn save(&self) -> Vec<u8>;

    /// Checks a saved state, and returns the call that restores it.
    /// The call is made between two cycles.
    ///
    /// # Errors
    /// The mismatches.
    fn restore(&self, saved: &[u8]) -> Result<Box<dyn FnOnce() + Send>, String>;
}

/// Complete state of an agent at one time.
#[derive(Debug)]
pub struct Snapshot {
    pub(crate) head: file::SnapshotHead,
    pub(crate) image: SnapshotImage,
}

impl Snapshot {
    pub(crate) fn new(agent: &str, plugins: Vec<PluginMark>, image: SnapshotImage) -> Self {
        let (time, cycle) = (image.clock.now, image.main_loop.cycle);
        Self { head: file::SnapshotHead { agent: agent.into(), time, cycle, plugins }, image }
    }

    /// Writes the snapshot to a file, atomically.
    /// It replaces a file of that name.
    ///
    /// # Errors
    /// When it can't be written; an earlier file stays.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), SnapshotError> {
        file::write(self, path.as_ref())
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When it can't be read, is damaged, or is of another version.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SnapshotError> {
        file::read(path.as_ref())
    }

    /// The agent's name.
    pub fn agent(&self) -> &str {
        &self.head.agent
    }

    /// The agent's time, nanoseconds.
    pub fn time(&self) -> u64 {
        self.head.time
    }

    /// Cycles of the main loop until then.
    pub fn cycle(&self) -> u64 {
        self.head.cycle
    }

    /// The plugins that were loaded.
    pub fn plugins(&self) -> &[PluginMark] {
        &self.head.plugins
    }

    /// The modules by name, each with its kind and its number of ticks.
    pub fn modules(&self) -> impl Iterator<Item = (&str, &str, u64)> {
        self.image
            .modules
            .iter()
            .map(|(name, module)| (name.as_str(), module.kind.as_str(), module.runner.ticks))
    }

    /// Content of the application under a name.
    pub fn kept(&self, name: &str) -> Option<&[u8]> {
        self.image.application_states.get(name).map(|bytes| bytes.0.as_slice())
    }

    /// Number of properties with values.
    pub fn properties(&self) -> usize {
        self.image.properties.len()
    }

    /// Number of waiting messages.
    pub fn messages(&self) -> usize {
        let inboxes = self.image.modules.values().flat_map(|module| module.runner.inboxes.values());
        let waiting = inboxes.chain(self.image.mailboxes.values());
        waiting.map(|mailbox| mailbox.messages.len()).sum()
    }

    /// Whole configuration at that time, as TOML.
    /// It includes the settings of the command line and all changes until then.
    pub fn configuration_text(&self) -> &str {
        &self.image.configuration
    }

    /// Configuration at that time, layer by layer, to load an agent with.
    /// Changes made at run time can be reverted. `sets` are settings of the command line above it. In a snapshot of a
    /// version without layers, their sum counts as the files' content.
    ///
    /// # Errors
    /// When it is no longer valid, or a setting is wrong.
    pub fn configuration(&self, sets: Vec<String>) -> Result<Database, Report> {
        let name = format!("the snapshot of {}", self.agent());
        let text = self.configuration_text();
        if let Some(layers) = &self.image.layers {
            let whole = recorded_configuration(&name, text, Vec::new())?;
            let extra = || extra_tables(text);
            let layered = layers.database(&name, extra(), Vec::new());
            // The sum decides; layers that don't make it say nothing.
            if let Ok(layered) = layered
                && layered.current().is_same_as(&whole.current())
            {
                return if sets.is_empty() { Ok(layered) } else { layers.database(&name, extra(), sets) };
            }
        }
        recorded_configuration(&name, text, sets)
    }
}

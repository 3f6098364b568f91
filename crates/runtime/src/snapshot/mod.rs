//! All of an agent at one moment, in a file from which it goes on: properties with their stamps, queues with every
//! reader's cursor, messages that wait, states of modules, gates, the clock, the digest, and the configuration as it was.
//!
//! [`Composer::snapshot`](crate::Composer::snapshot) takes one between two cycles, and
//! [`Composer::restore`](crate::Composer::restore) goes on from one: in the agent that runs, or in one of another process
//! that was just loaded with the snapshot's [`configuration`](Snapshot::configuration).

mod error;
mod file;
mod image;

use std::path::Path;

pub use error::SnapshotError;
pub use file::PluginMark;
pub(crate) use file::describe;
pub(crate) use image::{FrozenClock, FrozenModule, FrozenPort, SnapshotImage};
pub use slate_configuration::{Comparison, SnapshotCondition, SnapshotTrigger};
pub(crate) use slate_engine::{Bytes, FrozenMailbox, FrozenProperty};

use slate_configuration::{Database, Report, extra_tables, recorded_configuration};

/// Something of the application that goes into snapshots beside the agent: what an observer has collected, say.
pub trait Keepsake: Send + Sync {
    /// What it needs to go on. Called between two cycles, so it only copies.
    fn save(&self) -> Vec<u8>;

    /// Looks whether it can go on from what was saved; what is returned does it, between two cycles.
    ///
    /// # Errors
    /// What does not fit.
    fn restore(&self, saved: &[u8]) -> Result<Box<dyn FnOnce() + Send>, String>;
}

/// All of an agent at one moment.
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

    /// Writes it to a file, which is there as a whole or not at all: it takes the place of one of that name.
    ///
    /// # Errors
    /// When it can't be written; what was there stays.
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

    /// The modules, by name, each with its kind and how many ticks it has made.
    pub fn modules(&self) -> impl Iterator<Item = (&str, &str, u64)> {
        self.image
            .modules
            .iter()
            .map(|(name, module)| (name.as_str(), module.kind.as_str(), module.runner.ticks))
    }

    /// What the application has kept under a name.
    pub fn kept(&self, name: &str) -> Option<&[u8]> {
        self.image.keepsakes.get(name).map(|bytes| bytes.0.as_slice())
    }

    /// How many properties have values in it.
    pub fn properties(&self) -> usize {
        self.image.properties.len()
    }

    /// How many messages wait in it.
    pub fn messages(&self) -> usize {
        let inboxes = self.image.modules.values().flat_map(|module| module.runner.inboxes.values());
        let waiting = inboxes.chain(self.image.mailboxes.values());
        waiting.map(|mailbox| mailbox.messages.len()).sum()
    }

    /// The whole configuration as it was, with what the command line had set and what was changed since, as TOML.
    pub fn configuration_text(&self) -> &str {
        &self.image.configuration
    }

    /// The configuration as it was, layer by layer, to load an agent with: what was changed at run time can be taken back.
    /// `sets` are settings of the command line that go over it. In a snapshot of a version that wrote no layers, their sum
    /// is what the files say.
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

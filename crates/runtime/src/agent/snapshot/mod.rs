//! Taking snapshots of an agent, and going on from them.

mod apply;
mod capture;
mod fit;
mod restore;
mod text;
mod watch;

use std::path::Path;
use std::sync::Arc;

use super::{Agent, Composer};
use crate::snapshot::{Keepsake, PluginMark, Snapshot, SnapshotError};
pub(super) use watch::Watch;

impl Composer {
    /// The whole configuration as it is, with what the command line has set and what was changed since, as TOML.
    pub fn configuration_text(&self) -> String {
        text::of(&self.composition(), self.shared.board.agent())
    }

    /// The plugins that are loaded, each with a hash over its library, or over what its modules are.
    pub fn plugin_marks(&self) -> Vec<PluginMark> {
        capture::marks(&self.composition())
    }

    /// Takes something of the application into all snapshots from now on, under a name.
    pub fn keep(&self, name: &str, keepsake: Arc<dyn Keepsake>) {
        self.composition().keepsakes.insert(name.into(), keepsake);
    }

    /// Takes a snapshot and writes it to a file; the loop goes on meanwhile. Returns it.
    ///
    /// # Errors
    /// As [`snapshot`](Composer::snapshot) and [`Snapshot::write`].
    pub fn save_snapshot(&self, file: &Path) -> Result<Snapshot, SnapshotError> {
        let snapshot = self.snapshot()?;
        snapshot.write(file)?;
        Ok(snapshot)
    }
}

impl Agent {
    /// Goes on from a snapshot, as [`Composer::restore`], with the settings of the agent's database changed to those of
    /// the snapshot.
    ///
    /// # Errors
    /// What does not fit; the agent is as it was then.
    pub fn restore(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.composer.restore(snapshot, self.database())
    }

    /// Goes on from a snapshot, but with the parameters, switches and values of inputs that the agent was loaded with,
    /// where the snapshot's configuration has others.
    ///
    /// # Errors
    /// What does not fit; the agent is as it was then.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.composer.restore_under_own_settings(snapshot)
    }
}

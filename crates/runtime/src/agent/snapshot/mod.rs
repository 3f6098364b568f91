//! Snapshots of an agent: taking and restoring.

mod apply;
mod capture;
mod fit;
mod restore;
mod text;
mod watch;

use std::path::Path;
use std::sync::Arc;

use super::handle::AgentHandle;
use crate::snapshot::{ApplicationState, PluginMark, Snapshot, SnapshotError};
use capture::{HeldCells, LIMIT, SnapshotSubjects};
pub(super) use restore::SnapshotRestorer;
pub(super) use watch::{SnapshotWatch, check_trigger};

/// Taker of an agent's snapshots.
pub(super) struct SnapshotTaker<'c> {
    agent: &'c AgentHandle,
}

impl<'c> SnapshotTaker<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Returns the whole present configuration, as TOML.
    /// It includes the settings of the command line, all changes since, and inferred links.
    pub fn configuration_text(&self) -> String {
        text::expanded(&self.agent.composition(), self.agent.shared.board.agent())
    }

    /// Returns the loaded plugins, each with a hash.
    /// The hash is over the library, or over the descriptions of the modules.
    pub fn plugin_marks(&self) -> Vec<PluginMark> {
        capture::marks(&self.agent.composition())
    }

    /// Adds content of the application to all later snapshots, under a name.
    pub fn add_application_state(&self, name: &str, state: Arc<dyn ApplicationState>) {
        self.agent.composition().snapshots.application_states.insert(name.into(), state);
    }

    /// Takes a snapshot and writes it to a file; the loop continues meanwhile.
    pub fn save(&self, file: &Path) -> Result<Snapshot, SnapshotError> {
        let snapshot = self.snapshot()?;
        snapshot.write(file)?;
        Ok(snapshot)
    }

    /// Takes a snapshot between two cycles, when no module is in a tick.
    pub fn snapshot(&self) -> Result<Snapshot, SnapshotError> {
        let composition = self.agent.composition();
        let subjects = SnapshotSubjects::of(&composition, &self.agent.shared)?;
        let plugins = capture::marks(&composition);
        let held = HeldCells::of(&subjects.modules)?;
        let cells: Vec<_> = subjects.modules.iter().map(|subject| Arc::clone(&subject.cell)).collect();
        let names: Vec<_> = subjects.modules.iter().map(|subject| subject.name.clone()).collect();
        let image = self.agent.shared.between_cycles(&cells, move |shared| subjects.capture(shared));
        drop(held);
        let image = image.map_err(|_| {
            let late = cells.iter().zip(names).find(|(cell, _)| !cell.is_idle());
            SnapshotError::Busy { module: late.map(|(_, name)| name).unwrap_or_default(), limit: LIMIT }
        })??;
        Ok(Snapshot::new(self.agent.shared.board.agent(), plugins, image))
    }
}

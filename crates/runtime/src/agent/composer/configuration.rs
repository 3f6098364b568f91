//! What an agent is configured with: links, settings, other agents, snapshots.

use std::path::Path;
use std::sync::Arc;

use super::Composer;
use crate::agent::links::{LinkEditor, LinkStatus, NewLink, RemoteEnd};
use crate::agent::remote_links::RemoteLinks;
use crate::agent::settings::SettingsChanger;
use crate::agent::snapshot::{SnapshotRestorer, SnapshotTaker};
use crate::sharing::{Inspection, RemotePath, TeamExchange};
use crate::snapshot::{Keepsake, PluginMark, Snapshot, SnapshotError};
use slate_configuration::{Change, Database, Diagnostic, Proposal, Report};

impl Composer {
    /// The links that the agent has, by their destinations.
    pub fn links(&self) -> Vec<LinkStatus> {
        LinkEditor::new(&self.agent).links()
    }

    /// What leads nowhere and should: ports of blocks without a link, and actuators whose commands reach nothing. None of
    /// it keeps the agent from running.
    pub fn loose_ends(&self) -> Vec<Diagnostic> {
        LinkEditor::new(&self.agent).loose_ends()
    }

    /// Links an input, between two cycles and with the states of all modules as they are; it may have another link, or a
    /// value. An outbox that sends to another inbox leaves that one. The configuration has the link from then on, so that
    /// it can be saved.
    ///
    /// # Errors
    /// What does not fit; nothing is changed then.
    pub fn link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).link(link)
    }

    /// Whether a link could be made: as [`link`](Composer::link), and nothing is changed.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub fn check_link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_link(link)
    }

    /// Why a link to that property of another agent would wait, which is not on the board yet: what of it does not fit, and
    /// what to do.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub fn misfit(
        &self,
        link: &NewLink,
        path: RemotePath,
        property: &RemoteEnd<'_>,
    ) -> Result<Option<(String, String)>, Report> {
        LinkEditor::new(&self.agent).misfit(link, path, property)
    }

    /// Takes the links of an input or inbox away. An input then has the value that is set for it, or that of an input which was never
    /// written.
    ///
    /// # Errors
    /// When there is no such link, or a module needs it; nothing is changed then.
    pub fn unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).unlink(to)
    }

    /// Takes one of the senders of an inbox away, or as [`unlink`](Composer::unlink).
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).unlink_from(to, from)
    }

    /// Whether a link could be taken away: as [`unlink`](Composer::unlink), and nothing is changed.
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn check_unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_unlink(to)
    }

    /// Whether one of the senders of an inbox could be taken away.
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn check_unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_unlink_from(to, from)
    }

    /// Makes changes of the configuration, unless links are among them that a module is in the way of.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn commit(&self, propose: impl Fn() -> Result<Proposal, Report>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).commit(propose)
    }

    /// Refuses changes of links that a module is in the way of.
    ///
    /// # Errors
    /// The links that a module is in the way of.
    pub fn judged(&self, proposal: Proposal) -> Result<Proposal, Report> {
        LinkEditor::new(&self.agent).judged(proposal)
    }

    /// Logs changes of the configuration, with the values before and after.
    pub fn say_changes(&self, what: &str, changes: &[Change]) {
        SettingsChanger::new(&self.agent).say_changes(what, changes)
    }

    /// The value that a module has where nothing says another.
    pub fn default_at(&self, path: &str) -> Option<String> {
        SettingsChanger::new(&self.agent).default_at(path)
    }

    /// The agents of which the configuration says where they are.
    pub fn named_agents(&self) -> Vec<String> {
        RemoteLinks::new(&self.agent).named_agents()
    }

    /// What looks into other agents; nothing when this one shares nothing.
    pub fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        RemoteLinks::new(&self.agent).inspection()
    }

    /// The agent's part in the knowledge of its team, for networks that reach other robots; nothing unless it takes part.
    pub fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        RemoteLinks::new(&self.agent).team()
    }

    /// The time of the clock by which the agent shares.
    pub fn steady_now(&self) -> u64 {
        RemoteLinks::new(&self.agent).steady_now()
    }

    /// The whole configuration as it is, with what the command line has set and what was changed since, as TOML.
    pub fn configuration_text(&self) -> String {
        SnapshotTaker::new(&self.agent).configuration_text()
    }

    /// The plugins that are loaded, each with a hash over its library, or over what its modules are.
    pub fn plugin_marks(&self) -> Vec<PluginMark> {
        SnapshotTaker::new(&self.agent).plugin_marks()
    }

    /// Takes something of the application into all snapshots from now on, under a name.
    pub fn keep(&self, name: &str, keepsake: Arc<dyn Keepsake>) {
        SnapshotTaker::new(&self.agent).keep(name, keepsake)
    }

    /// Takes a snapshot and writes it to a file; the loop goes on meanwhile. Returns it.
    ///
    /// # Errors
    /// As [`snapshot`](Composer::snapshot) and [`Snapshot::write`].
    pub fn save_snapshot(&self, file: &Path) -> Result<Snapshot, SnapshotError> {
        SnapshotTaker::new(&self.agent).save(file)
    }

    /// Copies all of the agent between two cycles, when no module is in a tick. It is copied and no more, so the loop
    /// soon goes on; [`Snapshot::write`] writes it to a file, in any thread.
    ///
    /// # Errors
    /// When a module does not stand still, or its state can't be saved.
    pub fn snapshot(&self) -> Result<Snapshot, SnapshotError> {
        SnapshotTaker::new(&self.agent).snapshot()
    }

    /// Goes on from a snapshot: between two cycles all is as it was then. Real actuators are disarmed; those that arm
    /// themselves are as they were, unless they are stopped now. Settings that are another in the snapshot are changed in
    /// the `database`, if there is one.
    ///
    /// Services of the host that a module uses begin afresh, as with new code: what it has opened itself, it opens again.
    ///
    /// # Errors
    /// What does not fit; the agent goes on as it was.
    pub fn restore(&self, snapshot: &Snapshot, database: Option<&Database>) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.agent).restore(snapshot, database)
    }

    /// As [`restore`](Composer::restore), but parameters, switches and values of inputs stay those that the agent was
    /// loaded with where the snapshot's configuration has others.
    ///
    /// # Errors
    /// What does not fit; the agent goes on as it was.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.agent).restore_under_own_settings(snapshot)
    }
}

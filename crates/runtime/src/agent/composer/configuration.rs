//! Configuration of a running agent: links, settings, other agents, snapshots.

use std::path::Path;
use std::sync::Arc;

use super::Composer;
use crate::agent::links::{LinkEditor, LinkStatus, NewLink, RemoteEnd};
use crate::agent::remote_links::RemoteLinks;
use crate::agent::settings::SettingsChanger;
use crate::agent::snapshot::{SnapshotRestorer, SnapshotTaker};
use crate::sharing::{Inspection, RemotePath, TeamExchange};
use crate::snapshot::{ApplicationState, PluginMark, Snapshot, SnapshotError};
use slate_configuration::{Change, Database, Diagnostic, Proposal, Report};

impl Composer {
    /// Lists the links of the agent, by their destinations.
    pub fn links(&self) -> Vec<LinkStatus> {
        LinkEditor::new(&self.agent).links()
    }

    /// Returns the links that are missing, as diagnostics.
    /// These are ports of blocks without a link, and actuators whose commands reach nothing. None of them keeps the
    /// agent from running.
    pub fn loose_ends(&self) -> Vec<Diagnostic> {
        LinkEditor::new(&self.agent).loose_ends()
    }

    /// Links an input between two cycles; the states of all modules are kept.
    /// The input may have another link, or a value. An outbox leaves its earlier inbox. The configuration has the link
    /// from then on, so that it can be saved.
    ///
    /// # Errors
    /// The mismatches; nothing is changed then.
    pub fn link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).link(link)
    }

    /// Checks a [`link`](Composer::link) without making it.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub fn check_link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_link(link)
    }

    /// Checks a link to another agent's property that is not on the board yet.
    /// Returns the mismatch that makes the link wait, with its remedy.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub fn mismatch(
        &self,
        link: &NewLink,
        path: RemotePath,
        property: &RemoteEnd<'_>,
    ) -> Result<Option<(String, String)>, Report> {
        LinkEditor::new(&self.agent).mismatch(link, path, property)
    }

    /// Removes the links of an input or inbox.
    /// An input then has its set value, or that of an input which was never written.
    ///
    /// # Errors
    /// When the link is unknown, or a module needs it; nothing is changed then.
    pub fn unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).unlink(to)
    }

    /// Removes one sender of an inbox, or works as [`unlink`](Composer::unlink).
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).unlink_from(to, from)
    }

    /// Checks an [`unlink`](Composer::unlink) without making it.
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn check_unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_unlink(to)
    }

    /// Checks the removal of one sender of an inbox without making it.
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn check_unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).check_unlink_from(to, from)
    }

    /// Applies changes of the configuration.
    /// Fails if they change links and a module blocks that.
    ///
    /// # Errors
    /// The errors in them.
    pub fn commit(&self, propose: impl Fn() -> Result<Proposal, Report>) -> Result<Vec<Change>, Report> {
        LinkEditor::new(&self.agent).commit(propose)
    }

    /// Refuses changes of links that a module blocks.
    ///
    /// # Errors
    /// The links that a module blocks.
    pub fn checked(&self, proposal: Proposal) -> Result<Proposal, Report> {
        LinkEditor::new(&self.agent).checked(proposal)
    }

    /// Logs changes of the configuration, with the values before and after.
    pub fn say_changes(&self, what: &str, changes: &[Change]) {
        SettingsChanger::new(&self.agent).say_changes(what, changes)
    }

    /// Value of a module's setting without any in the configuration.
    pub fn default_at(&self, path: &str) -> Option<String> {
        SettingsChanger::new(&self.agent).default_at(path)
    }

    /// Names of the agents with an endpoint in the configuration.
    pub fn named_agents(&self) -> Vec<String> {
        RemoteLinks::new(&self.agent).named_agents()
    }

    /// Inspection of other agents; `None` if this agent shares nothing.
    pub fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        RemoteLinks::new(&self.agent).inspection()
    }

    /// The agent's part in its team's knowledge; `None` if it takes no part.
    /// It is for networks that reach other robots.
    pub fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        RemoteLinks::new(&self.agent).team()
    }

    /// Present time of the sharing's monotonic clock, ns.
    pub fn steady_now(&self) -> u64 {
        RemoteLinks::new(&self.agent).steady_now()
    }

    /// Returns the whole present configuration, as TOML.
    /// It includes the settings of the command line and all changes since.
    pub fn configuration_text(&self) -> String {
        SnapshotTaker::new(&self.agent).configuration_text()
    }

    /// Returns the loaded plugins, each with a hash.
    /// The hash is over the library, or over the descriptions of the modules.
    pub fn plugin_marks(&self) -> Vec<PluginMark> {
        SnapshotTaker::new(&self.agent).plugin_marks()
    }

    /// Adds content of the application to all later snapshots, under a name.
    pub fn add_application_state(&self, name: &str, state: Arc<dyn ApplicationState>) {
        SnapshotTaker::new(&self.agent).add_application_state(name, state)
    }

    /// Takes a snapshot, writes it to a file and returns it.
    /// The loop continues meanwhile.
    ///
    /// # Errors
    /// As [`snapshot`](Composer::snapshot) and [`Snapshot::write`].
    pub fn save_snapshot(&self, file: &Path) -> Result<Snapshot, SnapshotError> {
        SnapshotTaker::new(&self.agent).save(file)
    }

    /// Takes a snapshot of the agent between two cycles.
    /// No module is in a tick then. The call only copies, so the loop continues soon; [`Snapshot::write`] writes the
    /// snapshot to a file, in any thread.
    ///
    /// # Errors
    /// When a module has not returned from its last call, or its state can't be saved.
    pub fn snapshot(&self) -> Result<Snapshot, SnapshotError> {
        SnapshotTaker::new(&self.agent).snapshot()
    }

    /// Restores a snapshot between two cycles.
    /// Real actuators are disarmed; those that arm themselves return to their state in the snapshot, unless they are
    /// stopped now. Settings that differ in the snapshot are changed in the `database`, if there is one.
    ///
    /// Services of the host that a module uses begin afresh, as with new code: the module must open its handles again.
    ///
    /// # Errors
    /// The mismatches; the agent continues unchanged.
    pub fn restore(&self, snapshot: &Snapshot, database: Option<&Database>) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.agent).restore(snapshot, database)
    }

    /// Restores a snapshot as [`restore`](Composer::restore), under own settings.
    /// Parameters, switches and values of inputs keep the values with which the agent was loaded, where the snapshot's
    /// configuration has others.
    ///
    /// # Errors
    /// The mismatches; the agent continues unchanged.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.agent).restore_under_own_settings(snapshot)
    }
}

//! Links of a running agent.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use slate_blackboard::interface::Descriptor;
use slate_blackboard::is_within;
use slate_module::Direction;

use super::build::HostResources;
use super::handle::AgentHandle;
use crate::sharing::RemotePath;
use slate_composition::{Catalogue, DiagnosticCollector, survey, unlinked_warnings};
use slate_configuration::{
    Change, Configuration, Database, Diagnostic, ExternalDirection, ExternalLink, ExternalUrl, Link,
    Proposal, Report,
};
use slate_configuration::{ErrorCode, TEAM, link_setting, sender_setting};

/// Link to be made while the agent runs.
///
/// ```
/// use std::time::Duration;
/// use slate_runtime::NewLink;
///
/// let link = NewLink::new("follower/pose", "localizer/pose").previous(true).stale(Duration::from_millis(200));
/// assert_eq!(link.to, "follower/pose");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewLink {
    /// The destination: an input such as `follower/pose`, or an inbox.
    pub to: String,
    /// Source: the property that the input reads, or the outbox of an inbox.
    pub from: String,
    /// Further options: keys and values of the link's table, as in a configuration.
    options: Vec<(String, String)>,
}

impl NewLink {
    /// A link from a property to an input, or from an outbox to an inbox.
    pub fn new(to: impl Into<String>, from: impl Into<String>) -> Self {
        Self { to: to.into(), from: from.into(), options: Vec::new() }
    }

    /// Makes the link read the value of the last cycle if `previous` is true.
    pub fn previous(self, previous: bool) -> Self {
        if previous { self.with("previous", "true") } else { self }
    }

    /// Sets the age from which a value counts as stale.
    pub fn stale(self, age: Duration) -> Self {
        self.with("stale", format!("\"{}ns\"", age.as_nanos()))
    }

    /// Sets another option, such as `every`, to a value as in a configuration.
    /// Invalid options are refused when the link is made.
    pub fn with(mut self, option: impl Into<String>, value: impl Into<String>) -> Self {
        self.options.push((option.into(), value.into()));
        self
    }

    /// Returns the changes of the configuration that make the link.
    /// The first one removes the options of an earlier link; an inbox keeps its other senders.
    fn changes(&self, to: &str, sends: bool) -> Vec<(String, String)> {
        let options =
            || self.options.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>();
        if sends {
            let path = sender_setting(to, &self.from);
            let mut changes = vec![(path.clone(), "true".to_owned())];
            if !self.options.is_empty() {
                changes.push((path, format!("{{ {} }}", options().join(", "))));
            }
            return changes;
        }
        let path = link_setting(to);
        let from = quoted(&self.from);
        let mut changes = vec![(path.clone(), from.clone())];
        if !self.options.is_empty() {
            changes.push((path, format!("{{ from = {from}, {} }}", options().join(", "))));
        }
        changes
    }
}

/// A property of another agent, as the end of a link.
#[derive(Clone, Copy, Debug)]
pub struct RemoteEnd<'a> {
    /// Path in that agent.
    pub path: &'a str,
    /// Interface.
    pub descriptor: &'static Descriptor,
    /// True for a mailbox.
    pub takes_messages: bool,
}

/// State of a link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkStatus {
    /// The destination: an input or an inbox.
    pub to: String,
    /// The source: a property or an outbox.
    pub from: String,
    /// True if the link carries messages, from an outbox to an inbox.
    pub sends: bool,
    /// True if the link is inferred, as types and roles leave one choice only.
    pub inferred: bool,
    /// True if one end is a program that is not an agent, such as `ros2:/scan`.
    pub external: bool,
    /// Further options: keys and values of the link's table in the configuration.
    pub options: Vec<(String, String)>,
    /// Values waiting in a queue input, and values lost because it was too slow.
    /// `None` for other inputs.
    pub queue: Option<(u64, u64)>,
    /// Age of an input's value in the last measured step of its reader, ns.
    /// In the agent's time; `None` for queue inputs.
    pub age: Option<u64>,
    /// True for a queue input that fell behind and is cut off, as its link demands.
    pub evicted: bool,
    /// Reason for which the link carries nothing; `None` if it works.
    /// The remote end is absent, or a module blocks the link.
    pub trouble: Option<String>,
}

/// Editor of links, which lists, makes and removes them.
pub(super) struct LinkEditor<'c> {
    agent: &'c AgentHandle,
}

impl<'c> LinkEditor<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Lists the links of the agent, by their destinations.
    pub fn links(&self) -> Vec<LinkStatus> {
        let composition = self.agent.composition();
        let gauge = |link: &Link| composition.assembly.resources.gauges.get(&link.to.value);
        let unmade = composition.unmade();
        let mismatches = &composition.assembly.mismatches;
        let trouble = |link: &Link| {
            let trouble = composition.remotes.trouble(&composition.configuration, link, mismatches);
            let ends = [link.to.value.clone(), link.from.value.path_in("")];
            let mut unmade = unmade.iter().filter(|(port, _)| ends.iter().any(|end| is_within(end, port)));
            trouble.or_else(|| unmade.next().map(|(_, reason)| reason.clone()))
        };
        let status = |link: &Link| LinkStatus {
            queue: gauge(link)
                .map(|gauge| (gauge.lag.load(Ordering::Relaxed), gauge.lost.load(Ordering::Relaxed))),
            age: composition.assembly.resources.ages.get(&link.to.value).and_then(|age| age.get()),
            evicted: gauge(link).is_some_and(|gauge| gauge.evicted.load(Ordering::Relaxed)),
            options: composition.configuration.link_options(link),
            inferred: link.is_inferred(),
            external: false,
            sends: composition.assembly.sends(&link.to.value, &link.from.value.path_in("")),
            to: link.to.value.clone(),
            from: link.from.value.to_string(),
            trouble: trouble(link),
        };
        let configuration = &composition.configuration;
        let resources = &composition.assembly.resources;
        let external = configuration.external_links().iter().map(|link| self.external(link, resources));
        configuration.links().iter().map(status).chain(external).collect()
    }

    /// A link whose other end is a program that is not an agent.
    fn external(&self, link: &ExternalLink, resources: &HostResources) -> LinkStatus {
        let (to, from) = link.ends();
        // A bridge says what fills the input as long as it does.
        let property = self.agent.board().find(&link.path.value).ok();
        let is_idle = link.direction == ExternalDirection::In
            && property.is_some_and(|(property, _)| property.external().is_empty());
        LinkStatus {
            queue: resources
                .gauges
                .get(&to)
                .map(|gauge| (gauge.lag.load(Ordering::Relaxed), gauge.lost.load(Ordering::Relaxed))),
            age: resources.ages.get(&to).and_then(|age| age.get()),
            evicted: false,
            options: link.option_texts(),
            inferred: false,
            external: true,
            sends: false,
            trouble: is_idle.then(|| format!("nothing carries `{}:` here", link.other.value.scheme)),
            to,
            from,
        }
    }

    /// Returns the links that are missing, as diagnostics.
    /// These are ports of blocks without a link, and actuators whose commands reach nothing.
    pub fn loose_ends(&self) -> Vec<Diagnostic> {
        let composition = self.agent.composition();
        loose_ends(&composition.configuration, &composition.catalogue)
    }

    /// Links an input between two cycles; the states of all modules are kept.
    pub fn link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        let (database, path) = self.destination(&link.to)?;
        self.commit(|| self.linking(&database, link, &path))
    }

    /// Checks a [`link`](LinkEditor::link) without making it.
    pub fn check_link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        let (database, path) = self.destination(&link.to)?;
        Ok(self.changes_of(&self.checked(self.linking(&database, link, &path)?)?))
    }

    /// Proposes the configuration with a link.
    /// An outbox sends to one inbox, so its link to another inbox is removed.
    fn linking(&self, database: &Database, link: &NewLink, to: &str) -> Result<Proposal, Report> {
        let changes = link.changes(to, self.sends(to, &link.from));
        let Some((left, from)) = self.left_by(link, to) else { return database.propose(&changes) };
        let path = written(&database.current(), &left, Some(&from));
        let is_it = |own: &Link| own.to.value == left && own.from.value.path_in("") == from;
        // One that was made at run time leaves nothing behind; one of a file is overlaid.
        match database.propose_instead(&[&path], &changes) {
            Ok(moved) if !moved.configuration().links().iter().any(is_it) => Ok(moved),
            _ => database.propose(&[vec![(path, "false".to_owned())], changes].concat()),
        }
    }

    /// Returns the inbox that an outbox loses by a new link, and the outbox's path.
    fn left_by(&self, link: &NewLink, to: &str) -> Option<(String, String)> {
        let composition = self.agent.composition();
        let from = composition.configuration.own_path(&link.from).ok()?;
        let mut links =
            composition.configuration.links().iter().filter(|_| composition.assembly.sends(to, &from));
        let left = links.find(|own| {
            own.to.value != to
                && own.from.value.path_in("") == from
                && composition.assembly.sends(&own.to.value, &from)
        })?;
        Some((left.to.value.clone(), from))
    }

    /// Checks a link to another agent's property that is not on the board yet.
    /// Returns the mismatch that makes the link wait, with its remedy.
    pub fn mismatch(
        &self,
        link: &NewLink,
        path: RemotePath,
        property: &RemoteEnd<'_>,
    ) -> Result<Option<(String, String)>, Report> {
        let (database, to) = self.destination(&link.to)?;
        let proposal = self.linking(&database, link, &to)?;
        let configuration = proposal.configuration();
        let url = path.to_string();
        let descriptor = property.descriptor;
        // Its writer is only known when it is served.
        let (path_there, part) = (property.path.into(), "?".into());
        let found = slate_composition::RemoteProperty { path: path_there, descriptor, part, epoch: 0 };
        let target = self.agent.composition().target(|catalogue| drop(catalogue.remote.insert(path, found)));
        let survey = survey(configuration, &target.catalogue, &mut DiagnosticCollector::new(configuration));
        if let Some(mismatch) = survey.mismatches.get(&to) {
            return Ok(Some((mismatch.message.clone(), mismatch.help.clone())));
        }
        let ports = survey.modules.iter().flat_map(|surveyed| {
            let name = &surveyed.module.name.value;
            surveyed.description.ports.iter().map(move |port| (format!("{name}/{}", port.name), port))
        });
        // The end of the link that is here.
        let to = if to.starts_with("slate://") { configuration.own_path(&link.from)? } else { to };
        let port = ports.into_iter().find(|(path, _)| *path == to).map(|(_, port)| port);
        let sends = port.is_some_and(|port| port.direction == Direction::Outbox);
        Ok(match (sends, property.takes_messages) {
            (true, false) => {
                Some((format!("`{to}` sends messages, and `{url}` is a value"), "link it to an inbox".into()))
            }
            (false, true) => {
                Some((format!("`{url}` takes messages, and has no value"), "link an outbox to it".into()))
            }
            (true, true) => port.filter(|port| port.descriptor.hash != descriptor.hash).map(|port| {
                let message =
                    format!("`{to}` is {} but `{url}` is {}", port.descriptor.name, descriptor.name);
                (message, "messages have the same interface at both ends".into())
            }),
            (false, false) => None,
        })
    }

    /// Removes the links of an input or inbox.
    pub fn unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        self.unlink_from(to, None)
    }

    /// Removes one sender of an inbox, or works as [`unlink`](LinkEditor::unlink).
    pub fn unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        let (database, cut) = self.linked(to, from)?;
        self.commit(|| self.without(&database, &cut))
    }

    /// Checks an [`unlink`](LinkEditor::unlink) without making it.
    pub fn check_unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        self.check_unlink_from(to, None)
    }

    /// Checks the removal of one sender of an inbox without making it.
    pub fn check_unlink_from(&self, to: &str, from: Option<&str>) -> Result<Vec<Change>, Report> {
        let (database, cut) = self.linked(to, from)?;
        Ok(self.changes_of(&self.checked(self.without(&database, &cut)?)?))
    }

    /// Returns the database and the link's destination.
    /// The destination is a path, or the URL of another agent's inbox.
    fn destination(&self, to: &str) -> Result<(Database, String), Report> {
        let composition = self.agent.composition();
        if ExternalUrl::parse(to).is_some() {
            return Ok((composition.database()?, to.to_owned()));
        }
        let own = composition.configuration.agent_name();
        let other = slate_blackboard::Url::parse(to)
            .ok()
            .filter(|url| url.agent().is_some_and(|agent| agent != own && agent != TEAM));
        let path = match other {
            Some(url) => url.to_string(),
            None => composition.configuration.own_path(to)?,
        };
        Ok((composition.database()?, path))
    }

    /// Returns true if a link carries messages.
    fn sends(&self, to: &str, from: &str) -> bool {
        let from = slate_blackboard::Url::parse(from).map(|url| url.path_in("")).unwrap_or_default();
        self.agent.composition().assembly.sends(to, &from)
    }

    fn linked(&self, to: &str, from: Option<&str>) -> Result<(Database, Cut), Report> {
        let (database, path) = self.destination(to)?;
        let configuration = Arc::clone(&self.agent.composition().configuration);
        let from = from.map(|from| configuration.own_path(from)).transpose()?;
        let is_it = |link: &&Link| {
            link.to.value == path && from.as_ref().is_none_or(|from| link.from.value.path_in("") == *from)
        };
        let mut own = configuration.links().iter().filter(is_it).peekable();
        if own.peek().is_some() {
            let inferred = own.filter(|link| link.is_inferred()).map(|link| link.setting().0).collect();
            return Ok((database, Cut { to: path, from, inferred }));
        }
        if let Some(from) = from.filter(|_| configuration.links().iter().any(|link| link.to.value == path)) {
            let links = configuration.links().iter().filter(|link| link.to.value == path);
            let senders: Vec<_> = links.map(|link| link.from.value.to_string()).collect();
            let message = ErrorCode::Name.of(format!("`{path}` has no link from `{from}`"));
            let help = format!("its links are from: {}", senders.join(", "));
            return Err(Diagnostic::without_place(message, Some(help)).into());
        }
        let mut external = configuration.external_links().iter();
        if let Some(link) = external.find(|link| link.ends().0 == path) {
            let (message, help) = unchanging(link);
            return Err(Diagnostic::without_place(message, Some(help)).into());
        }
        let known = configuration.links().iter().map(|link| link.to.value.as_str());
        let near = slate_blackboard::nearest_names(&path, known.clone());
        let help = match (near.is_empty(), known.clone().next()) {
            (false, _) => format!("did you mean {}?", near.join(" or ")),
            (true, Some(_)) => format!("linked are: {}", known.collect::<Vec<_>>().join(", ")),
            (true, None) => "the agent has no links".into(),
        };
        Err(Diagnostic::without_place(ErrorCode::Name.of(format!("`{path}` has no link")), Some(help)).into())
    }

    /// Applies changes of the configuration.
    /// Fails if they change links and a module blocks that.
    pub fn commit(&self, propose: impl Fn() -> Result<Proposal, Report>) -> Result<Vec<Change>, Report> {
        loop {
            let proposal = self.checked(propose()?)?;
            let changes = self.changes_of(&proposal);
            // Somebody else may be faster.
            if proposal.apply().is_some() {
                return Ok(changes);
            }
        }
    }

    /// Returns the changes of a proposal, with those of inferred links.
    /// Inferred links give way to written ones, or return.
    fn changes_of(&self, proposal: &Proposal) -> Vec<Change> {
        let mut changes = proposal.changes().to_vec();
        if changes.iter().any(|change| change.names().first().is_some_and(|name| name == "links")) {
            let composition = self.agent.composition();
            let (before, after) =
                (&composition.configuration, composition.with_inferred_links(proposal.configuration()));
            for change in &mut changes {
                if change.before.is_none() {
                    change.before = before.inferred_value(change.names());
                }
                if change.after.is_none() {
                    change.after = after.configuration().inferred_value(change.names());
                }
            }
        }
        changes
    }

    /// Proposes the configuration without a link.
    /// A link made at run time leaves no trace, unless another one is inferred then; a link of a file is overlaid.
    fn without(&self, database: &Database, cut: &Cut) -> Result<Proposal, Report> {
        if !cut.inferred.is_empty() {
            let mut changes: Vec<_> = cut.inferred.iter().map(|path| (path.clone(), "false")).collect();
            if database.current().links().iter().any(|link| link.to.value == cut.to) && cut.from.is_none() {
                changes = vec![(link_setting(&cut.to), "false")];
            }
            return database.propose(&changes);
        }
        let is_it = |link: &Link| {
            let from = || link.from.value.path_in("");
            link.to.value == cut.to && cut.from.as_ref().is_none_or(|cut| from() == *cut)
        };
        let has_it = |configuration: &Configuration| {
            let linked = self.agent.composition().with_inferred_links(configuration);
            linked.configuration().links().iter().any(is_it)
        };
        let path = written(&database.current(), &cut.to, cut.from.as_deref());
        match database.revert(&path) {
            Ok(reverted) if !has_it(reverted.configuration()) => Ok(reverted),
            _ => database.propose(&[(path, "false")]),
        }
    }

    /// Refuses changes of links that a module blocks.
    pub fn checked(&self, proposal: Proposal) -> Result<Proposal, Report> {
        if proposal.changes().iter().any(|change| change.names().first().is_some_and(|name| name == "links"))
        {
            self.agent.composition().check_returned(proposal.configuration())?;
        }
        Ok(proposal)
    }
}

/// Returns the links that are missing in a configuration.
fn loose_ends(configuration: &Configuration, catalogue: &Catalogue) -> Vec<Diagnostic> {
    let survey = survey(configuration, catalogue, &mut DiagnosticCollector::new(configuration));
    unlinked_warnings(configuration, &survey)
}

/// Returns the links that are missing after a change, but not before.
pub(super) fn new_loose_ends(
    before: &Configuration,
    after: &Configuration,
    catalogue: &Catalogue,
) -> Vec<Diagnostic> {
    let mut found = loose_ends(after, catalogue);
    if !found.is_empty() {
        let earlier = loose_ends(before, catalogue);
        found.retain(|end| !earlier.iter().any(|old| old.message() == end.message()));
    }
    found
}

/// Message and remedy for a link to a program that is not an agent.
/// Such links can't change while the agent runs.
pub(super) fn unchanging(link: &ExternalLink) -> (String, String) {
    let (to, from) = link.ends();
    let message = format!("the link from `{from}` to `{to}` can't change while the agent runs");
    let help = "it takes effect at the next start: write it into the file, and start the agent again";
    (message, help.into())
}

/// Removal of a link, or of all links of an inbox.
struct Cut {
    to: String,
    from: Option<String>,
    /// Settings of the inferred links among them.
    inferred: Vec<String>,
}

/// Returns the path of a link's setting.
/// For an inbox with its senders listed one by one, it is the setting of the sender.
fn written(configuration: &Configuration, to: &str, from: Option<&str>) -> String {
    let sender = from.map(|from| sender_setting(to, &format!("/{from}")));
    sender.filter(|path| configuration.value(path).is_some()).unwrap_or_else(|| link_setting(to))
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}

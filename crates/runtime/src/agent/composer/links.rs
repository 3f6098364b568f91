//! Links of an agent that runs.

use std::sync::atomic::Ordering;
use std::time::Duration;

use slate_blackboard::interface::Descriptor;
use slate_blackboard::is_within;
use slate_module::Direction;

use super::Composer;
use crate::agent::composition::Composition;
use crate::configuration::{Change, Database, Diagnostic, Link, Proposal, Report};
use crate::sharing::RemotePath;
use slate_composition::{Complaints, survey};
use slate_configuration::{Mistake, link_setting};

/// A link to be made while the agent runs.
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
    /// The input, such as `follower/pose`.
    pub to: String,
    /// The property that it reads.
    pub from: String,
    /// What else is said of it: keys and values of its table, as a configuration has them.
    options: Vec<(String, String)>,
}

impl NewLink {
    /// A link from a property to an input.
    pub fn new(to: impl Into<String>, from: impl Into<String>) -> Self {
        Self { to: to.into(), from: from.into(), options: Vec::new() }
    }

    /// Whether it reads last cycle's value.
    pub fn previous(self, previous: bool) -> Self {
        if previous { self.with("previous", "true") } else { self }
    }

    /// The age from which a value counts as stale.
    pub fn stale(self, age: Duration) -> Self {
        self.with("stale", format!("\"{}ns\"", age.as_nanos()))
    }

    /// Sets another option, such as `every`, to a value as a configuration has it; what can't be is refused when the link
    /// is made.
    pub fn with(mut self, option: impl Into<String>, value: impl Into<String>) -> Self {
        self.options.push((option.into(), value.into()));
        self
    }

    /// The changes of the configuration. The first takes away what an earlier link said besides.
    fn changes(&self, to: &str) -> Vec<(String, String)> {
        let path = link_setting(to);
        let from = quoted(&self.from);
        let mut changes = vec![(path.clone(), from.clone())];
        if !self.options.is_empty() {
            let options: Vec<_> =
                self.options.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            changes.push((path, format!("{{ from = {from}, {} }}", options.join(", "))));
        }
        changes
    }
}

/// A property that a link to another agent would lead to.
pub(crate) struct Property<'a> {
    pub path: &'a str,
    pub descriptor: &'static Descriptor,
    pub takes_messages: bool,
}

/// A link that there is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkStatus {
    /// The input.
    pub to: String,
    /// What it reads.
    pub from: String,
    /// What else the configuration says of it: keys and values of its table.
    pub options: Vec<(String, String)>,
    /// For a queue input: how many values wait for it, and how many it has lost because it was too slow.
    pub queue: Option<(u64, u64)>,
    /// For an input of a value: how old that was in the step of its reader that was measured last, ns of the agent's time.
    pub age: Option<u64>,
    /// Whether it is a queue input that fell behind and reads no more, as its link says.
    pub evicted: bool,
    /// Why it brings nothing: what it leads to of another agent is not there, or a module is in the way of it.
    pub trouble: Option<String>,
}

impl Composer {
    /// The links that the agent has, by their inputs.
    pub fn links(&self) -> Vec<LinkStatus> {
        let composition = self.composition();
        let gauge = |link: &Link| composition.ground.gauges.get(&link.to.value);
        let unmade = composition.unmade();
        let trouble = |link: &Link| {
            let trouble = composition.remotes.trouble(&composition.configuration, link);
            let to = &link.to.value;
            let mut unmade = unmade.iter().filter(|(port, _)| is_within(to, port));
            trouble.or_else(|| unmade.next().map(|(_, reason)| reason.clone()))
        };
        let status = |link: &Link| LinkStatus {
            queue: gauge(link)
                .map(|gauge| (gauge.lag.load(Ordering::Relaxed), gauge.lost.load(Ordering::Relaxed))),
            age: composition.ground.ages.get(&link.to.value).and_then(|age| age.get()),
            evicted: gauge(link).is_some_and(|gauge| gauge.evicted.load(Ordering::Relaxed)),
            options: composition.configuration.link_options(&link.to.value),
            to: link.to.value.clone(),
            from: link.from.value.to_string(),
            trouble: trouble(link),
        };
        composition.configuration.links().iter().map(status).collect()
    }

    /// Links an input, between two cycles and with the states of all modules as they are; it may have another link, or a
    /// value. The configuration has the link from then on, so that it can be saved.
    ///
    /// # Errors
    /// What does not fit; nothing is changed then.
    pub fn link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        let (database, path) = self.input(&link.to)?;
        let changes = link.changes(&path);
        self.commit(|| database.propose(&changes))
    }

    /// Whether a link could be made: as [`link`](Composer::link), and nothing is changed.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub fn check_link(&self, link: &NewLink) -> Result<Vec<Change>, Report> {
        let (database, path) = self.input(&link.to)?;
        Ok(self.judged(database.propose(&link.changes(&path))?)?.changes().to_vec())
    }

    /// Why a link to that property of another agent would wait, which is not on the board yet: what of it does not fit, and
    /// what to do.
    ///
    /// # Errors
    /// As [`link`](Composer::link).
    pub(crate) fn misfit(
        &self,
        link: &NewLink,
        path: RemotePath,
        property: &Property,
    ) -> Result<Option<(String, String)>, Report> {
        let (database, to) = self.input(&link.to)?;
        let proposal = database.propose(&link.changes(&to))?;
        let configuration = proposal.configuration();
        let url = path.to_string();
        let descriptor = property.descriptor;
        let found = slate_composition::RemoteProperty { path: property.path.into(), descriptor, epoch: 0 };
        let target = self.composition().target(|catalogue| drop(catalogue.remote.insert(path, found)));
        let survey = survey(configuration, &target.catalogue, &mut Complaints::new(configuration));
        if let Some(misfit) = survey.misfits.get(&to) {
            return Ok(Some((misfit.message.clone(), misfit.help.clone())));
        }
        let ports = survey.modules.iter().flat_map(|surveyed| {
            let name = &surveyed.module.name.value;
            surveyed.description.ports.iter().map(move |port| (format!("{name}/{}", port.name), port))
        });
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

    /// Takes the link of an input away, which then has the value that is set for it, or that of an input which was never
    /// written.
    ///
    /// # Errors
    /// When there is no such link, or a module needs it; nothing is changed then.
    pub fn unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        let (database, path) = self.linked(to)?;
        self.commit(|| without(&database, &path))
    }

    /// Whether a link could be taken away: as [`unlink`](Composer::unlink), and nothing is changed.
    ///
    /// # Errors
    /// As [`unlink`](Composer::unlink).
    pub fn check_unlink(&self, to: &str) -> Result<Vec<Change>, Report> {
        let (database, path) = self.linked(to)?;
        Ok(self.judged(without(&database, &path)?)?.changes().to_vec())
    }

    /// The database, and the path of what a link feeds.
    fn input(&self, to: &str) -> Result<(Database, String), Report> {
        let composition = self.composition();
        let path = composition.configuration.own_path(to)?;
        Ok((composition.database()?, path))
    }

    fn linked(&self, to: &str) -> Result<(Database, String), Report> {
        let (database, path) = self.input(to)?;
        let configuration = database.current();
        if configuration.links().iter().any(|link| link.to.value == path) {
            return Ok((database, path));
        }
        let known = configuration.links().iter().map(|link| link.to.value.as_str());
        let near = slate_blackboard::nearest_names(&path, known.clone());
        let help = match (near.is_empty(), known.clone().next()) {
            (false, _) => format!("did you mean {}?", near.join(" or ")),
            (true, Some(_)) => format!("linked are: {}", known.collect::<Vec<_>>().join(", ")),
            (true, None) => "the agent has no links".into(),
        };
        Err(Diagnostic::without_place(Mistake::Name.of(format!("`{path}` has no link")), Some(help)).into())
    }

    /// Makes changes of the configuration, unless links are among them that a module is in the way of.
    pub(crate) fn commit(
        &self,
        propose: impl Fn() -> Result<Proposal, Report>,
    ) -> Result<Vec<Change>, Report> {
        loop {
            // Somebody else may be faster.
            if let Some(changes) = self.judged(propose()?)?.apply() {
                return Ok(changes);
            }
        }
    }

    /// Refuses changes of links that a module is in the way of.
    pub(crate) fn judged(&self, proposal: Proposal) -> Result<Proposal, Report> {
        if proposal.changes().iter().any(|change| change.names().first().is_some_and(|name| name == "links"))
        {
            self.check_returned(proposal.configuration())?;
        }
        Ok(proposal)
    }
}

impl Composition {
    pub(in crate::agent) fn database(&self) -> Result<Database, Report> {
        self.database.clone().ok_or_else(|| {
            let message = "the configuration of this agent can't change while it runs";
            Diagnostic::without_place(message, Some("load it with a database".into())).into()
        })
    }
}

/// The configuration without a link. One that was made at run time leaves nothing behind; one of a file is overlaid.
fn without(database: &Database, path: &str) -> Result<Proposal, Report> {
    let has_it =
        |proposal: &Proposal| proposal.configuration().links().iter().any(|link| link.to.value == path);
    match database.revert(&link_setting(path)) {
        Ok(reverted) if !has_it(&reverted) => Ok(reverted),
        _ => database.propose(&[(link_setting(path), "false")]),
    }
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}

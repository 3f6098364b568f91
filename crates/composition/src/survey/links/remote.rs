//! Links to other agents.
//! An error at the other end makes a link wait, as that end may change.

use std::sync::Arc;

use slate_module::Direction;
use slate_sorted::SortedSet;

use super::ends::TargetField;
use super::fit;
use super::sinks::LinkSink;
use crate::RemotePath;
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
use crate::link::FieldPlace;
use crate::survey::{LinkConversion, LinkEnd, LinkMismatch, LinkSource, Remote, ResolvedLink, Survey, rules};
use slate_configuration::{Compression, Configuration, ErrorCode, Link, TEAM};

/// Returns the other agent that a link leads to, if any.
pub(super) fn agent(configuration: &Configuration, link: &Link) -> Option<String> {
    path(configuration, link).map(|path| path.agent)
}

/// Returns the target of a link in another agent.
pub fn path(configuration: &Configuration, link: &Link) -> Option<RemotePath> {
    let ends = [Some(link.from.value.clone()), link.destination()];
    ends.into_iter().flatten().find_map(|url| {
        let agent = url.agent().filter(|agent| *agent != configuration.agent_name())?;
        Some(RemotePath { agent: agent.into(), path: url.path_in("") })
    })
}

/// Mismatch of a link whose carrier differs from that of the agent.
/// The link waits while it names another carrier.
pub fn carrier_mismatch(configuration: &Configuration, link: &Link) -> Option<LinkMismatch> {
    let agent = agent(configuration, link).filter(|agent| agent != TEAM)?;
    let carrier = &link.transport.carrier.as_ref()?.value;
    let endpoint = configuration.endpoint_of(&agent);
    let used = endpoint.split(':').next().unwrap_or_default();
    (used != carrier).then(|| LinkMismatch {
        message: format!("agent `{agent}` is at {endpoint}, and not by `{carrier}`"),
        help: format!(
            "leave `carrier` out, or set the agent's address: share.agents.{agent}.at = \"{carrier}:...\""
        ),
    })
}

/// Returns the targets of links in other agents.
pub(super) fn all(configuration: &Configuration, catalogue: &Catalogue) -> Vec<Remote> {
    if !catalogue.shares {
        return Vec::new();
    }
    let paths: SortedSet<_> =
        configuration.links().iter().filter_map(|link| path(configuration, link)).collect();
    let remote = |path: RemotePath| Remote { property: catalogue.remote.get(&path).cloned(), path };
    paths.into_iter().map(remote).collect()
}

impl Remote {
    /// Returns the name of the property in messages.
    pub fn name(&self) -> String {
        let path = self.property.as_ref().map_or(&self.path.path, |found| &found.path);
        format!("/{}/{path}", self.path.agent)
    }

    /// Returns the field of the property that the link names.
    fn field(&self) -> Option<&str> {
        let rest = self.path.path.strip_prefix(self.property.as_ref()?.path.as_str())?;
        Some(rest.trim_start_matches('/'))
    }
}

/// Resolves a link; it waits if it does not match the other end.
pub(super) fn resolved<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    link: &'a Link,
    sink: &LinkSink,
    collector: &mut DiagnosticCollector<'a>,
) -> (Option<ResolvedLink<'a>>, Option<LinkMismatch>) {
    let remote = RemoteLink::checked(configuration, survey, link, sink, collector);
    remote.map_or((None, None), |remote| remote.resolved(collector))
}

/// Link to another agent that passes the checks of this end.
struct RemoteLink<'a, 's> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    link: &'a Link,
    /// The port of this agent.
    sink: &'s LinkSink,
    /// Target of the link; an index of [`Survey::remote`].
    index: usize,
}

impl<'a, 's> RemoteLink<'a, 's> {
    /// Checks a link to another agent; `None` after an error.
    /// Reports only errors that do not depend on the other end.
    fn checked(
        configuration: &'a Configuration,
        survey: &'s Survey<'a>,
        link: &'a Link,
        sink: &'s LinkSink,
        collector: &mut DiagnosticCollector<'a>,
    ) -> Option<Self> {
        let wanted = path(configuration, link)?;
        let Some(index) = survey.remote.iter().position(|remote| remote.path == wanted) else {
            let message = ErrorCode::OtherAgent
                .of(format!("`{wanted}` belongs to agent `{}`, and this one shares nothing", wanted.agent));
            let help = format!(
                "this agent is `{}`: link its own ports, or run it by a program that shares, as `slate run` does",
                configuration.agent_name()
            );
            collector.add(sink.far(link).1, message, help);
            return None;
        };
        if wanted.agent == TEAM && !is_team_link(configuration, link, sink, survey, collector) {
            return None;
        }
        let remote = Self { configuration, survey, link, sink, index };
        remote.can_be_carried(collector).then_some(remote)
    }

    /// Checks that this program has the carrier and the compression of the link.
    /// Returns false after an error.
    fn can_be_carried(&self, collector: &mut DiagnosticCollector<'a>) -> bool {
        let (transport, survey) = (&self.link.transport, self.survey);
        if let Some(carrier) = &transport.carrier
            && !survey.carriers.is_empty()
            && !survey.carriers.contains(&carrier.value)
        {
            let known: Vec<_> = survey.carriers.iter().map(String::as_str).collect();
            let message =
                ErrorCode::OtherAgent.of(format!("this program has no carrier `{}`", carrier.value));
            collector.add(carrier.span, message, format!("available: {}", known.join(", ")));
            return false;
        }
        if let Some(compression) = &transport.compression
            && matches!(compression.value, Compression::Jpeg(_))
            && !survey.has_jpeg
        {
            let help = "write \"lossless\", or build it with the feature `jpeg`, which is there unless it was switched off";
            collector.add(compression.span, "this program was built without JPEG", help);
            return false;
        }
        true
    }

    fn resolved(
        &self,
        collector: &mut DiagnosticCollector<'a>,
    ) -> (Option<ResolvedLink<'a>>, Option<LinkMismatch>) {
        let direction = match self.sink.link_end {
            LinkEnd::Port(port) => self.survey.modules[self.sink.module].description.ports[port].direction,
            LinkEnd::Enabled | LinkEnd::Params => Direction::Input,
        };
        let is_known = self.survey.remote[self.index].property.is_some();
        let mismatch = carrier_mismatch(self.configuration, self.link);
        match direction {
            Direction::Queue if mismatch.is_some() => (None, mismatch),
            // A queue without a link gets nothing, which is what a queue gets that waits for one.
            Direction::Queue if !is_known => (None, None),
            Direction::Outbox => {
                let resolved = self.fitted("", collector);
                // Messages are not sent by another carrier than the one that is meant.
                if mismatch.is_some() { (None, resolved.and(mismatch)) } else { (resolved, None) }
            }
            _ if mismatch.is_some() && self.waiting().is_some() => (self.waiting(), mismatch),
            // An error at this end is reported, whatever is at the other one.
            _ if !is_known || self.waiting().is_none() => {
                (self.fitted("", collector).and_then(|_| self.waiting()), None)
            }
            _ => self.known(direction, collector),
        }
    }

    /// Resolves a link to a property that exists.
    fn known(
        &self,
        direction: Direction,
        collector: &mut DiagnosticCollector<'a>,
    ) -> (Option<ResolvedLink<'a>>, Option<LinkMismatch>) {
        let before = collector.diagnostics.len();
        let field = self.survey.remote[self.index].field().unwrap_or_default();
        if let Some(resolved) = self.fitted(field, collector) {
            return match self.against_rules(&resolved) {
                Some(mismatch) if direction == Direction::Queue => (None, Some(mismatch)),
                Some(mismatch) => (self.waiting(), Some(mismatch)),
                None => (Some(resolved), None),
            };
        }
        let refusals: Vec<_> = collector.diagnostics.drain(before..).collect();
        let mismatch = refusals.first().map(|diagnostic| LinkMismatch {
            message: diagnostic.message().replace("`//", "`slate://"),
            help: diagnostic.help_text().unwrap_or_default().to_owned(),
        });
        (if direction == Direction::Queue { None } else { self.waiting() }, mismatch)
    }

    /// Returns the mismatch of a link that bypasses the architecture.
    fn against_rules(&self, resolved: &ResolvedLink<'a>) -> Option<LinkMismatch> {
        let (_, message, help) = rules::refusal(self.configuration, self.survey, resolved)?;
        Some(LinkMismatch { message: message.replace("`//", "`slate://"), help })
    }

    /// Returns the link to a field of the property, if both ends match.
    fn fitted(&self, field: &str, collector: &mut DiagnosticCollector<'a>) -> Option<ResolvedLink<'a>> {
        let source = TargetField::new(LinkSource::Remote(self.index), field);
        fit::fit(self.configuration, self.survey, &[], self.link, self.sink, source, collector)
    }

    /// Returns the link in its state until the property exists.
    /// `None` if the port has no such field.
    fn waiting(&self) -> Option<ResolvedLink<'a>> {
        let description = &self.survey.modules[self.sink.module].description;
        let descriptor = match self.sink.link_end {
            LinkEnd::Port(port) => description.ports[port].descriptor,
            LinkEnd::Enabled => crate::parameters::enabled_descriptor(),
            LinkEnd::Params => description.params,
        };
        let field = if self.sink.link_end == LinkEnd::Enabled { "value" } else { &self.sink.field };
        let target = FieldPlace::find(descriptor, field).ok()?;
        Some(ResolvedLink {
            link: self.link,
            port: (self.sink.module, self.sink.link_end),
            target: LinkSource::Remote(self.index),
            from: String::new(),
            field: self.sink.field.clone(),
            conversion: LinkConversion::Pending(Arc::new(target)),
            filter: None,
            previous: self.link.previous,
            delayed: false,
        })
    }
}

/// Checks that a link to the team's knowledge makes sense in this agent.
/// Returns false after an error.
fn is_team_link<'a>(
    configuration: &'a Configuration,
    link: &'a Link,
    sink: &LinkSink,
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) -> bool {
    let is_outbox = matches!(sink.link_end, LinkEnd::Port(port)
        if survey.modules[sink.module].description.ports[port].direction == Direction::Outbox);
    let (message, help) = if configuration.share().is_none_or(|share| share.knowledge.is_none()) {
        ("this agent takes part in no team", "add a section [share.knowledge], which may be empty")
    } else if is_outbox {
        ("a team has no inbox", "messages go to one robot: slate://robot/module/inbox")
    } else {
        return true;
    };
    let (far, span) = sink.far(link);
    collector.add(span, ErrorCode::OtherAgent.of(format!("`{far}`: {message}")), help);
    false
}

//! Resolution of a link's source through the links of other inputs.

use slate_blackboard::{Url, is_within};
use slate_module::{Direction, PortDescription};
use slate_sorted::SortedMap;

use super::ends::{self, TargetField};
use super::messages::ungated_command;
use super::missing_slash::without_slash;
use super::sinks::LinkSink;
use super::{fit, remote};
use crate::diagnostic_collector::{DiagnosticCollector, suggest};
use crate::survey::names::{SERVICE, deep_name, is_service, join, owner, split_module, split_port};
use crate::survey::{
    Absent, Host, Implied, LinkEnd, LinkMismatch, LinkSource, ResolvedLink, Survey, Surveyed, block,
};
use slate_configuration::{Configuration, ErrorCode, Link, Message, Span};

pub(super) struct LinkSources<'s, 'a> {
    configuration: &'a Configuration,
    dormant: &'s [&'a str],
    survey: &'s Survey<'a>,
    sinks: &'s [Option<LinkSink>],
    collector: &'s mut DiagnosticCollector<'a>,
    found: Vec<LinkState<'a>>,
    /// Links being followed, outermost first.
    followed: Vec<usize>,
    pub absent: Vec<Absent>,
    pub mismatches: SortedMap<String, LinkMismatch>,
}

#[derive(Clone)]
enum LinkState<'a> {
    Unresolved,
    /// Link that was resolved; `None` after an error.
    ResolvedLink(Option<ResolvedLink<'a>>),
}

impl<'s, 'a> LinkSources<'s, 'a> {
    pub fn new(
        configuration: &'a Configuration,
        dormant: &'s [&'a str],
        survey: &'s Survey<'a>,
        sinks: &'s [Option<LinkSink>],
        collector: &'s mut DiagnosticCollector<'a>,
    ) -> Self {
        let found = vec![LinkState::Unresolved; sinks.len()];
        Self {
            configuration,
            dormant,
            survey,
            sinks,
            collector,
            found,
            followed: Vec::new(),
            absent: Vec::new(),
            mismatches: SortedMap::new(),
        }
    }

    fn modules(&self) -> &'s [Surveyed<'a>] {
        &self.survey.modules
    }

    /// Resolves a link; `None` after an error.
    pub fn resolve_link(&mut self, link: usize) -> Option<ResolvedLink<'a>> {
        if let LinkState::ResolvedLink(resolved) = &self.found[link] {
            return resolved.clone();
        }
        if let Some(at) = self.followed.iter().position(|followed| *followed == link) {
            self.report_cycle(at);
            return None;
        }
        self.followed.push(link);
        let resolved = self.resolve_new(link);
        self.followed.pop();
        // Once more when a circle led here: it was reported then.
        if let LinkState::Unresolved = self.found[link] {
            self.found[link] = LinkState::ResolvedLink(resolved);
        }
        match &self.found[link] {
            LinkState::ResolvedLink(resolved) => resolved.clone(),
            LinkState::Unresolved => None,
        }
    }

    fn report_cycle(&mut self, at: usize) {
        let links = self.configuration.links();
        let mut names: Vec<_> =
            self.followed[at..].iter().map(|link| links[*link].to.value.as_str()).collect();
        names.extend(names.first().copied());
        let span = links[self.followed[at]].from.span;
        let message = ErrorCode::Circle.of(format!("cyclic dependency: {}", names.join(" -> ")));
        self.collector.add(span, message, "link one of them to an output");
        for link in self.followed[at..].iter().copied() {
            self.found[link] = LinkState::ResolvedLink(None);
        }
    }

    fn resolve_new(&mut self, link: usize) -> Option<ResolvedLink<'a>> {
        let sink = self.sinks[link].as_ref()?;
        let link = &self.configuration.links()[link];
        let (far, span) = sink.far(link);
        if remote::agent(self.configuration, link).is_some() {
            let (resolved, mismatch) =
                remote::resolved(self.configuration, self.survey, link, sink, self.collector);
            self.mismatches.extend(mismatch.map(|mismatch| (link.to.value.clone(), mismatch)));
            return resolved;
        }
        if !self.is_own(link, &far) {
            return None;
        }
        let source = self.resolve(span, &far.path_in(""))?;
        fit::fit(self.configuration, self.survey, &self.absent, link, sink, source, self.collector)
    }

    /// Checks that a link inside of this agent has no options for remote links.
    /// Returns false after an error.
    fn is_own(&mut self, link: &Link, far: &Url) -> bool {
        let transport = &link.transport;
        let options = [
            transport.carrier.as_ref().map(|option| ("carrier", option.span)),
            transport.mode.as_ref().map(|option| ("mode", option.span)),
            transport.rate.as_ref().map(|option| ("rate", option.span)),
            transport.interval.as_ref().map(|option| ("interval", option.span)),
            transport.compression.as_ref().map(|option| ("compression", option.span)),
        ];
        for (name, span) in options.iter().flatten() {
            let message =
                ErrorCode::Ends.of(format!("`{name}` has no meaning here: `{far}` is of this agent"));
            let help = "leave it out, or read a property of another agent: slate://agent/module/property";
            self.collector.add(*span, message, help);
        }
        options.iter().all(Option::is_none)
    }

    /// Returns the property and the field at a path, for a link that leaves the agent.
    /// `None` after an error.
    pub fn end(&mut self, span: Span, path: &str) -> Option<(LinkSource, String)> {
        self.resolve(span, path).map(|TargetField { target, field, previous: _ }| (target, field))
    }

    /// Returns whether a source takes messages.
    pub fn is_inbox(&self, target: LinkSource) -> bool {
        match target {
            LinkSource::Port(module, port) => {
                self.modules()[module].description.ports[port].direction == Direction::Inbox
            }
            LinkSource::Played(played) => self.survey.played[played].is_mailbox,
            _ => false,
        }
    }

    pub fn report(&mut self, span: Span, message: Message, help: &str) {
        self.collector.add(span, message, help);
    }

    /// Resolves a path; `None` after an error.
    fn resolve(&mut self, span: Span, path: &str) -> Option<TargetField> {
        if let Some(source) = self.resolve_actuator(path).or_else(|| self.resolve_played(path)) {
            return Some(source);
        }
        let Some((module, rest)) = split_module(self.modules(), path) else {
            return self.resolve_outside_modules(span, path);
        };
        let (name, field) = split_port(&self.modules()[module].description.ports, rest);
        let field = field.to_owned();
        if let Some(implied) = Implied::of(name) {
            if implied == Implied::Enabled
                && let Some(source) = self.follow(span, module, LinkEnd::Enabled, &field)
            {
                return source;
            }
            if implied == Implied::Params && !self.is_acyclic(module, &field) {
                return None;
            }
            return Some(TargetField::new(LinkSource::Implied(module, implied), field));
        }
        let ports = &self.modules()[module].description.ports;
        let Some(at) = ports.iter().position(|port| port.name == name) else {
            let source = |port: &&PortDescription| !is_service(port) && port.direction != Direction::Outbox;
            let name = deep_name(ports, name, rest);
            let names = || ports.iter().filter(source).map(|port| port.name.as_str());
            let help = without_slash(self.configuration, self.survey, span, path)
                .unwrap_or_else(|| suggest(rest, names()));
            let own = &self.modules()[module].module.name.value;
            self.collector.add(span, ErrorCode::Name.of(format!("`{own}` has no output `{name}`")), help);
            return None;
        };
        self.resolve_port(span, path, (module, at), field)
    }

    /// Resolves a path that does not begin with a loaded module's name.
    fn resolve_outside_modules(&mut self, span: Span, path: &str) -> Option<TargetField> {
        if let Some(module) = owner(self.dormant, path) {
            return Some(self.absent(module, path));
        }
        if let Some((host, field)) = Host::of(path) {
            return Some(TargetField::new(LinkSource::Host(host), field));
        }
        let actuators = self.configuration.actuators().iter().map(|actuator| &actuator.name.value);
        let gates = actuators.flat_map(|name| [format!("{name}/command"), format!("{name}/gate")]);
        let gates: Vec<_> = gates.collect();
        let modules = self.modules().iter().map(|surveyed| surveyed.module.name.value.as_str());
        let is_hosts = path.starts_with("loop/") || path.starts_with("log/");
        let hosts = Host::ALL.iter().filter(|_| is_hosts).map(|host| host.path());
        let played = self.survey.played.iter().map(|played| played.path.as_str());
        let gates = gates.iter().map(String::as_str);
        let names: Vec<_> = modules.chain(gates).chain(hosts).chain(played).collect();
        let help = without_slash(self.configuration, self.survey, span, path)
            .unwrap_or_else(|| suggest(path, names.iter().copied()));
        self.collector.add(span, ErrorCode::Name.of(format!("nothing is called `/{path}`")), help);
        None
    }

    /// Resolves a path to a port of a module.
    fn resolve_port(
        &mut self,
        span: Span,
        path: &str,
        (module, at): (usize, usize),
        field: String,
    ) -> Option<TargetField> {
        let (message, help) = match self.modules()[module].description.ports[at].direction {
            Direction::Input | Direction::Queue => {
                return match self.follow(span, module, LinkEnd::Port(at), &field) {
                    Some(source) => source,
                    None => Some(TargetField::new(LinkSource::Port(module, at), field)),
                };
            }
            Direction::Output | Direction::Debug | Direction::Inbox => {
                return Some(TargetField::new(LinkSource::Port(module, at), field));
            }
            Direction::Command => ungated_command(path),
            Direction::Aspect | Direction::Provider => {
                (ErrorCode::Ends.of(format!("`/{path}` is a service")), SERVICE)
            }
            Direction::Outbox => (
                ErrorCode::Ends.of(format!("`/{path}` sends messages")),
                "write it as the source of an inbox: \"receiver/inbox\" = \"sender/outbox\"",
            ),
        };
        self.collector.add(span, message, help);
        None
    }

    /// Follows the link of another input to its source.
    /// Only if that input is linked as a whole to a value of its own type; else its own values are meant.
    fn follow(
        &mut self,
        span: Span,
        module: usize,
        link_end: LinkEnd,
        field: &str,
    ) -> Option<Option<TargetField>> {
        let is_it = |sink: &Option<LinkSink>| {
            sink.as_ref().is_some_and(|sink| (sink.module, sink.link_end) == (module, link_end))
        };
        let links: Vec<usize> = (0..self.sinks.len()).filter(|link| is_it(&self.sinks[*link])).collect();
        let mut plain = None;
        for link in links {
            // Also to find circles of links to parts.
            match self.resolve_link(link) {
                Some(resolved) if resolved.is_plain() => plain = Some(resolved),
                Some(_) => {}
                None => return Some(None),
            }
        }
        let resolved = plain?;
        if resolved.filter.is_some() {
            self.refuse_filtered(span, module, link_end, &resolved);
            return Some(None);
        }
        // A fact is read from its origin; `previous` is about Knowledge alone. So it is with a percept that a Monitor hands on.
        let is_passed = matches!(link_end, LinkEnd::Port(port) if {
            let port = &self.modules()[module].description.ports[port];
            block::is_fact(port) || block::is_handed_on(port)
        });
        let previous = resolved.previous && !is_passed;
        Some(Some(TargetField { target: resolved.target, field: join(&resolved.from, field), previous }))
    }

    /// Refuses a link to a queue with a filter, as no property has the filtered values.
    fn refuse_filtered(&mut self, span: Span, module: usize, link_end: LinkEnd, resolved: &ResolvedLink<'a>) {
        let queue = self.survey.end_path(module, link_end);
        let source = ends::target_name(self.configuration, self.survey, &self.absent, resolved.target);
        let message = format!("`/{queue}` takes only some values of `/{source}`, by the filter of its link");
        let help = format!("link to `/{source}`, with the same filter if it is wanted");
        self.collector.add(span, ErrorCode::Ends.of(message), help);
    }

    /// Returns whether the links to parameters of a module do not lead back to them.
    /// Their values are the module's own, so no other check applies to these links.
    fn is_acyclic(&mut self, module: usize, field: &str) -> bool {
        let meets = |sink: &Option<LinkSink>| {
            sink.as_ref().is_some_and(|sink| {
                (sink.module, sink.link_end) == (module, LinkEnd::Params)
                    && (is_within(&sink.field, field) || is_within(field, &sink.field))
            })
        };
        let links: Vec<usize> = (0..self.sinks.len()).filter(|link| meets(&self.sinks[*link])).collect();
        links.into_iter().all(|link| self.resolve_link(link).is_some())
    }

    fn resolve_actuator(&self, path: &str) -> Option<TargetField> {
        self.configuration.actuators().iter().enumerate().find_map(|(index, actuator)| {
            let rest = path.strip_prefix(actuator.name.value.as_str())?.strip_prefix('/')?;
            let (name, field) = split_port(&[], rest);
            let target = match name {
                "command" => LinkSource::Command(index),
                "gate" => LinkSource::Gate(index),
                _ => return None,
            };
            Some(TargetField::new(target, field))
        })
    }

    /// Returns the played property at a path; the rest of the path is a field.
    fn resolve_played(&self, path: &str) -> Option<TargetField> {
        let mut played = self.survey.played.iter().enumerate();
        let (index, played) = played.find(|(_, played)| is_within(path, &played.path))?;
        let field = path[played.path.len()..].trim_start_matches('/');
        Some(TargetField::new(LinkSource::Played(index), field))
    }

    fn absent(&mut self, module: &str, path: &str) -> TargetField {
        // The field is known once the module is loaded, and then the port is linked anew.
        let absent = Absent { path: path.into(), module: module.into() };
        let known = self.absent.iter().position(|other| *other == absent);
        let index = known.unwrap_or_else(|| {
            self.absent.push(absent);
            self.absent.len() - 1
        });
        TargetField::new(LinkSource::Absent(index), "")
    }
}

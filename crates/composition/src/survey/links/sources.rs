//! What a link leads to, through the links of what it leads to.

use std::collections::BTreeMap;

use slate_blackboard::{Url, is_within};
use slate_module::{Direction, PortDescription};

use super::sinks::Sink;
use super::{SERVICE, deep_name, fit, is_service, join, owner, remote, split_module, split_port, wire_name};
use crate::survey::{
    Absent, Complaints, Host, Implied, Joint, Misfit, Survey, Surveyed, Target, Wire, suggest,
};
use slate_configuration::Mistake;
use slate_configuration::{Configuration, Link, Span};

pub(super) struct Sources<'s, 'a> {
    configuration: &'a Configuration,
    dormant: &'s [&'a str],
    survey: &'s Survey<'a>,
    sinks: &'s [Option<Sink>],
    complaints: &'s mut Complaints<'a>,
    found: Vec<Found<'a>>,
    /// The links that are being followed, from the outermost.
    open: Vec<usize>,
    pub absent: Vec<Absent>,
    pub misfits: BTreeMap<String, Misfit>,
}

#[derive(Clone)]
enum Found<'a> {
    NotYet,
    /// Nothing after a complaint.
    Joint(Option<Joint<'a>>),
}

/// A property, and a field of it.
pub(super) struct Source {
    pub target: Target,
    pub field: String,
}

impl<'s, 'a> Sources<'s, 'a> {
    pub fn new(
        configuration: &'a Configuration,
        dormant: &'s [&'a str],
        survey: &'s Survey<'a>,
        sinks: &'s [Option<Sink>],
        complaints: &'s mut Complaints<'a>,
    ) -> Self {
        let found = vec![Found::NotYet; sinks.len()];
        Self {
            configuration,
            dormant,
            survey,
            sinks,
            complaints,
            found,
            open: Vec::new(),
            absent: Vec::new(),
            misfits: BTreeMap::new(),
        }
    }

    fn modules(&self) -> &'s [Surveyed<'a>] {
        &self.survey.modules
    }

    /// What becomes of a link; nothing after a complaint.
    pub fn joint(&mut self, link: usize) -> Option<Joint<'a>> {
        if let Found::Joint(joint) = &self.found[link] {
            return joint.clone();
        }
        if let Some(at) = self.open.iter().position(|open| *open == link) {
            self.circle(at);
            return None;
        }
        self.open.push(link);
        let joint = self.new_joint(link);
        self.open.pop();
        // Once more when a circle led here: it was complained about then.
        if let Found::NotYet = self.found[link] {
            self.found[link] = Found::Joint(joint);
        }
        match &self.found[link] {
            Found::Joint(joint) => joint.clone(),
            Found::NotYet => None,
        }
    }

    fn circle(&mut self, at: usize) {
        let links = self.configuration.links();
        let mut names: Vec<_> = self.open[at..].iter().map(|link| links[*link].to.value.as_str()).collect();
        names.extend(names.first().copied());
        let span = links[self.open[at]].from.span;
        let message = Mistake::Circle.of(format!("{} read each other in a circle", names.join(" -> ")));
        self.complaints.add(span, message, "link one of them to an output");
        for link in self.open[at..].iter().copied() {
            self.found[link] = Found::Joint(None);
        }
    }

    fn new_joint(&mut self, link: usize) -> Option<Joint<'a>> {
        let sink = self.sinks[link].as_ref()?;
        let link = &self.configuration.links()[link];
        let (far, span) = sink.far(link);
        if remote::agent(self.configuration, link).is_some() {
            let (joint, misfit) = remote::joint(self.configuration, self.survey, link, sink, self.complaints);
            self.misfits.extend(misfit.map(|misfit| (link.to.value.clone(), misfit)));
            return joint;
        }
        if !self.is_own(link, &far) {
            return None;
        }
        let source = self.source(span, &far.path_in(""))?;
        fit::fit(self.configuration, self.survey, &self.absent, link, sink, source, self.complaints)
    }

    /// Whether nothing is said of a link inside of this agent that is for others.
    fn is_own(&mut self, link: &Link, far: &Url) -> bool {
        let transport = &link.transport;
        let said = [
            transport.carrier.as_ref().map(|said| ("carrier", said.span)),
            transport.mode.as_ref().map(|said| ("mode", said.span)),
            transport.rate.as_ref().map(|said| ("rate", said.span)),
            transport.interval.as_ref().map(|said| ("interval", said.span)),
            transport.compression.as_ref().map(|said| ("compression", said.span)),
        ];
        for (name, span) in said.iter().flatten() {
            let message = Mistake::Ends.of(format!("`{name}` has no meaning here: `{far}` is of this agent"));
            let help = "leave it out, or read a property of another agent: slate://agent/module/property";
            self.complaints.add(*span, message, help);
        }
        said.iter().all(Option::is_none)
    }

    fn source(&mut self, span: Span, path: &str) -> Option<Source> {
        if let Some(source) = self.actuator(path) {
            return Some(source);
        }
        if let Some(source) = self.played(path) {
            return Some(source);
        }
        let Some((module, rest)) = split_module(self.modules(), path) else {
            if let Some(module) = owner(self.dormant, path) {
                return Some(self.absent(module, path));
            }
            if let Some((host, field)) = Host::of(path) {
                return Some(Source { target: Target::Host(host), field: field.into() });
            }
            let actuators =
                self.configuration.actuators().iter().map(|actuator| actuator.name.value.as_str());
            let modules = self.modules().iter().map(|surveyed| surveyed.module.name.value.as_str());
            let is_hosts = path.starts_with("loop/") || path.starts_with("log/");
            let hosts = Host::ALL.iter().filter(|_| is_hosts).map(|host| host.path());
            let played = self.survey.played.iter().map(|played| played.path.as_str());
            let names: Vec<_> = modules.chain(actuators).chain(hosts).chain(played).collect();
            let help = match self.without_slash(span, path) {
                Some(meant) => {
                    format!("did you mean {meant}? Without a slash in front a name is one of its robot")
                }
                None => suggest(path, names.iter().copied()),
            };
            self.complaints.add(span, Mistake::Name.of(format!("nothing is called `/{path}`")), help);
            return None;
        };
        let (name, field) = split_port(&self.modules()[module].description.ports, rest);
        let field = field.to_owned();
        if let Some(implied) = Implied::of(name) {
            if implied == Implied::Enabled
                && let Some(source) = self.follow(module, Wire::Enabled, &field)
            {
                return source;
            }
            if implied == Implied::Params && !self.has_an_end(module, &field) {
                return None;
            }
            return Some(Source { target: Target::Implied(module, implied), field });
        }
        let own = &self.modules()[module].module.name.value;
        let ports = &self.modules()[module].description.ports;
        let Some(at) = ports.iter().position(|port| port.name == name) else {
            let source = |port: &&PortDescription| !is_service(port) && port.direction != Direction::Outbox;
            let name = deep_name(ports, name, rest);
            let help = match self.without_slash(span, path) {
                Some(meant) => {
                    format!("did you mean {meant}? Without a slash in front a name is one of its robot")
                }
                None => suggest(name, ports.iter().filter(source).map(|port| port.name.as_str())),
            };
            self.complaints.add(span, Mistake::Name.of(format!("`{own}` has no output `{name}`")), help);
            return None;
        };
        let (message, help) = match ports[at].direction {
            Direction::Input | Direction::Queue => {
                return match self.follow(module, Wire::Port(at), &field) {
                    Some(source) => source,
                    None => Some(Source { target: Target::Port(module, at), field }),
                };
            }
            Direction::Output | Direction::Debug | Direction::Inbox => {
                return Some(Source { target: Target::Port(module, at), field });
            }
            Direction::Command => (
                Mistake::PastGate.of(format!("`/{path}` is a command that has not passed its gate")),
                "link to the command that passed its gate: `<actuator>/command`",
            ),
            Direction::Aspect | Direction::Provider => {
                (Mistake::Ends.of(format!("`/{path}` is a service")), SERVICE)
            }
            Direction::Outbox => (
                Mistake::Ends.of(format!("`/{path}` sends messages")),
                "write it as the source of an inbox: \"receiver/inbox\" = \"sender/outbox\"",
            ),
        };
        self.complaints.add(span, message, help);
        None
    }

    /// What is meant by a name of a robot's scope that is one of the agent's: the same with a slash in front.
    fn without_slash(&self, span: Span, path: &str) -> Option<String> {
        let written = self.configuration.text_at(span).trim().trim_matches(['"', '\'']);
        if written.starts_with('/') || written == path || !path.ends_with(&format!("/{written}")) {
            return None;
        }
        let is_port = || {
            let (module, rest) = split_module(self.modules(), written)?;
            let ports = &self.modules()[module].description.ports;
            let name = split_port(ports, rest).0;
            (Implied::of(name).is_some() || ports.iter().any(|port| port.name == name)).then_some(())
        };
        (is_port().is_some() || self.actuator(written).is_some()).then(|| format!("/{written}"))
    }

    /// Where the link of another input leads, when that is linked as a whole to a value of its own type; else its own
    /// values are meant.
    fn follow(&mut self, module: usize, wire: Wire, field: &str) -> Option<Option<Source>> {
        let is_it = |sink: &Option<Sink>| {
            sink.as_ref().is_some_and(|sink| (sink.module, sink.wire) == (module, wire))
        };
        let links: Vec<usize> = (0..self.sinks.len()).filter(|link| is_it(&self.sinks[*link])).collect();
        let mut plain = None;
        for link in links {
            // Also to find circles of links to parts.
            match self.joint(link) {
                Some(joint) if joint.is_plain() && !joint.link.previous && joint.filter.is_none() => {
                    plain = Some(joint)
                }
                Some(_) => {}
                None => return Some(None),
            }
        }
        let joint = plain?;
        Some(Some(Source { target: joint.target, field: join(&joint.from, field) }))
    }

    /// Whether the links to parameters of a module lead somewhere, and not back to them. Their values are the module's
    /// own, so nothing else is asked of these links.
    fn has_an_end(&mut self, module: usize, field: &str) -> bool {
        let meets = |sink: &Option<Sink>| {
            sink.as_ref().is_some_and(|sink| {
                (sink.module, sink.wire) == (module, Wire::Params)
                    && (is_within(&sink.field, field) || is_within(field, &sink.field))
            })
        };
        let links: Vec<usize> = (0..self.sinks.len()).filter(|link| meets(&self.sinks[*link])).collect();
        links.into_iter().all(|link| self.joint(link).is_some())
    }

    fn actuator(&self, path: &str) -> Option<Source> {
        self.configuration.actuators().iter().enumerate().find_map(|(index, actuator)| {
            let rest = path.strip_prefix(actuator.name.value.as_str())?.strip_prefix('/')?;
            let (name, field) = split_port(&[], rest);
            (name == "command").then(|| Source { target: Target::Command(index), field: field.into() })
        })
    }

    /// What is played at a path, or at the beginning of one that leads to a field.
    fn played(&self, path: &str) -> Option<Source> {
        let mut played = self.survey.played.iter().enumerate();
        let (index, played) = played.find(|(_, played)| is_within(path, &played.path))?;
        let field = path[played.path.len()..].trim_start_matches('/').into();
        Some(Source { target: Target::Played(index), field })
    }

    fn absent(&mut self, module: &str, path: &str) -> Source {
        // What of it is a field is known when the module is there, and then it is linked anew.
        let absent = Absent { path: path.into(), module: module.into() };
        let known = self.absent.iter().position(|other| *other == absent);
        let index = known.unwrap_or_else(|| {
            self.absent.push(absent);
            self.absent.len() - 1
        });
        Source { target: Target::Absent(index), field: String::new() }
    }
}

/// What a link reads, as messages call it.
pub(super) fn target_name(
    configuration: &Configuration,
    survey: &Survey<'_>,
    absent: &[Absent],
    target: Target,
) -> String {
    match target {
        Target::Absent(index) => absent[index].path.clone(),
        Target::Remote(index) => survey.remote[index].name(),
        other => survey.path(configuration, other),
    }
}

/// What a link fills, as messages call it.
pub(super) fn sink_name(survey: &Survey<'_>, sink: &Sink) -> String {
    let module = &survey.modules[sink.module].module.name.value;
    join(&format!("{module}/{}", wire_name(survey, sink.module, sink.wire)), &sink.field)
}

//! Compatibility of both ends of a link, and conversion of its values.

use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_interfaces::GateState;
use slate_module::role::PERCEPT;
use slate_module::{Direction, Interface};

use super::ends::{TargetField, sink_name, target_name};
use super::messages::{LINK_RULE, different, roles};
use super::sinks::LinkSink;
use crate::diagnostic_collector::DiagnosticCollector;
use crate::link::{FieldPlace, Filter, NoField, Program};
use crate::own::{ModuleState, ModuleTiming, TimingHistogram};
use crate::parameters::enabled_descriptor;
use crate::survey::block::{Block, Provenance, binds};
use crate::survey::names::{join, split_module};
use crate::survey::origins::passed_by;
use crate::survey::{Absent, Implied, LinkConversion, LinkEnd, LinkSource, ResolvedLink, Survey, Surveyed};
use slate_configuration::{Configuration, ErrorCode, Link, Message, Span};

/// Returns the interface of a link's source, if it is known before creation.
fn interface_of(
    configuration: &Configuration,
    survey: &Survey<'_>,
    target: LinkSource,
) -> Option<&'static Descriptor> {
    match target {
        LinkSource::Port(module, port) => Some(survey.modules[module].description.ports[port].descriptor),
        LinkSource::Implied(module, implied) => Some(match implied {
            Implied::Params => survey.modules[module].description.params,
            Implied::Enabled => enabled_descriptor(),
            Implied::State => ModuleState::DESCRIPTOR,
            Implied::Timing => ModuleTiming::DESCRIPTOR,
            Implied::Histogram => TimingHistogram::DESCRIPTOR,
        }),
        LinkSource::Command(actuator) => {
            configuration.actuators()[actuator].commands.iter().find_map(|url| {
                let path = url.value.path_in("");
                let (module, name) = split_module(&survey.modules, &path)?;
                let ports = &survey.modules[module].description.ports;
                Some(ports.iter().find(|port| port.name == name)?.descriptor)
            })
        }
        LinkSource::Gate(_) => Some(GateState::DESCRIPTOR),
        LinkSource::Absent(_) => None,
        LinkSource::Remote(remote) => survey.remote[remote].property.as_ref().map(|found| found.descriptor),
        LinkSource::Host(host) => Some(host.descriptor()),
        LinkSource::Played(played) => Some(survey.played[played].descriptor),
    }
}

/// Error of a link: place, message and help.
type FitError = (Span, Message, String);

/// Joins the source of a link with its port; `None` after an error.
pub(super) fn fit<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    absent: &[Absent],
    link: &'a Link,
    sink: &LinkSink,
    source: TargetField,
    collector: &mut DiagnosticCollector<'a>,
) -> Option<ResolvedLink<'a>> {
    let name = join(&target_name(configuration, survey, absent, source.target), &source.field);
    match BothEnds::new(configuration, survey, link, sink, source, name).resolved() {
        Ok(resolved) => Some(resolved),
        Err((span, message, help)) => {
            collector.add(span, message, help);
            None
        }
    }
}

/// Link with the properties of its ends.
struct BothEnds<'a, 's> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    link: &'a Link,
    /// Port of this agent; its name, interface and direction follow.
    sink: &'s LinkSink,
    to: String,
    own: &'static Descriptor,
    direction: Direction,
    /// Source of the link; its field, name, place in the text and interface follow.
    /// The interface is `None` until it is known.
    target: LinkSource,
    from: String,
    /// Selection of last cycle's value.
    previous: bool,
    name: String,
    span: Span,
    interface: Option<&'static Descriptor>,
}

impl<'a, 's> BothEnds<'a, 's> {
    fn new(
        configuration: &'a Configuration,
        survey: &'s Survey<'a>,
        link: &'a Link,
        sink: &'s LinkSink,
        source: TargetField,
        name: String,
    ) -> Self {
        let TargetField { target, field: from, previous } = source;
        let previous = previous || link.previous;
        let description = &survey.modules[sink.module].description;
        let (own, direction) = match sink.link_end {
            LinkEnd::Port(port) => (description.ports[port].descriptor, description.ports[port].direction),
            LinkEnd::Enabled => (enabled_descriptor(), Direction::Input),
            LinkEnd::Params => (description.params, Direction::Input),
        };
        let (to, span) = (sink_name(survey, sink), sink.far(link).1);
        let interface = interface_of(configuration, survey, target);
        Self {
            configuration,
            survey,
            link,
            sink,
            to,
            own,
            direction,
            target,
            from,
            previous,
            name,
            span,
            interface,
        }
    }

    fn resolved(self) -> Result<ResolvedLink<'a>, FitError> {
        self.check_directions()?;
        self.check_roles()?;
        let filter = self.filter()?;
        self.check_queue_options()?;
        let is_plain = self.is_plain(filter.is_some());
        self.check_whole(is_plain)?;
        let conversion = if is_plain { LinkConversion::Plain } else { self.conversion()? };
        Ok(ResolvedLink {
            link: self.link,
            port: (self.sink.module, self.sink.link_end),
            target: self.target,
            previous: self.previous,
            // Known once all links are resolved.
            delayed: false,
            from: self.from,
            field: self.sink.field.clone(),
            conversion,
            filter: filter.map(Arc::new),
        })
    }

    fn surveyed(&self) -> &'s Surveyed<'a> {
        &self.survey.modules[self.sink.module]
    }

    /// Refuses a link whose ends do not match.
    fn refuse<T>(&self, message: String, help: &str) -> Result<T, FitError> {
        Err((self.span, ErrorCode::Ends.of(message), help.into()))
    }

    /// Returns whether the other end takes messages.
    fn is_inbox(&self) -> bool {
        match self.target {
            LinkSource::Port(module, port) => {
                self.survey.modules[module].description.ports[port].direction == Direction::Inbox
            }
            // Its kind is not known yet.
            LinkSource::Absent(_) | LinkSource::Remote(_) => self.direction == Direction::Outbox,
            LinkSource::Played(played) => self.survey.played[played].is_mailbox,
            LinkSource::Command(_) | LinkSource::Gate(_) | LinkSource::Implied(..) | LinkSource::Host(_) => {
                false
            }
        }
    }

    /// Checks the directions: messages go to inboxes, and inputs read values.
    fn check_directions(&self) -> Result<(), FitError> {
        let Self { to, name, .. } = self;
        let sends = self.direction == Direction::Outbox;
        match (sends, self.is_inbox()) {
            (false, true) => {
                let message = format!("`/{name}` receives messages, but `{to}` reads a value");
                return self.refuse(message, "link an input to an output");
            }
            (true, false) => {
                let message = format!("`{to}` sends messages, but `/{name}` is a value");
                return self.refuse(message, "link an outbox to an inbox");
            }
            _ => {}
        }
        if sends && let Some((name, option)) = value_option(self.link) {
            let message = format!("`{name}` has no meaning for messages, which `{to}` sends");
            let help = "leave it out: it is about values that are read";
            return Err((option, ErrorCode::Ends.of(message), help.into()));
        }
        if matches!(self.target, LinkSource::Command(_)) && self.direction == Direction::Queue {
            let message = ErrorCode::PastGate.of(format!("`{to}` can't take an actuator's command"));
            return Err((self.span, message, "link a plain input to it".into()));
        }
        if matches!(self.target, LinkSource::Gate(_)) && self.direction == Direction::Queue {
            let message = format!("`{to}` is a queue, and `/{name}` keeps its newest value alone");
            return self.refuse(message, "link a plain input to it");
        }
        Ok(())
    }

    /// Checks that the roles of the ports allow the link.
    fn check_roles(&self) -> Result<(), FitError> {
        let (LinkEnd::Port(port), LinkSource::Port(module, other)) = (self.sink.link_end, self.target) else {
            return Ok(());
        };
        let own = &self.surveyed().description.ports[port].role;
        let source = Block::of(&self.survey.modules[module].description);
        let other = &self.survey.modules[module].description.ports[other].role;
        if own == PERCEPT
            && matches!(passed_by(self.configuration, self.survey, self.link), Some((_, Block::Monitor)))
        {
            return Ok(());
        }
        // A plain port of a block reads what the rules for blocks allow.
        let is_free = !binds(own) && (!binds(other) || Block::of(&self.surveyed().description).is_some());
        // A part of what a plain module reads is no traffic between blocks.
        let is_whole = self.sink.field.is_empty() && self.from.is_empty();
        let is_part = !binds(own) && !is_whole;
        if is_free || is_part || own == other {
            return Ok(());
        }
        let from = format!("`/{}`", self.name);
        if own == PERCEPT && source == Some(Block::Analyze) {
            let message = format!(
                "an Analyze reads another one only as a fact of Knowledge: `{}` can't read {from}, of an Analyze",
                self.to
            );
            let help = Block::Analyze.help(Provenance::Block(Block::Analyze));
            return Err((self.span, ErrorCode::Attachment.of(message), help.into()));
        }
        let help = "only Monitor -> Analyze -> Plan -> Execute can be attached, and reflexes to Execute";
        let message = roles(&self.to, own, &from, (other, source));
        Err((self.span, ErrorCode::Attachment.of(message), help.into()))
    }

    /// Returns the filter of the link, if it has one.
    fn filter(&self) -> Result<Option<Filter>, FitError> {
        filter(self.link, self.interface.unwrap_or(self.own)).map_err(|NoField { message, help }| {
            let span = self.link.filter.when.as_ref().map_or(self.span, |when| when.span);
            (span, ErrorCode::Value.of(format!("the condition of `{}`: {message}", self.to)), help)
        })
    }

    fn check_queue_options(&self) -> Result<(), FitError> {
        let policy = self.link.policy.as_ref().map(|policy| policy.span);
        match policy.or(self.link.window.as_ref().map(|window| window.span)) {
            Some(option) if self.direction != Direction::Queue => {
                let message = ErrorCode::Ends.of(format!("`{}` is not a queue input", self.to));
                Err((option, message, "leave `policy` and `window` out".into()))
            }
            _ => Ok(()),
        }
    }

    /// Returns whether both ends are named as wholes.
    fn is_whole(&self) -> bool {
        self.sink.field.is_empty() && self.from.is_empty() && self.sink.link_end != LinkEnd::Params
    }

    /// Returns whether the port reads the property itself, without conversion.
    fn is_plain(&self, has_filter: bool) -> bool {
        let known = self.interface.is_none_or(|interface| interface.hash == self.own.hash);
        // The process of an isolated module does not see what stands for a property of another agent, or of the agent.
        let is_apart = self.surveyed().is_isolated
            && matches!(
                self.target,
                LinkSource::Remote(_) | LinkSource::Host(_) | LinkSource::Played(_) | LinkSource::Gate(_)
            );
        self.is_whole()
            && known
            && (!has_filter || self.direction == Direction::Queue)
            && !(is_apart && self.direction != Direction::Outbox && self.sink.link_end != LinkEnd::Enabled)
    }

    /// Checks links that must carry whole values.
    /// Queues and messages carry whole values, and a parameter has no last cycle.
    fn check_whole(&self, is_plain: bool) -> Result<(), FitError> {
        let Self { to, name, own, .. } = self;
        if !is_plain && matches!(self.direction, Direction::Queue | Direction::Outbox) {
            let (message, help) = match self.interface {
                Some(interface) if self.is_whole() => (
                    different(to, name, own, interface),
                    "queues and messages carry the interface of their port; a plain input converts what can be",
                ),
                _ => (
                    format!("`{to}` takes whole values of {}, and `/{name}` is a part of one", own.name),
                    "link it to a whole property, or read the part with a plain input",
                ),
            };
            return self.refuse(message, help);
        }
        if self.sink.link_end == LinkEnd::Params && self.link.previous {
            let message = format!("`{to}` is a parameter, which has no last cycle");
            return self.refuse(message, "leave `previous` out");
        }
        if self.sink.link_end == LinkEnd::Params && self.previous {
            let message = format!(
                "`{to}` is a parameter, which has no last cycle, and the input that it is linked to has `previous`"
            );
            return self.refuse(message, &format!("link it to `/{name}`, whose newest value it takes"));
        }
        Ok(())
    }

    /// Returns the conversion from the value to the type of the port.
    fn conversion(&self) -> Result<LinkConversion, FitError> {
        let sink_place = self.sink_place()?;
        let Some(interface) = self.interface else {
            return match self.target {
                LinkSource::Absent(_) | LinkSource::Remote(_) => {
                    Ok(LinkConversion::Pending(Arc::new(sink_place)))
                }
                _ => self.refuse(
                    format!("the type of `/{}` is not known", self.name),
                    "link to the whole command",
                ),
            };
        };
        let is_switch = self.sink.link_end == LinkEnd::Enabled;
        // A switch is named as a whole.
        let from = match self.from.as_str() {
            "" if is_switch && interface.hash == self.own.hash => "value",
            from => from,
        };
        let source_place = FieldPlace::find(interface, from).map_err(|NoField { message, help }| {
            (self.span, ErrorCode::Name.of(format!("`/{}`: {message}", self.name)), help)
        })?;
        match Program::new(&source_place, &sink_place) {
            Ok(program) => {
                Ok(LinkConversion::Converted(Arc::new(program.within(range(self.survey, self.sink)))))
            }
            Err(reason) => {
                let Self { to, name, own, .. } = self;
                let message = if self.is_whole() && interface.name == own.name {
                    different(to, name, own, interface)
                } else if self.is_whole() && !is_switch {
                    format!("{}: {reason}", different(to, name, own, interface))
                } else {
                    let (takes, is) = (sink_place.describe(), source_place.describe());
                    format!("`{to}` takes {takes} but `/{name}` is {is}: {reason}")
                };
                self.refuse(message, LINK_RULE)
            }
        }
    }

    /// Returns the part of the port that the link fills.
    fn sink_place(&self) -> Result<FieldPlace, FitError> {
        let field = if self.sink.link_end == LinkEnd::Enabled { "value" } else { &self.sink.field };
        match FieldPlace::find(self.own, field) {
            Ok(field) if !field.may_be_missing() => Ok(field),
            Ok(_) => self.refuse(
                format!("`{}` is an item of a list, which may be shorter", self.to),
                "link the whole list",
            ),
            Err(NoField { message, help }) => {
                Err((self.link.to.span, ErrorCode::Name.of(format!("`{}`: {message}", self.to)), help))
            }
        }
    }
}

/// Returns the first option of a link that applies only to values.
/// (Messages have `previous`, too: it sends them for the next cycle.)
fn value_option(link: &Link) -> Option<(&'static str, Span)> {
    let Link { filter, transport, .. } = link;
    let options = [
        ("stale", link.stale.as_ref().map(|option| option.span)),
        ("every", filter.every.as_ref().map(|option| option.span)),
        ("when", filter.when.as_ref().map(|option| option.span)),
        ("mode", transport.mode.as_ref().map(|option| option.span)),
        ("rate", transport.rate.as_ref().map(|option| option.span)),
        ("interval", transport.interval.as_ref().map(|option| option.span)),
        ("compression", transport.compression.as_ref().map(|option| option.span)),
    ];
    options.into_iter().find_map(|(name, option)| Some((name, option?)))
}

/// Returns the filter of a link, if it has one.
fn filter(link: &Link, descriptor: &'static Descriptor) -> Result<Option<Filter>, NoField> {
    let every = link.filter.every.as_ref().map(|every| every.value).filter(|every| *every > 1);
    let when = link.filter.when.as_ref().map(|when| when.value.as_str());
    if every.is_none() && when.is_none() {
        return Ok(None);
    }
    Filter::new(descriptor, every, when).map(Some)
}

/// Returns the range of a parameter.
fn range(survey: &Survey<'_>, sink: &LinkSink) -> Option<(f64, f64)> {
    let parameters = &survey.modules[sink.module].description.parameters;
    let parameter = parameters.iter().find(|parameter| parameter.name == sink.field)?;
    if sink.link_end == LinkEnd::Params { parameter.range } else { None }
}

//! Whether both ends of a link fit, and how values become what the port takes.

use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::{Direction, Interface};

use super::sinks::Sink;
use super::sources::{Source, sink_name, target_name};
use super::{join, split_module};
use crate::link::{Filter, NoPlace, Place, Program};
use crate::own::TimingHistogram;
use crate::own::{ModuleState, ModuleTiming};
use crate::parameters::enabled_descriptor;
use crate::survey::{Absent, Complaints, Implied, Joint, Survey, Target, Way, Wire};
use slate_configuration::Mistake;
use slate_configuration::{Configuration, Link, Span};

/// The interface of what a link leads to, as far as it is known before anything is made.
fn interface_of(
    configuration: &Configuration,
    survey: &Survey<'_>,
    target: Target,
) -> Option<&'static Descriptor> {
    match target {
        Target::Port(module, port) => Some(survey.modules[module].description.ports[port].descriptor),
        Target::Implied(module, implied) => Some(match implied {
            Implied::Params => survey.modules[module].description.params,
            Implied::Enabled => enabled_descriptor(),
            Implied::State => ModuleState::DESCRIPTOR,
            Implied::Timing => ModuleTiming::DESCRIPTOR,
            Implied::Histogram => TimingHistogram::DESCRIPTOR,
        }),
        Target::Command(actuator) => configuration.actuators()[actuator].commands.iter().find_map(|url| {
            let path = url.value.path_in("");
            let (module, name) = split_module(&survey.modules, &path)?;
            let ports = &survey.modules[module].description.ports;
            Some(ports.iter().find(|port| port.name == name)?.descriptor)
        }),
        Target::Absent(_) => None,
        Target::Remote(remote) => survey.remote[remote].property.as_ref().map(|found| found.descriptor),
        Target::Host(host) => Some(host.descriptor()),
        Target::Played(played) => Some(survey.played[played].descriptor),
    }
}

pub(super) fn fit<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    absent: &[Absent],
    link: &'a Link,
    sink: &Sink,
    source: Source,
    complaints: &mut Complaints<'a>,
) -> Option<Joint<'a>> {
    let Source { target, field: from } = source;
    let (to, span) = (sink_name(survey, sink), sink.far(link).1);
    let name = join(&target_name(configuration, survey, absent, target), &from);
    let mut refuse = |message: String, help: &str| {
        complaints.add(span, Mistake::Ends.of(message), help);
        None
    };
    let surveyed = &survey.modules[sink.module];
    let own = match sink.wire {
        Wire::Port(port) => surveyed.description.ports[port].descriptor,
        Wire::Enabled => enabled_descriptor(),
        Wire::Params => surveyed.description.params,
    };
    let direction = match sink.wire {
        Wire::Port(port) => surveyed.description.ports[port].direction,
        Wire::Enabled | Wire::Params => Direction::Input,
    };
    let interface = interface_of(configuration, survey, target);
    // Messages are sent to inboxes, and values are read.
    let is_inbox = match target {
        Target::Port(module, port) => {
            survey.modules[module].description.ports[port].direction == Direction::Inbox
        }
        // What it is there is known when it is.
        Target::Absent(_) | Target::Remote(_) => direction == Direction::Outbox,
        Target::Played(played) => survey.played[played].is_mailbox,
        Target::Command(_) | Target::Implied(..) | Target::Host(_) => false,
    };
    if (direction == Direction::Outbox) != is_inbox {
        return if is_inbox {
            refuse(
                format!("`/{name}` receives messages, but `{to}` reads a value"),
                "link an input to an output",
            )
        } else {
            refuse(format!("`{to}` sends messages, but `/{name}` is a value"), "link an outbox to an inbox")
        };
    }
    if direction == Direction::Outbox
        && let Some((name, said)) = of_values(link)
    {
        let help = "leave it out: it is about values that are read";
        complaints.add(
            said,
            Mistake::Ends.of(format!("`{name}` has no meaning for messages, which `{to}` sends")),
            help,
        );
        return None;
    }
    if matches!(target, Target::Command(_)) && direction == Direction::Queue {
        let message = Mistake::PastGate.of(format!("`{to}` can't take an actuator's command"));
        complaints.add(span, message, "link a plain input to it");
        return None;
    }
    if let (Wire::Port(port), Target::Port(module, other)) = (sink.wire, target)
        && sink.field.is_empty()
        && from.is_empty()
    {
        let (own, other) =
            (&surveyed.description.ports[port].role, &survey.modules[module].description.ports[other].role);
        if own != other {
            let help = "only Monitor -> Analyze -> Plan -> Execute can be attached, and reflexes to Execute";
            return refuse(roles(&to, own, &name, other), help);
        }
    }
    let filter = match filter(link, interface.unwrap_or(own)) {
        Ok(filter) => filter,
        Err(error) => {
            let span = link.filter.when.as_ref().map_or(span, |when| when.span);
            complaints.add(
                span,
                Mistake::Value.of(format!("the condition of `{to}`: {}", error.message)),
                error.help,
            );
            return None;
        }
    };
    if let Some(said) =
        link.policy.as_ref().map(|policy| policy.span).or(link.window.as_ref().map(|window| window.span))
        && direction != Direction::Queue
    {
        complaints.add(
            said,
            Mistake::Ends.of(format!("`{to}` is no queue input")),
            "leave `policy` and `window` out",
        );
        return None;
    }
    let is_whole = sink.field.is_empty() && from.is_empty() && sink.wire != Wire::Params;
    let known = interface.is_none_or(|interface| interface.hash == own.hash);
    // The process of an isolated module does not see what stands for a property of another agent, or of the agent.
    let is_apart = surveyed.module.isolated.value
        && matches!(target, Target::Remote(_) | Target::Host(_) | Target::Played(_));
    let is_plain = is_whole
        && known
        && (filter.is_none() || direction == Direction::Queue)
        && !(is_apart && direction != Direction::Outbox && sink.wire != Wire::Enabled);
    if !is_plain && matches!(direction, Direction::Queue | Direction::Outbox) {
        let (message, help) = match interface {
            Some(interface) if is_whole => (
                different(&to, &name, own, interface),
                "queues and messages carry the interface of their port; a plain input converts what can be",
            ),
            _ => (
                format!("`{to}` takes whole values of {}, and `/{name}` is a part of one", own.name),
                "link it to a whole property, or read the part with a plain input",
            ),
        };
        return refuse(message, help);
    }
    if sink.wire == Wire::Params && link.previous {
        return refuse(format!("`{to}` is a parameter, which has no last cycle"), "leave `previous` out");
    }
    let way = if is_plain {
        Way::Plain
    } else {
        let place = |descriptor, field: &str| Place::find(descriptor, field);
        let sink_place = match place(own, if sink.wire == Wire::Enabled { "value" } else { &sink.field }) {
            Ok(place) if !place.may_be_missing() => place,
            Ok(_) => {
                return refuse(
                    format!("`{to}` is an item of a list, which may be shorter"),
                    "link the whole list",
                );
            }
            Err(NoPlace { message, help }) => {
                complaints.add(link.to.span, Mistake::Name.of(format!("`{to}`: {message}")), help);
                return None;
            }
        };
        match interface {
            None if matches!(target, Target::Absent(_) | Target::Remote(_)) => {
                Way::Pending(Arc::new(sink_place))
            }
            None => {
                return refuse(format!("the type of `/{name}` is not known"), "link to the whole command");
            }
            Some(interface) => {
                // A switch is named as a whole.
                let from = if sink.wire == Wire::Enabled && from.is_empty() && interface.hash == own.hash {
                    "value"
                } else {
                    &from
                };
                let source_place = match place(interface, from) {
                    Ok(place) => place,
                    Err(NoPlace { message, help }) => {
                        complaints.add(span, Mistake::Name.of(format!("`/{name}`: {message}")), help);
                        return None;
                    }
                };
                match Program::new(&source_place, &sink_place) {
                    Ok(program) => Way::Converted(Arc::new(program.within(range(survey, sink)))),
                    Err(reason) => {
                        let message = if is_whole && interface.name == own.name {
                            different(&to, &name, own, interface)
                        } else if is_whole && sink.wire != Wire::Enabled {
                            format!("{}: {reason}", different(&to, &name, own, interface))
                        } else {
                            format!(
                                "`{to}` takes {} but `/{name}` is {}: {reason}",
                                sink_place.describe(),
                                source_place.describe()
                            )
                        };
                        return refuse(message, HELP);
                    }
                }
            }
        }
    };
    let delayed = match target {
        // What is played is written in the place of its module, which may be before this one's.
        Target::Played(played) => {
            link.previous && survey.played[played].early_for.contains(&surveyed.module.name.value)
        }
        _ => link.previous && is_earlier(configuration, survey, target, surveyed.stage),
    };
    Some(Joint {
        link,
        port: (sink.module, sink.wire),
        target,
        from,
        field: sink.field.clone(),
        way,
        filter: filter.map(Arc::new),
        delayed,
    })
}

/// Why two ports can't be attached, in terms of blocks.
fn roles(to: &str, own: &str, from: &str, other: &str) -> String {
    let what = match other {
        "percept" => "what a Monitor tells".to_owned(),
        "change" => "what an Analyze tells".to_owned(),
        "plan" => "an Execute's inbox of plans".to_owned(),
        "reflex" => "an Execute's inbox of reflexes".to_owned(),
        "" => "a plain value, such as a sensor's".to_owned(),
        other => format!("a {other}"),
    };
    match own {
        "percept" => format!("an Analyze reads Monitors: `{to}` can't read `/{from}`, which is {what}"),
        "change" => format!("the Plan reads Analyzes: `{to}` can't read `/{from}`, which is {what}"),
        "plan" => {
            format!("the Plan sends to an Execute's plan: `{to}` can't send to `/{from}`, which is {what}")
        }
        "reflex" => {
            format!(
                "a ReactiveModel sends to an Execute's reflexes: `{to}` can't send to `/{from}`, which is {what}"
            )
        }
        "" if other == "percept" => format!("only an Analyze reads Monitors, and `{to}` is of none"),
        "" if other == "change" => format!("only the Plan reads Analyzes, and `{to}` is of none"),
        own => format!(
            "`{to}` is {} but `/{from}` is {what}",
            if own.is_empty() { "plain".into() } else { format!("a {own}") }
        ),
    }
}

/// What is said of a link that only values have. (Messages have `previous` too: it sends them for the next cycle.)
fn of_values(link: &Link) -> Option<(&'static str, Span)> {
    let Link { filter, transport, .. } = link;
    let said = [
        ("stale", link.stale.as_ref().map(|said| said.span)),
        ("every", filter.every.as_ref().map(|said| said.span)),
        ("when", filter.when.as_ref().map(|said| said.span)),
        ("mode", transport.mode.as_ref().map(|said| said.span)),
        ("rate", transport.rate.as_ref().map(|said| said.span)),
        ("interval", transport.interval.as_ref().map(|said| said.span)),
        ("compression", transport.compression.as_ref().map(|said| said.span)),
    ];
    said.into_iter().find_map(|(name, said)| Some((name, said?)))
}

const HELP: &str = "both ends of a link carry the same interface, or one that converts exactly: to wider numbers, whole \
                    numbers to a smaller unit, and interfaces with such fields of the same names";

fn different(to: &str, from: &str, own: &Descriptor, other: &Descriptor) -> String {
    if own.name == other.name {
        format!(
            "`{to}` and `/{from}` are different versions of {}: {:016x} and {:016x}",
            own.name, own.hash, other.hash
        )
    } else {
        format!("`{to}` is {} but `/{from}` is {}", own.name, other.name)
    }
}

/// What a link lets through, if that is not everything.
fn filter(link: &Link, descriptor: &'static Descriptor) -> Result<Option<Filter>, NoPlace> {
    let every = link.filter.every.as_ref().map(|every| every.value).filter(|every| *every > 1);
    let when = link.filter.when.as_ref().map(|when| when.value.as_str());
    if every.is_none() && when.is_none() {
        return Ok(None);
    }
    Filter::new(descriptor, every, when).map(Some)
}

/// The interval that a parameter must be in.
fn range(survey: &Survey<'_>, sink: &Sink) -> Option<(f64, f64)> {
    let parameters = &survey.modules[sink.module].description.parameters;
    let parameter = parameters.iter().find(|parameter| parameter.name == sink.field)?;
    if sink.wire == Wire::Params { parameter.range } else { None }
}

/// Whether what a link leads to is written earlier in a cycle than modules of that stage run.
fn is_earlier(
    configuration: &Configuration,
    survey: &Survey<'_>,
    target: Target,
    stage: slate_module::Stage,
) -> bool {
    let place = |stage: slate_module::Stage| {
        configuration.schedule().stages().iter().position(|own| own.members.contains(&stage)).map(|at| {
            let members = &configuration.schedule().stages()[at].members;
            (at, members.iter().position(|member| *member == stage))
        })
    };
    let writers = crate::survey::order::writers(configuration, &survey.modules, target);
    writers.into_iter().any(|writer| place(survey.modules[writer].stage) < place(stage))
}

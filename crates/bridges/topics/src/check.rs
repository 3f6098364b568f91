//! Ports that topics and services name, checked.

use slate_blackboard::interface::Descriptor;
use slate_ros_messages::{DefinitionFiles, FileError, WireFormat};
use slate_runtime::{ExternalPorts, PropertyFacts};

use crate::error::RosError;
use crate::frames::frame_input;
use crate::message::RosMessage;
use crate::mismatch::{TopicMismatch, input, output};
use crate::options::NodeOptions;
use crate::service_settings::{ServiceCall, ServiceOffer};
use crate::services::check_services;
use crate::topic_settings::{TopicInput, TopicOutput, TopicSettings};

/// Checks that the ports of topics, services and frames exist and fit.
/// It opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_ports<O>(
    format: WireFormat,
    ports: &impl ExternalPorts,
    topics: &TopicSettings<O>,
    (offers, calls): (&[ServiceOffer], &[ServiceCall]),
    node: &NodeOptions,
) -> Result<(), RosError> {
    topics.read.iter().try_for_each(|own| topic_input(format, ports, own).map(drop))?;
    topics.write.iter().try_for_each(|own| topic_output(format, ports, own).map(drop))?;
    check_services(ports, offers, calls)?;
    node.frames.iter().try_for_each(|own| frame_input(ports, own).map(drop))?;
    check_clock(ports, node)
}

/// Checks that the agent has a time of its own, if that is published.
///
/// # Errors
/// The agent goes by the system's clock.
pub fn check_clock(ports: &impl ExternalPorts, node: &NodeOptions) -> Result<(), RosError> {
    if node.clock && !ports.is_lockstep() { Err(RosError::Clock) } else { Ok(()) }
}

/// Returns the input that reads a topic, and its messages.
///
/// # Errors
/// The input is missing or linked, or messages lack one of its fields.
pub fn topic_input<O, P: ExternalPorts>(
    format: WireFormat,
    ports: &P,
    own: &TopicInput<O>,
) -> Result<(P::Property, RosMessage), Box<TopicMismatch>> {
    let property = input(ports, &own.input, &own.topic).map_err(|mismatch| mismatch.at(own.place))?;
    if let Some(wait) = own.wait.as_ref().filter(|_| !ports.is_lockstep()) {
        let reason = "cycles would wait for it, and the agent goes by the system's clock";
        return Err(TopicMismatch::new(&own.input, &own.topic, reason, NO_WAIT_HELP).at(wait.place));
    }
    let message = message(format, property.descriptor(), own.definition.as_deref());
    let message = message.map_err(|error| {
        TopicMismatch::new(&own.input, &own.topic, error.to_string(), DEFINITION_HELP).at(own.place)
    })?;
    match message.check_decodable() {
        Ok(()) => Ok((property, message)),
        Err(reason) => {
            let help = "read it with a module that has an input of another interface";
            Err(TopicMismatch::new(&own.input, &own.topic, reason, help).at(own.place))
        }
    }
}

/// Returns the property whose values a topic has, and its messages.
///
/// # Errors
/// The property is missing, or has no value.
pub fn topic_output<O, P: ExternalPorts>(
    format: WireFormat,
    ports: &P,
    own: &TopicOutput<O>,
) -> Result<(P::Property, RosMessage), Box<TopicMismatch>> {
    let property = output(ports, &own.property, &own.topic).map_err(|mismatch| mismatch.at(own.place))?;
    let message = message(format, property.descriptor(), own.definition.as_deref());
    let message = message.map_err(|error| {
        TopicMismatch::new(&own.property, &own.topic, error.to_string(), DEFINITION_HELP).at(own.place)
    })?;
    Ok((property, message))
}

/// Advice for a wait on the system's clock.
const NO_WAIT_HELP: &str =
    "take wait_per away, or give the agent a time source, such as [time] source = \"simulator\"";

/// Advice for a definition that does not fit.
const DEFINITION_HELP: &str = "give the fields of the message the names and types of those of the interface";

fn message(
    format: WireFormat,
    descriptor: &'static Descriptor,
    definition: Option<&DefinitionFiles>,
) -> Result<RosMessage, FileError> {
    match definition {
        Some(files) => RosMessage::defined(format, descriptor, files),
        None => Ok(RosMessage::new(format, descriptor)),
    }
}

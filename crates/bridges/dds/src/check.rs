use slate_runtime::{ExternalPorts, PropertyFacts};
use slate_topics::{TopicInput, TopicMismatch, TopicOutput, input, output};

use crate::error::DdsError;
use crate::message::DdsMessage;
use crate::settings::DdsSettings;
use crate::topic_type::DdsTopic;

const FIELDS: &str = "give members the names and types of the interface's fields, or name another port";

/// Checks that the ports that settings name exist and fit their topics.
/// It opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(ports: &impl ExternalPorts, settings: &DdsSettings) -> Result<(), DdsError> {
    let topics = &settings.topics;
    topics.read.iter().try_for_each(|own| topic_input(ports, own).map(drop))?;
    topics.write.iter().try_for_each(|own| topic_output(ports, own).map(drop))?;
    Ok(())
}

/// Returns the input that reads a topic, and its messages.
pub fn topic_input<P: ExternalPorts>(
    ports: &P,
    own: &TopicInput<DdsTopic>,
) -> Result<(P::Property, DdsMessage), Box<TopicMismatch>> {
    let property = input(ports, &own.input, &own.topic).map_err(|mismatch| mismatch.at(own.place))?;
    let message = DdsMessage::of(property.descriptor(), own.quality.of.as_ref());
    let message = message.and_then(|message| message.check_decodable().map(|()| message));
    let wrong = |reason| TopicMismatch::new(&own.input, &own.topic, reason, FIELDS).at(own.place);
    Ok((property, message.map_err(wrong)?))
}

/// Returns the property whose values a topic has, and its messages.
pub fn topic_output<P: ExternalPorts>(
    ports: &P,
    own: &TopicOutput<DdsTopic>,
) -> Result<(P::Property, DdsMessage), Box<TopicMismatch>> {
    let property = output(ports, &own.property, &own.topic).map_err(|mismatch| mismatch.at(own.place))?;
    let message = DdsMessage::of(property.descriptor(), own.quality.of.as_ref());
    let message = message.and_then(|message| message.check_encodable().map(|()| message));
    let wrong = |reason| TopicMismatch::new(&own.property, &own.topic, reason, FIELDS).at(own.place);
    Ok((property, message.map_err(wrong)?))
}

use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;
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
pub fn check_topics(composer: &Composer, settings: &DdsSettings) -> Result<(), DdsError> {
    let topics = &settings.topics;
    topics.read.iter().try_for_each(|own| topic_input(composer, own).map(drop))?;
    topics.write.iter().try_for_each(|own| topic_output(composer, own).map(drop))?;
    Ok(())
}

/// Returns the input that reads a topic, and its messages.
pub fn topic_input(
    composer: &Composer,
    own: &TopicInput<DdsTopic>,
) -> Result<(Arc<Property>, DdsMessage), Box<TopicMismatch>> {
    let property = input(composer, &own.input, &own.topic).map_err(|misfit| misfit.at(own.place))?;
    let message = DdsMessage::of(property.descriptor(), own.quality.of.as_ref());
    let message = message.and_then(|message| message.check_decodable().map(|()| message));
    let wrong = |reason| TopicMismatch::new(&own.input, &own.topic, reason, FIELDS).at(own.place);
    Ok((property, message.map_err(wrong)?))
}

/// Returns the property whose values a topic has, and its messages.
pub fn topic_output(
    composer: &Composer,
    own: &TopicOutput<DdsTopic>,
) -> Result<(Arc<Property>, DdsMessage), Box<TopicMismatch>> {
    let property = output(composer, &own.property, &own.topic).map_err(|misfit| misfit.at(own.place))?;
    let message = DdsMessage::of(property.descriptor(), own.quality.of.as_ref());
    let message = message.and_then(|message| message.check_encodable().map(|()| message));
    let wrong = |reason| TopicMismatch::new(&own.property, &own.topic, reason, FIELDS).at(own.place);
    Ok((property, message.map_err(wrong)?))
}

use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;

use crate::error::{RosError, TopicMisfit};
use crate::message::RosMessage;
use crate::settings::{RosSettings, TopicInput, TopicOutput};

/// Whether the properties that settings name are there and fit their topics; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    settings.read.iter().try_for_each(|own| input(composer, own).map(drop))?;
    settings.write.iter().try_for_each(|own| output(composer, own).map(drop))
}

/// The input that reads a topic, and what it reads.
pub fn input(composer: &Composer, own: &TopicInput) -> Result<(Arc<Property>, RosMessage), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (own.input.clone(), own.topic.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: own.place }))
    };
    let found = composer.external_input(&own.input);
    let (property, field) = found.map_err(|error| wrong(error.reason, error.help))?;
    if !field.is_empty() {
        return Err(wrong(
            format!("`{field}` is a field, and a topic has a whole value"),
            "name the input alone",
        ));
    }
    let message = RosMessage::of(property.descriptor());
    match message.check_decodable() {
        Ok(()) => Ok((property, message)),
        Err(reason) => Err(wrong(reason, "read it with a module that has an input of another interface")),
    }
}

/// The property that a topic has, and how it lies there.
pub fn output(composer: &Composer, own: &TopicOutput) -> Result<(Arc<Property>, RosMessage), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (own.property.clone(), own.topic.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: own.place }))
    };
    let (property, field) = composer
        .board()
        .find(&own.property)
        .map_err(|error| wrong(error.to_string(), "`slate list` shows the properties"))?;
    if !field.is_empty() {
        return Err(wrong(
            format!("`{field}` is a field, and a topic has a whole value"),
            "name the property",
        ));
    }
    if property.channel().is_none() {
        return Err(wrong("it takes messages, and has no value".into(), "name an output"));
    }
    let message = RosMessage::of(property.descriptor());
    Ok((property, message))
}

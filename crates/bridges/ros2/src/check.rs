use std::sync::Arc;

use slate_blackboard::Property;
use slate_blackboard::interface::Interface;
use slate_interfaces::Transform;
use slate_runtime::Composer;

use crate::error::{RosError, TopicMisfit};
use crate::message::RosMessage;
use crate::options::FrameInput;
use crate::services::check_services;
use crate::settings::{RosSettings, TopicInput, TopicOutput};
use crate::whole_input::whole_input;

/// Whether the ports that settings name are there and fit their topics and services; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    settings.read.iter().try_for_each(|own| input(composer, own).map(drop))?;
    settings.write.iter().try_for_each(|own| output(composer, own).map(drop))?;
    check_services(composer, settings)?;
    let frames = &settings.options.frames;
    frames.iter().try_for_each(|own| check_frame(composer, own).map(drop))?;
    check_clock(composer, settings)
}

/// The input that reads the transform of a frame.
pub fn check_frame(composer: &Composer, own: &FrameInput) -> Result<Arc<Property>, RosError> {
    let wrong = |reason: String, help: &'static str| {
        let topic = format!("frame {}", own.frame);
        let (property, place) = (own.input.clone(), own.place);
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place }))
    };
    let found = whole_input(composer, &own.input);
    let property = found.map_err(|(reason, help)| wrong(reason, help))?;
    if property.descriptor().hash != Transform::DESCRIPTOR.hash {
        let reason = format!("the input is a {}, and a frame has a Transform", property.descriptor().name);
        return Err(wrong(reason, "name the input of a module of the kind `external_frame`"));
    }
    Ok(property)
}

/// Whether the agent has a time that is its own, if that is published.
pub fn check_clock(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    if settings.options.clock && !composer.is_lockstep() {
        let reason =
            "the agent goes by the system's clock, and /clock is the time of a simulation".to_owned();
        return Err(RosError::Clock { reason });
    }
    Ok(())
}

/// The input that reads a topic, and what it reads.
pub fn input(composer: &Composer, own: &TopicInput) -> Result<(Arc<Property>, RosMessage), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (own.input.clone(), own.topic.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: own.place }))
    };
    let found = whole_input(composer, &own.input);
    let property = found.map_err(|(reason, help)| wrong(reason, help))?;
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

//! Properties that topics fill or show, checked.

use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;
use slate_topics::{TopicMisfit, check_services, frame_input};

use crate::error::Ros1Error;
use crate::message::Ros1Message;
use crate::settings::{ReadTopic, Ros1Settings, WrittenTopic};

/// Whether the properties that settings name are there and fit their topics; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &Ros1Settings) -> Result<(), Ros1Error> {
    settings.read.iter().try_for_each(|own| input(composer, own).map(drop))?;
    settings.write.iter().try_for_each(|own| output(composer, own).map(drop))?;
    check_services(composer, &settings.serve, &settings.call)?;
    settings.options.frames.iter().try_for_each(|own| frame_input(composer, own).map(drop))?;
    check_clock(composer, settings)
}

/// Whether the agent has a time that is its own, if that is published.
pub fn check_clock(composer: &Composer, settings: &Ros1Settings) -> Result<(), Ros1Error> {
    if settings.options.clock && !composer.is_lockstep() {
        let reason =
            "the agent goes by the system's clock, and /clock is the time of a simulation".to_owned();
        return Err(Ros1Error::Clock { reason });
    }
    Ok(())
}

/// The input that a topic fills, and its messages.
pub fn input(composer: &Composer, own: &ReadTopic) -> Result<(Arc<Property>, Ros1Message), Box<TopicMisfit>> {
    let property =
        slate_topics::input(composer, &own.input, &own.topic).map_err(|misfit| misfit.at(Some(own.place)))?;
    let message = Ros1Message::of(property.descriptor());
    match message.check_decodable() {
        Ok(()) => Ok((property, message)),
        Err(reason) => {
            let help = "read it with a module that has an input of another interface";
            Err(TopicMisfit::new(&own.input, &own.topic, reason, help).at(Some(own.place)))
        }
    }
}

/// The property whose values a topic has, and its messages.
pub fn output(
    composer: &Composer,
    own: &WrittenTopic,
) -> Result<(Arc<Property>, Ros1Message), Box<TopicMisfit>> {
    let property = slate_topics::output(composer, &own.property, &own.topic)
        .map_err(|misfit| misfit.at(Some(own.place)))?;
    let message = Ros1Message::of(property.descriptor());
    Ok((property, message))
}

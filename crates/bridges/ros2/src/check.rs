use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;
use slate_topics::{TopicMisfit, check_services, frame_input};

use crate::error::RosError;
use crate::message::RosMessage;
use crate::settings::{RosSettings, TopicInput, TopicOutput};

/// Whether the ports that settings name are there and fit their topics and services; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    settings.read.iter().try_for_each(|own| input(composer, own).map(drop))?;
    settings.write.iter().try_for_each(|own| output(composer, own).map(drop))?;
    check_services(composer, &settings.serve, &settings.call)?;
    let frames = &settings.options.frames;
    frames.iter().try_for_each(|own| frame_input(composer, own).map(drop))?;
    check_clock(composer, settings)
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
    let property =
        slate_topics::input(composer, &own.input, &own.topic).map_err(|misfit| misfit.at(own.place))?;
    let message = RosMessage::of(property.descriptor());
    match message.check_decodable() {
        Ok(()) => Ok((property, message)),
        Err(reason) => {
            let help = "read it with a module that has an input of another interface";
            Err(TopicMisfit::new(&own.input, &own.topic, reason, help).at(own.place).into())
        }
    }
}

/// The property that a topic has, and how it lies there.
pub fn output(composer: &Composer, own: &TopicOutput) -> Result<(Arc<Property>, RosMessage), RosError> {
    let property =
        slate_topics::output(composer, &own.property, &own.topic).map_err(|misfit| misfit.at(own.place))?;
    let message = RosMessage::of(property.descriptor());
    Ok((property, message))
}

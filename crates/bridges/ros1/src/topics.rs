//! Properties that topics fill or show, checked.

use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;
use slate_topics::TopicMisfit;

use crate::message::Ros1Message;
use crate::settings::{Ros1Settings, TopicInput, TopicOutput};

/// Whether the properties that settings name are there and fit their topics; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &Ros1Settings) -> Result<(), Box<TopicMisfit>> {
    settings.read.iter().try_for_each(|own| input(composer, own).map(drop))?;
    settings.write.iter().try_for_each(|own| output(composer, own).map(drop))
}

/// The input that a topic fills, and its messages.
pub fn input(
    composer: &Composer,
    own: &TopicInput,
) -> Result<(Arc<Property>, Ros1Message), Box<TopicMisfit>> {
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
    own: &TopicOutput,
) -> Result<(Arc<Property>, Ros1Message), Box<TopicMisfit>> {
    let property = slate_topics::output(composer, &own.property, &own.topic)
        .map_err(|misfit| misfit.at(Some(own.place)))?;
    let message = Ros1Message::of(property.descriptor());
    Ok((property, message))
}

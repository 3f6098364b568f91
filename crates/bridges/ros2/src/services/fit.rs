//! How messages of modules and requests of services fit each other.

use std::sync::Arc;

use serde_json::{Map, Value as Json};
use slate_blackboard::interface::{Descriptor, View, edit};
use slate_blackboard::{Carrier, Property, Shape};
use slate_record::ros::{Schema, encode_json};
use slate_runtime::Composer;

use crate::error::{RosError, TopicMisfit};
use crate::service_settings::{ServiceCall, ServiceOffer};
use crate::settings::RosSettings;
use crate::whole_input::whole_input;

/// A field of an interface that only fills up.
const RESERVED: &str = "reserved";

/// Fields of a message of ROS and of an interface that are the same: those of one name, or the only ones.
#[derive(Clone, Debug)]
pub struct FieldPairs {
    /// Name in the message, name in the interface.
    pairs: Vec<(String, String)>,
}

impl FieldPairs {
    pub fn new(message: &Schema, descriptor: &'static Descriptor) -> Self {
        let message: Vec<_> = message.field_names().collect();
        let own: Vec<_> = fields(descriptor).collect();
        let pairs = match (&message[..], &own[..]) {
            ([only], [own]) => vec![((*only).to_owned(), (*own).to_owned())],
            _ => {
                let both = message.iter().filter(|name| own.contains(name));
                both.map(|name| ((*name).to_owned(), (*name).to_owned())).collect()
            }
        };
        Self { pairs }
    }

    /// The value of a message, over those fields that `rest` has.
    pub fn value(&self, message: &Json, rest: &Json) -> Json {
        let mut value = rest.as_object().cloned().unwrap_or_default();
        for (theirs, own) in &self.pairs {
            if let Some(field) = message.get(theirs) {
                value.insert(own.clone(), field.clone());
            }
        }
        Json::Object(value)
    }

    /// The message of a value.
    pub fn message(&self, value: &Json) -> Json {
        let field = |(theirs, own): &(String, String)| Some((theirs.clone(), value.get(own)?.clone()));
        Json::Object(self.pairs.iter().filter_map(field).collect::<Map<_, _>>())
    }
}

fn fields(descriptor: &'static Descriptor) -> impl Iterator<Item = &'static str> {
    descriptor.fields.iter().map(|field| field.name).filter(|name| *name != RESERVED)
}

/// The bytes of a value of an interface; fields that it lacks are zero.
///
/// # Errors
/// What does not fit, in words.
pub fn bytes(descriptor: &'static Descriptor, shape: Shape, value: &Json) -> Result<Vec<u8>, String> {
    let value = serde_json::from_value(value.clone()).map_err(|error| error.to_string())?;
    let mut bytes = vec![0; shape.bytes(shape.capacity)];
    let items = edit(descriptor, &mut bytes, 0, "", &value).map_err(|error| error.to_string())?;
    bytes.truncate(shape.bytes(items));
    Ok(bytes)
}

/// A value of an interface without its type.
pub fn json(descriptor: &'static Descriptor, bytes: &[u8], items: usize) -> Json {
    let view = View::new(descriptor, bytes, items);
    view.and_then(|view| serde_json::to_value(view.value()).ok()).unwrap_or_default()
}

/// The value of an empty message.
fn empty(message: &Schema) -> Result<Json, String> {
    let wrong = |error: slate_record::ros::Error| error.to_string();
    let value =
        message.decode(&encode_json(message, &Json::Object(Map::new())).map_err(wrong)?).map_err(wrong)?;
    serde_json::to_value(value).map_err(|error| error.to_string())
}

/// Whether the ports that services name are there and fit them; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_services(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    settings.serve.iter().try_for_each(|offer| inbox(composer, offer).map(drop))?;
    settings.call.iter().try_for_each(|call| outbox(composer, call).map(drop))
}

/// The inbox of a service, and how its requests are messages.
pub fn inbox(composer: &Composer, offer: &ServiceOffer) -> Result<(Arc<Property>, FieldPairs), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (offer.inbox.clone(), offer.service.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: offer.place }))
    };
    let (property, shape) =
        mailbox(composer, &offer.inbox).map_err(|reason| wrong(reason, "`slate list` shows the inboxes"))?;
    let descriptor = property.descriptor();
    let pairs = FieldPairs::new(&offer.of.request, descriptor);
    let value = empty(&offer.of.request).map(|message| pairs.value(&message, &offer.value));
    let value = value.map_err(|reason| wrong(reason, "correct `definition`"))?;
    let lacking: Vec<_> = fields(descriptor).filter(|name| value.get(name).is_none()).collect();
    if !lacking.is_empty() {
        let reason = format!("{} has no {}", offer.of.name(), lacking.join(", "));
        return Err(wrong(reason, "say it in the entry, as in value = { brightness = 0.5 }"));
    }
    let is_fit = bytes(descriptor, shape, &value);
    is_fit.map_err(|reason| wrong(reason, "take a service with fields of the types of the inbox"))?;
    Ok((property, pairs))
}

/// The outbox that calls a service, and how its messages are requests.
pub fn outbox(composer: &Composer, call: &ServiceCall) -> Result<(Arc<Property>, FieldPairs), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (call.outbox.clone(), call.service.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: call.place }))
    };
    let found = mailbox(composer, &call.outbox);
    let help = "name an outbox that no link of [links] has; `slate graph` shows the ports";
    let (property, shape) = found.map_err(|reason| wrong(reason, help))?;
    let descriptor = property.descriptor();
    let pairs = FieldPairs::new(&call.of.request, descriptor);
    let zero = vec![0; shape.bytes(0)];
    let request = pairs.message(&json(descriptor, &zero, 0));
    let is_fit = encode_json(&call.of.request, &request).map_err(|error| error.to_string());
    is_fit.map_err(|reason| wrong(reason, "take a service with fields of the types of the outbox"))?;
    if let Some(input) = &call.response {
        answer_input(composer, call, input)?;
    }
    Ok((property, pairs))
}

/// The input that is set to responses, and how those are its values.
pub fn answer_input(
    composer: &Composer,
    call: &ServiceCall,
    input: &str,
) -> Result<(Arc<Property>, FieldPairs), RosError> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (input.to_owned(), call.service.clone());
        RosError::from(Box::new(TopicMisfit { property, topic, reason, help, place: call.place }))
    };
    let property = whole_input(composer, input).map_err(|(reason, help)| wrong(reason, help))?;
    let pairs = FieldPairs::new(&call.of.response, property.descriptor());
    let shape = property.channel().map(|channel| channel.shape());
    let fits = empty(&call.of.response).and_then(|message| {
        let value = pairs.value(&message, &Json::Null);
        shape.map_or(Ok(Vec::new()), |shape| bytes(property.descriptor(), shape, &value))
    });
    fits.map_err(|reason| wrong(reason, "read it with an input whose fields have the response's types"))?;
    Ok((property, pairs))
}

/// What takes messages at a path, and their memory.
fn mailbox(composer: &Composer, path: &str) -> Result<(Arc<Property>, Shape), String> {
    let (property, field) = composer.board().find(path).map_err(|error| error.to_string())?;
    match property.carrier() {
        Carrier::Mailbox(mailbox) if field.is_empty() && property.path() == path => {
            let shape = mailbox.shape();
            Ok((property, shape))
        }
        _ => Err("it takes no messages".into()),
    }
}

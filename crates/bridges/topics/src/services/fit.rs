//! How messages of modules and requests of services fit each other.

use std::sync::Arc;

use serde_json::{Map, Value as Json};
use slate_blackboard::interface::{Descriptor, View, edit};
use slate_blackboard::{Carrier, Property, Shape};
use slate_record::ros::Schema;
use slate_runtime::Composer;

use crate::misfit::TopicMisfit;
use crate::service_settings::{ServiceCall, ServiceOffer};
use crate::service_type::ServiceType;

/// A field of an interface that only fills up.
const RESERVED: &str = "reserved";

/// Fields of a message of ROS and of an interface that are the same: those of one name, or the only ones.
#[derive(Clone, Debug)]
pub struct FieldPairs {
    /// Name in the message, name in the interface.
    pairs: Vec<(String, String)>,
}

impl FieldPairs {
    /// The pairs of a message and an interface.
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
/// A value does not fit; the reason in words.
pub fn bytes(descriptor: &'static Descriptor, shape: Shape, value: &Json) -> Result<Vec<u8>, String> {
    let value = serde_json::from_value(value.clone()).map_err(|error| error.to_string())?;
    let mut bytes = vec![0; shape.bytes(shape.capacity)];
    let items = edit(descriptor, &mut bytes, 0, "", &value).map_err(|error| error.to_string())?;
    bytes.truncate(shape.bytes(items));
    Ok(bytes)
}

/// The value of bytes of an interface.
pub fn json(descriptor: &'static Descriptor, bytes: &[u8], items: usize) -> Json {
    let view = View::new(descriptor, bytes, items);
    view.and_then(|view| serde_json::to_value(view.value()).ok()).unwrap_or_default()
}

/// Whether the ports that services name are there and fit them; nothing is opened.
///
/// # Errors
/// The first that does not fit.
pub fn check_services(
    composer: &Composer,
    offers: &[ServiceOffer],
    calls: &[ServiceCall],
) -> Result<(), Box<TopicMisfit>> {
    offers.iter().try_for_each(|offer| inbox(composer, offer).map(drop))?;
    calls.iter().try_for_each(|call| outbox(composer, call).map(drop))
}

/// Values of an empty request and an empty response.
fn empty_request(of: &ServiceType) -> Result<Json, String> {
    of.decode_request(&of.encode_request(&Json::Object(Map::new()))?)
}

fn empty_response(of: &ServiceType) -> Result<Json, String> {
    of.decode_response(&of.encode_response(&Json::Object(Map::new()))?)
}

/// The inbox of a service, and how its requests are messages.
///
/// # Errors
/// When it does not fit.
pub fn inbox(
    composer: &Composer,
    offer: &ServiceOffer,
) -> Result<(Arc<Property>, FieldPairs), Box<TopicMisfit>> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (offer.inbox.clone(), offer.service.clone());
        Box::new(TopicMisfit { property, topic, reason, help, place: offer.place })
    };
    let (property, shape) =
        mailbox(composer, &offer.inbox).map_err(|reason| wrong(reason, "`slate list` shows the inboxes"))?;
    let descriptor = property.descriptor();
    let pairs = FieldPairs::new(offer.of.request(), descriptor);
    let value = empty_request(&offer.of).map(|message| pairs.value(&message, &offer.value));
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
///
/// # Errors
/// When it does not fit.
pub fn outbox(
    composer: &Composer,
    call: &ServiceCall,
) -> Result<(Arc<Property>, FieldPairs), Box<TopicMisfit>> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (call.outbox.clone(), call.service.clone());
        Box::new(TopicMisfit { property, topic, reason, help, place: call.place })
    };
    let found = mailbox(composer, &call.outbox);
    let help = "name an outbox that no link of [links] has; `slate graph` shows the ports";
    let (property, shape) = found.map_err(|reason| wrong(reason, help))?;
    let descriptor = property.descriptor();
    let pairs = FieldPairs::new(call.of.request(), descriptor);
    let zero = vec![0; shape.bytes(0)];
    let request = pairs.message(&json(descriptor, &zero, 0));
    let is_fit = call.of.encode_request(&request);
    is_fit.map_err(|reason| wrong(reason, "take a service with fields of the types of the outbox"))?;
    if let Some(input) = &call.response {
        answer_input(composer, call, input)?;
    }
    Ok((property, pairs))
}

/// The input that is set to responses, and how those are its values.
///
/// # Errors
/// When it does not fit.
pub fn answer_input(
    composer: &Composer,
    call: &ServiceCall,
    input: &str,
) -> Result<(Arc<Property>, FieldPairs), Box<TopicMisfit>> {
    let wrong = |reason: String, help: &'static str| {
        let (property, topic) = (input.to_owned(), call.service.clone());
        Box::new(TopicMisfit { property, topic, reason, help, place: call.place })
    };
    let property =
        crate::misfit::input(composer, input, &call.service).map_err(|misfit| misfit.at(call.place))?;
    let pairs = FieldPairs::new(call.of.response(), property.descriptor());
    let shape = property.channel().map(|channel| channel.shape());
    let fits = empty_response(&call.of).and_then(|message| {
        let value = pairs.value(&message, &Json::Null);
        shape.map_or(Ok(Vec::new()), |shape| bytes(property.descriptor(), shape, &value))
    });
    fits.map_err(|reason| wrong(reason, "read it with an input whose fields have the response's types"))?;
    Ok((property, pairs))
}

/// The inbox or outbox at a path, and its memory.
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

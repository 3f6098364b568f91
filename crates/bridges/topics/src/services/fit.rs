//! Matching of modules' messages and services' requests.

use std::sync::Arc;

use serde_json::{Map, Value as Json};
use slate_blackboard::interface::{Descriptor, View, edit};
use slate_blackboard::{Access, Property, Shape};
use slate_ros_messages::Schema;
use slate_runtime::configuration::Span;
use slate_runtime::{ExternalPorts, PropertyFacts};

use crate::message_type::MessageType;
use crate::mismatch::{TopicMismatch, input, output};
use crate::service_settings::{ServiceCall, ServiceOffer};

/// Name of padding fields in an interface.
const PADDING_FIELD: &str = "reserved";

/// Pairs of equivalent fields in a ROS message and an interface.
/// Those of one name, or the only ones.
#[derive(Clone, Debug)]
pub struct FieldPairs {
    /// Name in the message, name in the interface.
    pairs: Vec<(String, String)>,
}

impl FieldPairs {
    /// Creates the pairs of a message and an interface.
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

    /// Converts a message to a value, over the fields of `rest`.
    pub fn value(&self, message: &Json, rest: &Json) -> Json {
        let mut value = rest.as_object().cloned().unwrap_or_default();
        for (theirs, own) in &self.pairs {
            if let Some(field) = message.get(theirs) {
                value.insert(own.clone(), field.clone());
            }
        }
        Json::Object(value)
    }

    /// Converts a value to a message.
    pub fn message(&self, value: &Json) -> Json {
        let field = |(theirs, own): &(String, String)| Some((theirs.clone(), value.get(own)?.clone()));
        Json::Object(self.pairs.iter().filter_map(field).collect::<Map<_, _>>())
    }
}

fn fields(descriptor: &'static Descriptor) -> impl Iterator<Item = &'static str> {
    descriptor.fields.iter().map(|field| field.name).filter(|name| *name != PADDING_FIELD)
}

/// Encodes a value of an interface; fields that it lacks are zero.
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

/// Decodes the bytes of an interface's value.
pub fn json(descriptor: &'static Descriptor, bytes: &[u8], items: usize) -> Json {
    let view = View::new(descriptor, bytes, items);
    view.and_then(|view| serde_json::to_value(view.value()).ok()).unwrap_or_default()
}

/// Checks that the ports that services name exist and fit them; opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_services(
    ports: &impl ExternalPorts,
    offers: &[ServiceOffer],
    calls: &[ServiceCall],
) -> Result<(), Box<TopicMismatch>> {
    offers.iter().try_for_each(|offer| inbox(ports, offer).map(drop))?;
    calls.iter().try_for_each(|call| {
        outbox(ports, call)?;
        call.response.as_ref().map_or(Ok(()), |input| answer_input(ports, call, input).map(drop))
    })
}

/// Returns the inbox of a service, with the pairs for its requests.
///
/// # Errors
/// The inbox is missing, or does not fit.
pub fn inbox<P: ExternalPorts>(
    ports: &P,
    offer: &ServiceOffer,
) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
    let port = NamedPort { path: &offer.inbox, topic: &offer.service, place: offer.place };
    port.inbox(ports, offer.service_type.request(), &offer.value)
}

/// Returns the outbox that calls a service, with the pairs for its messages.
///
/// # Errors
/// The outbox is missing, or does not fit.
pub fn outbox<P: ExternalPorts>(
    ports: &P,
    call: &ServiceCall,
) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
    let port = NamedPort { path: &call.outbox, topic: &call.service, place: call.place };
    port.outbox(ports, call.service_type.request())
}

/// Returns the input that is set to responses, with the pairs for its values.
///
/// # Errors
/// The input is missing, or does not fit.
pub fn answer_input<P: ExternalPorts>(
    ports: &P,
    call: &ServiceCall,
    input: &str,
) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
    let port = NamedPort { path: input, topic: &call.service, place: call.place };
    port.input(ports, call.service_type.response())
}

/// Port that fits messages, with the pairs of fields.
pub type FittingPort<P = Arc<Property>> = (P, FieldPairs);

/// Port that a service or an action names.
#[derive(Clone, Copy, Debug)]
pub struct NamedPort<'n> {
    /// Path.
    pub path: &'n str,
    /// Service or action.
    pub topic: &'n str,
    /// Place in the configuration.
    pub place: Option<Span>,
}

impl NamedPort<'_> {
    fn mismatch(&self, reason: impl Into<String>, help: &'static str) -> Box<TopicMismatch> {
        TopicMismatch::new(self.path, self.topic, reason, help).at(self.place)
    }

    /// Returns the port as an inbox that receives messages.
    /// `value` has the fields that the messages lack.
    ///
    /// # Errors
    /// The inbox is missing, or does not fit.
    pub fn inbox<P: ExternalPorts>(
        &self,
        ports: &P,
        message_type: &MessageType,
        value: &Json,
    ) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
        let (property, shape) = message_port(ports, self.path)
            .map_err(|reason| self.mismatch(reason, "`slate list` shows the inboxes"))?;
        ports.external_inbox(self.path).map_err(|error| self.mismatch(error.reason, error.help))?;
        let descriptor = property.descriptor();
        let pairs = FieldPairs::new(message_type.schema(), descriptor);
        let value = message_type.empty().map(|message| pairs.value(&message, value));
        let value = value.map_err(|reason| self.mismatch(reason, "correct `definition`"))?;
        let missing: Vec<_> = fields(descriptor).filter(|name| value.get(name).is_none()).collect();
        if !missing.is_empty() {
            let reason = format!("{} has no {}", message_type.name(), missing.join(", "));
            return Err(self.mismatch(reason, "write it in the entry, as in value = { brightness = 0.5 }"));
        }
        let checked = bytes(descriptor, shape, &value);
        checked
            .map_err(|reason| self.mismatch(reason, "take a type with fields of the types of the inbox"))?;
        Ok((property, pairs))
    }

    /// Returns the port as an inbox or outbox of any interface.
    ///
    /// # Errors
    /// It is missing.
    pub fn message_port<P: ExternalPorts>(&self, ports: &P) -> Result<P::Property, Box<TopicMismatch>> {
        let help = "name an outbox that no link of [links] has; `slate graph` shows the ports";
        let found = message_port(ports, self.path);
        found.map(|(property, _)| property).map_err(|reason| self.mismatch(reason, help))
    }

    /// Returns the port as an outbox whose messages are sent.
    ///
    /// # Errors
    /// The outbox is missing, or does not fit.
    pub fn outbox<P: ExternalPorts>(
        &self,
        ports: &P,
        message_type: &MessageType,
    ) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
        let property = self.message_port(ports)?;
        let pairs = self.sent_pairs(&property, message_type)?;
        Ok((property, pairs))
    }

    /// Returns the port as an output whose values are sent.
    ///
    /// # Errors
    /// The output is missing, or no field of it fits.
    pub fn output<P: ExternalPorts>(
        &self,
        ports: &P,
        message_type: &MessageType,
    ) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
        let property = output(ports, self.path, self.topic).map_err(|mismatch| mismatch.at(self.place))?;
        let pairs = self.sent_pairs(&property, message_type)?;
        if pairs.pairs.is_empty() && message_type.schema().field_names().next().is_some() {
            let theirs: Vec<_> = message_type.schema().field_names().collect();
            let reason =
                format!("no field of it is one of {}, which has {}", message_type.name(), theirs.join(", "));
            return Err(self.mismatch(reason, "name an output with fields of that name"));
        }
        Ok((property, pairs))
    }

    /// Returns the pairs of fields that convert values of a port to messages.
    fn sent_pairs(
        &self,
        property: &impl PropertyFacts,
        message_type: &MessageType,
    ) -> Result<FieldPairs, Box<TopicMismatch>> {
        let descriptor = property.descriptor();
        let pairs = FieldPairs::new(message_type.schema(), descriptor);
        let zero = vec![0; descriptor.size];
        let checked = message_type.encode(&pairs.message(&json(descriptor, &zero, 0)));
        checked
            .map_err(|reason| self.mismatch(reason, "take a type with fields of the types of the port"))?;
        Ok(pairs)
    }

    /// Returns the port as an input that is set to messages.
    ///
    /// # Errors
    /// The input is missing, or does not fit.
    pub fn input<P: ExternalPorts>(
        &self,
        ports: &P,
        message_type: &MessageType,
    ) -> Result<FittingPort<P::Property>, Box<TopicMismatch>> {
        let property = input(ports, self.path, self.topic).map_err(|mismatch| mismatch.at(self.place))?;
        let pairs = FieldPairs::new(message_type.schema(), property.descriptor());
        let shape = property.has_value().then(|| property.shape());
        let checked = message_type.empty().and_then(|message| {
            let value = pairs.value(&message, &Json::Null);
            shape.map_or(Ok(Vec::new()), |shape| bytes(property.descriptor(), shape, &value))
        });
        let help = "read it with an input whose fields have the types of the message's";
        checked.map_err(|reason| self.mismatch(reason, help))?;
        Ok((property, pairs))
    }
}

/// Returns the inbox or outbox at a path, and its shape.
fn message_port<P: ExternalPorts>(ports: &P, path: &str) -> Result<(P::Property, Shape), String> {
    let (property, field) = ports.find(path).map_err(|error| error.to_string())?;
    if property.access() == Access::Messages && field.is_empty() && property.path() == path {
        let shape = property.shape();
        Ok((property, shape))
    } else {
        Err("it takes no messages".into())
    }
}

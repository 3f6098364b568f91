//! Tables `serve` and `call` of a bridge.

use std::time::Duration;

use serde_json::{Map, Value as Json};
use slate_ros_messages::WireFormat;
use slate_runtime::configuration::{Span, Spanned, Table, Value};

use crate::action_type::ActionType;
use crate::service_type::ServiceType;
use crate::table_reader::TableReader;

/// Default timeout for an answer.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(5);

/// Inbox that is a service.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceOffer {
    /// Name of the service, from the root.
    pub service: String,
    /// Type.
    pub service_type: ServiceType,
    /// Path of the inbox.
    pub inbox: String,
    /// Fields of the message that no request has.
    pub value: Json,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Service that an outbox calls.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceCall {
    /// Name of the service, from the root.
    pub service: String,
    /// Type.
    pub service_type: ServiceType,
    /// Path of the outbox.
    pub outbox: String,
    /// Path of the input that is set to the responses, if any is.
    pub response: Option<String>,
    /// Timeout for a response.
    pub timeout: Duration,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Returns whether an entry has the type of an action.
pub(crate) fn is_action(entry: &Spanned<Value>) -> bool {
    let service_type =
        entry.as_table().and_then(|own| own.get("type")).and_then(|service_type| service_type.as_str());
    service_type.is_some_and(ActionType::is_name)
}

/// Reads both tables.
pub struct ServicesReader<'r, 'c> {
    pub(crate) reader: &'r mut TableReader<'c>,
    serve: String,
    call: String,
}

impl<'r, 'c> ServicesReader<'r, 'c> {
    /// Creates the reader of services and calls, on the table reader of a bridge.
    /// `example` is one of the bridge's service types.
    pub fn new(reader: &'r mut TableReader<'c>, example: &str) -> Self {
        Self {
            reader,
            serve: format!("write serve.\"/arm/enable\" = {{ to = \"arm/requests\", type = \"{example}\" }}"),
            call: format!("write call.\"/enable\" = {{ from = \"driver/requests\", type = \"{example}\" }}"),
        }
    }

    /// Services that the agent offers.
    pub fn offers(&mut self, table: &Table) -> Vec<ServiceOffer> {
        let help = self.serve.clone();
        let help = help.as_str();
        let mut offers: Vec<ServiceOffer> = Vec::new();
        for (name, span, entry) in self.reader.entries(table, "serve", help) {
            if self.is_left_to_actions(&entry) {
                continue;
            }
            let service = self.reader.topic(&name, span, help);
            let Some(own) = self.table(&entry, &["to", "type", "definition", "value"], help) else {
                continue;
            };
            let inbox = self.path(own, "to", entry.span, help);
            let service_type = self.service_type(own, entry.span, help);
            let value = self.value(own);
            let (Some(service), Some(inbox), Some(service_type)) = (service, inbox, service_type) else {
                continue;
            };
            if offers.iter().any(|other| other.service == service) {
                let text = format!("{service} is offered by two entries");
                self.reader.add(span, text, "a service has one server: take one away");
            }
            offers.push(ServiceOffer { service, service_type, inbox, value, place: Some(entry.span) });
        }
        offers
    }

    /// Services that the agent calls.
    pub fn calls(&mut self, table: &Table) -> Vec<ServiceCall> {
        let help = self.call.clone();
        let help = help.as_str();
        let mut calls: Vec<ServiceCall> = Vec::new();
        for (name, span, entry) in self.reader.entries(table, "call", help) {
            if self.is_left_to_actions(&entry) {
                continue;
            }
            let service = self.reader.topic(&name, span, help);
            let keys = ["from", "type", "definition", "response", "timeout"];
            let Some(own) = self.table(&entry, &keys, help) else { continue };
            let outbox = self.path(own, "from", entry.span, help);
            let service_type = self.service_type(own, entry.span, help);
            let response = own.get("response").and_then(|_| self.path(own, "response", entry.span, help));
            let timeout = self.timeout(own);
            let (Some(service), Some(outbox), Some(service_type)) = (service, outbox, service_type) else {
                continue;
            };
            if calls.iter().any(|other| other.outbox == outbox) {
                let text = format!("/{outbox} calls two services");
                self.reader.add(span, text, "an outbox has one receiver: take one away");
            }
            calls.push(ServiceCall {
                service,
                service_type,
                outbox,
                response,
                timeout,
                place: Some(entry.span),
            });
        }
        calls
    }

    /// Actions exist in ROS 2 alone.
    fn is_left_to_actions(&self, entry: &Spanned<Value>) -> bool {
        self.reader.format() == WireFormat::Cdr && is_action(entry)
    }

    pub(crate) fn table<'e>(
        &mut self,
        entry: &'e Spanned<Value>,
        known: &[&str],
        help: &str,
    ) -> Option<&'e Table> {
        match entry.as_table() {
            Some(own) => {
                self.reader.check_keys(own, "of a service", known);
                Some(own)
            }
            None => {
                let message = format!("an entry of a service is a table, found {}", entry.describe());
                self.reader.add(entry.span, message, help);
                None
            }
        }
    }

    pub(crate) fn path(&mut self, own: &Table, key: &str, span: Span, help: &str) -> Option<String> {
        if own.get(key).is_none() {
            self.reader.add(span, format!("an entry lacks `{key}`"), help);
        }
        let (text, span) = self.reader.text(own, key, help)?;
        self.reader.path(&text, span, help)
    }

    fn service_type(&mut self, own: &Table, span: Span, help: &str) -> Option<ServiceType> {
        if own.get("type").is_none() {
            self.reader.add(span, "an entry lacks `type`", help);
        }
        let (name, span) = self.reader.text(own, "type", help)?;
        let definition =
            self.reader.text(own, "definition", "write definition = \"bool data\\n---\\nbool success\"");
        let definition = match definition {
            Some((text, span)) => Some(self.reader.definition_text(&text, span, &name, "srv")?),
            None => None,
        };
        let format = self.reader.format();
        let found = match definition {
            Some(text) => ServiceType::parse(format, &name, &text),
            None => ServiceType::known(format, &name),
        };
        match found {
            Ok(found) => Some(found),
            Err(reason) => {
                let help = "write its .srv file as definition = \"bool data\\n---\\nbool success\"";
                self.reader.add(span, reason, help);
                None
            }
        }
    }

    pub(crate) fn value(&mut self, own: &Table) -> Json {
        let Some(value) = own.get("value") else { return Json::Object(Map::new()) };
        let Some(table) = value.as_table() else {
            let message = format!("`value` is a table, found {}", value.describe());
            self.reader.add(value.span, message, "write value = { brightness = 0.5 }");
            return Json::Object(Map::new());
        };
        let value = slate_blackboard::interface::Value::from(table);
        serde_json::to_value(value).unwrap_or_default()
    }

    pub(crate) fn timeout(&mut self, own: &Table) -> Duration {
        self.reader.timeout(own, DEFAULT_TIMEOUT)
    }
}

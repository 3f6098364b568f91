//! Actions in the tables `serve` and `call` of a bridge.

use std::time::Duration;

use serde_json::Value as Json;
use slate_runtime::configuration::{Span, Table};

use crate::action_type::ActionType;
use crate::service_settings::{ServicesReader, is_action};

const SERVE_HELP: &str = "write serve.\"/drive\" = { to = \"driver/goals\", type = \"my_package/action/Drive\", definition = \"Drive.action\", result = \"driver/arrived\" }";
const CALL_HELP: &str = "write call.\"/drive\" = { from = \"mission/goals\", type = \"my_package/action/Drive\", definition = \"Drive.action\", result = \"mission/arrived\" }";

/// Inbox that is the server of an action.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionOffer {
    /// Name of the action, from the root.
    pub action: String,
    /// Type.
    pub action_type: ActionType,
    /// Path of the inbox that receives goals.
    pub inbox: String,
    /// Fields of its message that no goal has.
    pub value: Json,
    /// Path of the output whose next value ends a goal.
    pub result: String,
    /// Path of the output whose values are feedback.
    pub feedback: Option<String>,
    /// Message that cancels a goal; without it, goals can't be cancelled.
    pub cancel: Option<CancelMessage>,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Message that cancels a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct CancelMessage {
    /// Path of the inbox that receives it.
    pub inbox: String,
    /// Fields.
    pub value: Json,
}

/// Action that an outbox calls.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionCall {
    /// Name of the action, from the root.
    pub action: String,
    /// Type.
    pub action_type: ActionType,
    /// Path of the outbox whose messages are goals.
    pub outbox: String,
    /// Path of the input that is set to results.
    pub result: Option<String>,
    /// Path of the input that is set to feedback.
    pub feedback: Option<String>,
    /// Path of the outbox whose messages cancel the goal.
    pub cancel: Option<String>,
    /// Longest wait for a server, and for its acceptance of a goal.
    pub timeout: Duration,
    /// Place in the configuration.
    pub place: Option<Span>,
}

impl ServicesReader<'_, '_> {
    /// Actions that the agent offers.
    pub fn action_offers(&mut self, table: &Table) -> Vec<ActionOffer> {
        let mut offers: Vec<ActionOffer> = Vec::new();
        for (name, span, entry) in self.reader.entries(table, "serve", SERVE_HELP) {
            if !is_action(&entry) {
                continue;
            }
            let action = self.reader.topic(&name, span, SERVE_HELP);
            let keys = ["to", "type", "definition", "value", "result", "feedback", "cancel"];
            let Some(own) = self.table(&entry, &keys, SERVE_HELP) else { continue };
            let inbox = self.path(own, "to", entry.span, SERVE_HELP);
            let action_type = self.action_type(own, entry.span, SERVE_HELP);
            let result = self.path(own, "result", entry.span, SERVE_HELP);
            let feedback =
                own.get("feedback").and_then(|_| self.path(own, "feedback", entry.span, SERVE_HELP));
            let (value, cancel) = (self.value(own), self.cancel(own));
            let (Some(action), Some(action_type), Some(inbox), Some(result)) =
                (action, action_type, inbox, result)
            else {
                continue;
            };
            if offers.iter().any(|other| other.action == action) {
                let text = format!("{action} is offered by two entries");
                self.reader.add(span, text, "an action has one server: take one away");
            }
            offers.push(ActionOffer {
                action,
                action_type,
                inbox,
                value,
                result,
                feedback,
                cancel,
                place: Some(entry.span),
            });
        }
        offers
    }

    /// Actions that the agent calls.
    pub fn action_calls(&mut self, table: &Table) -> Vec<ActionCall> {
        let mut calls = Vec::new();
        for (name, span, entry) in self.reader.entries(table, "call", CALL_HELP) {
            if !is_action(&entry) {
                continue;
            }
            let action = self.reader.topic(&name, span, CALL_HELP);
            let keys = ["from", "type", "definition", "result", "feedback", "cancel", "timeout"];
            let Some(own) = self.table(&entry, &keys, CALL_HELP) else { continue };
            let outbox = self.path(own, "from", entry.span, CALL_HELP);
            let action_type = self.action_type(own, entry.span, CALL_HELP);
            let mut path = |key: &str| own.get(key).and_then(|_| self.path(own, key, entry.span, CALL_HELP));
            let (result, feedback, cancel) = (path("result"), path("feedback"), path("cancel"));
            let timeout = self.timeout(own);
            let (Some(action), Some(action_type), Some(outbox)) = (action, action_type, outbox) else {
                continue;
            };
            calls.push(ActionCall {
                action,
                action_type,
                outbox,
                result,
                feedback,
                cancel,
                timeout,
                place: Some(entry.span),
            });
        }
        calls
    }

    fn action_type(&mut self, own: &Table, span: Span, help: &str) -> Option<ActionType> {
        if own.get("definition").is_none() {
            self.reader.add(span, "an entry of an action lacks `definition`", help);
        }
        let (name, _) = self.reader.text(own, "type", help)?;
        let (text, span) = self.reader.text(own, "definition", help)?;
        let text = self.reader.definition_text(&text, span, &name, "action")?;
        ActionType::parse(&name, &text).map_err(|reason| self.reader.add(span, reason, help)).ok()
    }

    /// Reads a message from a path alone, or from a table with `to` and `value`.
    fn cancel(&mut self, own: &Table) -> Option<CancelMessage> {
        let help = "write cancel = \"driver/stops\", or = { to = \"driver/goals\", value = { speed = 0.0 } }";
        let entry = own.get("cancel")?;
        if let Some(path) = entry.as_str() {
            let inbox = self.reader.path(path, entry.span, help)?;
            return Some(CancelMessage { inbox, value: self.value(&Table::default()) });
        }
        let table = self.table(entry, &["to", "value"], help)?;
        Some(CancelMessage { inbox: self.path(table, "to", entry.span, help)?, value: self.value(table) })
    }
}

//! Requests as messages to an inbox.

use serde_json::{Map, Value as Json};

use super::fit::FieldPairs;
use super::operations::AgentOperations;
use crate::service_settings::ServiceOffer;

/// Sends requests to an inbox.
pub struct InboxHandler {
    /// Service.
    pub offer: ServiceOffer,
    /// Pairs of fields that convert requests to messages.
    pub pairs: FieldPairs,
    /// Sends them.
    pub operations: AgentOperations,
}

impl InboxHandler {
    /// Sends the message of a request, and returns the response.
    /// Its fields `success` and `message`, if it has them, report the outcome of the message.
    ///
    /// # Errors
    /// Why the message is not taken, when the response has no field that tells, with that response.
    pub fn answer(&self, request: &Json) -> Result<Json, (String, Json)> {
        let message = self.pairs.value(request, &self.offer.value);
        let (success, text) = match self.operations.carry_out("send", &[("path", &self.offer.inbox)], message)
        {
            Ok(answer) => (true, answer["status"].as_str().unwrap_or("done").to_owned()),
            Err(reason) => (false, reason),
        };
        let (mut response, mut is_reported) = (Map::new(), success);
        for name in self.offer.service_type.response().schema().field_names() {
            match name {
                "success" => {
                    is_reported = true;
                    response.insert(name.into(), success.into());
                }
                "message" => drop(response.insert(name.into(), text.clone().into())),
                _ => {}
            }
        }
        let response = Json::Object(response);
        if is_reported { Ok(response) } else { Err((text, response)) }
    }
}

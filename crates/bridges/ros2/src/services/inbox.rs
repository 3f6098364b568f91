//! Requests as messages to an inbox.

use serde_json::{Map, Value as Json};

use super::fit::FieldPairs;
use super::{AgentOperations, ServiceHandler};
use crate::service_settings::ServiceOffer;

/// Sends requests to an inbox.
pub struct InboxHandler {
    pub offer: ServiceOffer,
    pub pairs: FieldPairs,
    pub operations: AgentOperations,
}

impl ServiceHandler for InboxHandler {
    /// The fields `success` and `message` of the response, if it has them, tell how the message fares.
    fn answer(&mut self, _: usize, request: &Json) -> Json {
        let message = self.pairs.value(request, &self.offer.value);
        let (success, text) = match self.operations.carry_out("send", &self.offer.inbox, message) {
            Ok(answer) => (true, answer["status"].as_str().unwrap_or("done").to_owned()),
            Err(reason) => (false, reason),
        };
        let mut response = Map::new();
        for name in self.offer.of.response.field_names() {
            match name {
                "success" => drop(response.insert(name.into(), success.into())),
                "message" => drop(response.insert(name.into(), text.clone().into())),
                _ => {}
            }
        }
        Json::Object(response)
    }
}

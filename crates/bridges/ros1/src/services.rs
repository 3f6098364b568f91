//! Inboxes as services, and messages of outboxes as requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::Value as Json;
use slate_blackboard::Carrier;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::{ABANDONED, Answer, Receiver};
use slate_control::ControlSurface;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{
    AgentOperations, FieldPairs, InboundTopics, InboxHandler, ServiceCall, ServiceOffer, answer_input, inbox,
    json, outbox,
};
use tokio::runtime::Handle;
use tokio::time::timeout;

use crate::input_list::InputList;
use crate::settings::{Ros1Settings, SCHEME};
use crate::wire::{NodeContext, RosrpcServer, call_service};
use slate_topics::RosError;

/// Period of the check for messages.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Responses that may wait for the next cycle.
const DEPTH: u16 = 10;

/// Code of a message refused by its service.
/// The request failed, or its response says `success: false`.
const UNSUCCESSFUL: u16 = 1;

/// Returns the services that settings offer.
///
/// # Errors
/// When an inbox does not fit its service.
pub fn servers(
    surface: &Arc<ControlSurface>,
    settings: &Ros1Settings,
    list: &mut InputList,
) -> Result<Vec<RosrpcServer>, RosError> {
    let server = |offer: &ServiceOffer| {
        let (property, pairs) = inbox(surface.agent.composer(), offer)?;
        list.add_source(property, &offer.service);
        let operations = AgentOperations::new(surface, SCHEME)?;
        let handler = InboxHandler { offer: offer.clone(), pairs, operations };
        // A response without a field for it fails, so that its client knows.
        let answer = move |request: &Json| handler.answer(request).map_err(|(reason, _)| reason);
        let server = RosrpcServer::new(&offer.service, &offer.service_type, Box::new(answer));
        server.map_err(|reason| RosError::definition(&offer.service, reason))
    };
    settings.serve.iter().map(server).collect()
}

/// Service that an outbox calls.
pub struct OutboxClient {
    call: ServiceCall,
    pairs: FieldPairs,
    descriptor: &'static Descriptor,
    /// Index of the input for responses among the bridge's inputs, and its fields.
    response: Option<(usize, FieldPairs)>,
    logged: Option<String>,
}

impl OutboxClient {
    /// Creates a client of a service; its input for responses is added to a list.
    ///
    /// # Errors
    /// When a port does not fit the service.
    pub fn new(composer: &Composer, call: &ServiceCall, list: &mut InputList) -> Result<Self, RosError> {
        let (property, pairs) = outbox(composer, call)?;
        let response = match &call.response {
            None => None,
            Some(input) => {
                let (property, pairs) = answer_input(composer, call, input)?;
                Some((list.add(input, property, (&call.service, call.service_type.name()), DEPTH), pairs))
            }
        };
        Ok(Self { call: call.clone(), pairs, descriptor: property.descriptor(), response, logged: None })
    }

    /// Sends the outbox's messages as requests, in sequence, until the end.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn run(mut self, node: &NodeContext, inbound: &InboundTopics, network: &Handle, ended: &AtomicBool) {
        let mut receiver: Option<Receiver> = None;
        while !ended.load(Ordering::Acquire) {
            if receiver.is_none() {
                receiver = self.receiver(&node.composer);
            }
            let Some(messages) = &mut receiver else {
                std::thread::sleep(POLL_PERIOD * 20);
                continue;
            };
            if messages.collect() == 0 {
                std::thread::sleep(POLL_PERIOD);
                continue;
            }
            let requests: Vec<_> =
                messages.messages().map(|own| json(self.descriptor, own.bytes(), own.items())).collect();
            for (place, value) in requests.iter().enumerate() {
                let answer = self.call(value, node, inbound, network);
                let (answer, failure) = match answer {
                    Ok(Ok(())) => (Answer::Done, None),
                    Ok(Err(reason)) => (Answer::Refused(UNSUCCESSFUL), reason),
                    Err(reason) => (Answer::Refused(ABANDONED), Some(reason)),
                };
                self.log_once(&node.composer, failure);
                messages.answer(place, answer);
            }
            messages.release();
        }
    }

    fn receiver(&self, composer: &Composer) -> Option<Receiver> {
        let (property, _) = composer.board().get(&self.call.outbox)?;
        match property.carrier() {
            Carrier::Mailbox(mailbox) => mailbox.receiver().ok(),
            _ => None,
        }
    }

    /// Sends a request and forwards its response.
    /// On a refusal, the server's reason, if it gives one.
    fn call(
        &self,
        value: &Json,
        node: &NodeContext,
        inbound: &InboundTopics,
        network: &Handle,
    ) -> Result<Result<(), Option<String>>, String> {
        let ServiceCall { service, service_type: of, timeout: longest, .. } = &self.call;
        let request = self.pairs.message(value);
        let call = async { timeout(*longest, call_service(node, service, of, &request)).await };
        let call =
            network.block_on(call).map_err(|_| format!("{service} has not answered within {longest:?}"))?;
        let response = match call? {
            Ok(response) => response,
            Err(reason) => return Ok(Err(Some(format!("{service} failed: {reason}")))),
        };
        if let Some((place, pairs)) = &self.response {
            inbound.push_json(*place, &pairs.value(&response, &Json::Null))?;
        }
        let is_refused = response.get("success").and_then(Json::as_bool) == Some(false);
        Ok(if is_refused { Err(None) } else { Ok(()) })
    }

    /// Logs a reason unless it was logged before.
    fn log_once(&mut self, composer: &Composer, reason: Option<String>) {
        if self.logged != reason
            && let Some(reason) = &reason
        {
            let text = format!("{SCHEME}: a message of /{} is not answered: {reason}", self.call.outbox);
            composer.log(Level::Warn, &text);
        }
        self.logged = reason;
    }
}

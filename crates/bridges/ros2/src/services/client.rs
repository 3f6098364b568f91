//! Clients of services: messages of outboxes as requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use slate_blackboard::Carrier;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::{ABANDONED, Answer, Receiver};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{FieldPairs, InboundTopics, ReaderWaker, RosError, ServiceCall, json, outbox};

use super::caller::ServiceCaller;
use crate::wire::NodeWire;

/// Period of the check for messages.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Refusal code of a message whose response says `success: false`.
const UNSUCCESSFUL: u16 = 1;

/// Service that an outbox calls.
pub struct ServiceClient {
    call: ServiceCall,
    pairs: FieldPairs,
    descriptor: &'static Descriptor,
    caller: ServiceCaller,
    /// Index of the input for responses among the bridge's inputs, and its fields.
    response: Option<(usize, FieldPairs)>,
    reported: Option<String>,
}

/// State that clients share.
pub struct CallContext {
    pub composer: Composer,
    pub inbound: Arc<InboundTopics>,
    pub ended: Arc<AtomicBool>,
}

impl ServiceClient {
    /// Opens a client of a service.
    /// `response` is the index of its input for responses, with the pairs of fields that convert them to its values.
    ///
    /// # Errors
    /// When the outbox does not fit the service, or the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
        composer: &Composer,
        call: &ServiceCall,
        response: Option<(usize, FieldPairs)>,
    ) -> Result<Self, RosError> {
        let (property, pairs) = outbox(composer, call)?;
        let caller = ServiceCaller::open(wire, &call.service, &call.service_type)?;
        let descriptor = property.descriptor();
        Ok(Self { call: call.clone(), pairs, descriptor, caller, response, reported: None })
    }

    /// Sends the outbox's messages as requests, in sequence, until the end.
    pub fn run(mut self, context: &CallContext) {
        let wake = Arc::new(Wake::new());
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&wake))));
        let mut receiver: Option<Receiver> = None;
        while !context.ended.load(Ordering::Acquire) {
            if receiver.is_none() {
                receiver = receiver_of(&context.composer, &self.call.outbox);
            }
            let Some(messages) = &mut receiver else {
                wake.wait_timeout(POLL_PERIOD * 20);
                continue;
            };
            if messages.collect() == 0 {
                wake.wait_timeout(POLL_PERIOD);
                continue;
            }
            let requests: Vec<_> =
                messages.messages().map(|own| json(self.descriptor, own.bytes(), own.items())).collect();
            for (place, value) in requests.iter().enumerate() {
                let answer = match self.call(value, context, &wake, &waker) {
                    Ok(answer) => {
                        self.reported = None;
                        answer
                    }
                    Err(reason) => {
                        self.report(&context.composer, reason);
                        Answer::Refused(ABANDONED)
                    }
                };
                messages.answer(place, answer);
            }
            messages.release();
        }
    }

    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    fn call(
        &self,
        value: &Json,
        context: &CallContext,
        wake: &Wake,
        waker: &Waker,
    ) -> Result<Answer, String> {
        let ServiceCall { service, timeout, .. } = &self.call;
        let began = Instant::now();
        let is_late = || began.elapsed() > *timeout || context.ended.load(Ordering::Acquire);
        while !self.caller.has_server() {
            if is_late() {
                return Err(format!("{service} has no server"));
            }
            wake.wait_timeout(POLL_PERIOD);
        }
        let request = self.caller.send(&self.pairs.message(value))?;
        loop {
            if let Some(response) = self.caller.take(request, waker)? {
                return self.forward(&response, context);
            }
            if is_late() {
                return Err(format!("{service} has not answered within {timeout:?}"));
            }
            wake.wait_timeout(POLL_PERIOD * 4);
        }
    }

    /// Forwards a response, and returns the outcome of the message.
    fn forward(&self, response: &Json, context: &CallContext) -> Result<Answer, String> {
        if let Some((place, pairs)) = &self.response {
            context.inbound.push_json(*place, &pairs.value(response, &Json::Null))?;
        }
        let is_refused = response.get("success").and_then(Json::as_bool) == Some(false);
        Ok(if is_refused { Answer::Refused(UNSUCCESSFUL) } else { Answer::Done })
    }

    /// Logs a reason unless it was logged before.
    fn report(&mut self, composer: &Composer, reason: String) {
        if self.reported.as_ref() != Some(&reason) {
            let ServiceCall { outbox, .. } = &self.call;
            composer.log(Level::Warn, &format!("ros2: a message of /{outbox} is not answered: {reason}"));
            self.reported = Some(reason);
        }
    }
}

/// Returns the receiver of an unlinked outbox; `None` while the outbox is missing.
pub fn receiver_of(composer: &Composer, outbox: &str) -> Option<Receiver> {
    let (property, _) = composer.board().get(outbox)?;
    match property.carrier() {
        Carrier::Mailbox(mailbox) => mailbox.receiver().ok(),
        _ => None,
    }
}

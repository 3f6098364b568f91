//! Clients of services: messages of outboxes as requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::{GUID, RTPSEntity, SampleIdentity, SequenceNumber, Timestamp, WriteOptionsBuilder};
use serde_json::Value as Json;
use slate_blackboard::Carrier;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::{ABANDONED, Answer, Receiver};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{FieldPairs, InboundTopics, ServiceCall, bytes, json, outbox};

use super::server::QUALITY;
use crate::inbound::ReaderWaker;
use crate::matches::{Matches, OwnEndpoint};
use crate::name::{reply_topic, request_topic, type_name};
use crate::participant::{RosParticipant, TopicReader, TopicWriter};
use crate::raw::RawMessage;
use slate_topics::RosError;

/// Period of the check for messages.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// The code that a message is refused with whose response says `success: false`.
const UNSUCCESSFUL: u16 = 1;

/// A service that an outbox calls.
pub struct ServiceClient {
    call: ServiceCall,
    pairs: FieldPairs,
    descriptor: &'static Descriptor,
    reader: TopicReader,
    writer: TopicWriter,
    /// Place of the input for responses among those that the bridge sets, and its fields.
    response: Option<(usize, FieldPairs)>,
    reported: Option<String>,
}

/// State that clients share.
pub struct CallContext {
    pub composer: Composer,
    pub matches: Arc<Matches>,
    pub inbound: Arc<InboundTopics>,
    pub ended: Arc<AtomicBool>,
}

impl ServiceClient {
    /// A client of a service; `response` is the place of its input for responses, and how they are values of it.
    ///
    /// # Errors
    /// When the outbox does not fit the service, or DDS refuses.
    pub fn open(
        participant: &RosParticipant,
        composer: &Composer,
        call: &ServiceCall,
        response: Option<(usize, FieldPairs)>,
    ) -> Result<Self, RosError> {
        let (property, pairs) = outbox(composer, call)?;
        let reader = participant.reader_at(reply_topic(&call.service), &call.of.response_name(), QUALITY)?;
        let writer = participant.writer_at(request_topic(&call.service), &call.of.request_name(), QUALITY)?;
        let descriptor = property.descriptor();
        Ok(Self { call: call.clone(), pairs, descriptor, reader, writer, response, reported: None })
    }

    /// Its reader and its writer.
    pub fn guids(&self) -> (GUID, GUID) {
        (self.reader.guid(), self.writer.guid())
    }

    /// GUID, topic and type of both, for matching.
    pub fn endpoints(&self) -> [(GUID, OwnEndpoint); 2] {
        let ServiceCall { service, of, .. } = &self.call;
        let endpoint = |topic: String, message: String, is_reader| OwnEndpoint {
            topic: service.clone(),
            wire: (topic, type_name(&message)),
            message: of.name().into(),
            is_reader,
        };
        let replies = endpoint(reply_topic(service), of.response_name(), true);
        let requests = endpoint(request_topic(service), of.request_name(), false);
        [(self.reader.guid(), replies), (self.writer.guid(), requests)]
    }

    /// Sends what the outbox has as requests, one after the other, until the end.
    pub fn run(mut self, context: &CallContext) {
        let wake = Arc::new(Wake::new());
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&wake))));
        let mut receiver: Option<Receiver> = None;
        while !context.ended.load(Ordering::Acquire) {
            if receiver.is_none() {
                receiver = self.receiver(&context.composer);
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

    fn receiver(&self, composer: &Composer) -> Option<Receiver> {
        let (property, _) = composer.board().get(&self.call.outbox)?;
        match property.carrier() {
            Carrier::Mailbox(mailbox) => mailbox.receiver().ok(),
            _ => None,
        }
    }

    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    fn call(
        &self,
        value: &Json,
        context: &CallContext,
        wake: &Wake,
        waker: &Waker,
    ) -> Result<Answer, String> {
        let ServiceCall { service, of, timeout, .. } = &self.call;
        let request = of.encode_request(&self.pairs.message(value))?;
        let began = Instant::now();
        let is_late = || began.elapsed() > *timeout || context.ended.load(Ordering::Acquire);
        while context.matches.count(self.writer.guid()) == 0 || context.matches.count(self.reader.guid()) == 0
        {
            if is_late() {
                return Err(format!("{service} has no server"));
            }
            wake.wait_timeout(POLL_PERIOD);
        }
        // Servers on Fast DDS wait until this reader can hear them.
        let own =
            SampleIdentity { writer_guid: self.reader.guid(), sequence_number: SequenceNumber::UNKNOWN };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(own)
            .build();
        let sent = self.writer.write_with_options(RawMessage(request), options);
        let sent = sent.map_err(|error| error.to_string())?;
        let is_mine = |related: &SampleIdentity| {
            related.sequence_number == sent.sequence_number
                && (related.writer_guid == self.reader.guid() || related.writer_guid == self.writer.guid())
        };
        loop {
            self.reader.drain_read_notifications();
            // Before it is looked: what comes after that wakes this thread.
            self.reader.set_waker(Some(waker.clone()));
            while let Some(change) = self.reader.try_take_one().map_err(|error| error.to_string())? {
                // Responses to other clients come here, too, and late ones to earlier requests.
                if change.related_sample_identity().as_ref().is_some_and(is_mine) {
                    return self.take(&change.into_value().0, context);
                }
            }
            if is_late() {
                return Err(format!("{service} has not answered within {timeout:?}"));
            }
            wake.wait_timeout(POLL_PERIOD * 4);
        }
    }

    /// Forwards a response, and returns the outcome of the message.
    fn take(&self, message: &[u8], context: &CallContext) -> Result<Answer, String> {
        let response = self.call.of.decode_response(message)?;
        if let Some((place, pairs)) = &self.response {
            let input = context.inbound.topics()[*place].input();
            let found = context.composer.board().get(input).map(|(property, _)| property);
            let shape = found.as_ref().and_then(|own| Some((own.descriptor(), own.channel()?.shape())));
            let (descriptor, shape) = shape.ok_or_else(|| format!("/{input} is no longer there"))?;
            let value = bytes(descriptor, shape, &pairs.value(&response, &Json::Null));
            context.inbound.push(*place, Ok(value.map_err(|reason| format!("/{input}: {reason}"))?));
        }
        let is_refused = response.get("success").and_then(Json::as_bool) == Some(false);
        Ok(if is_refused { Answer::Refused(UNSUCCESSFUL) } else { Answer::Done })
    }

    /// The same reason is logged once.
    fn report(&mut self, composer: &Composer, reason: String) {
        if self.reported.as_ref() != Some(&reason) {
            let ServiceCall { outbox, .. } = &self.call;
            composer.log(Level::Warn, &format!("ros2: a message of /{outbox} is not answered: {reason}"));
            self.reported = Some(reason);
        }
    }
}

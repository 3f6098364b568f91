//! Servers of services.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::{GUID, RTPSEntity, SampleIdentity, Timestamp, WriteOptionsBuilder};
use serde_json::Value as Json;
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{InboxHandler, ServiceType};

use crate::name::{reply_topic, request_topic, type_name};
use crate::participant::{RosParticipant, TopicReader, TopicWriter};
use slate_dds::TopicQuality;
use slate_dds::wire::RawMessage;
use slate_dds::wire::ReaderWaker;
use slate_dds::wire::{Matches, OwnEndpoint};
use slate_topics::RosError;

/// How long a thread sleeps when nothing comes.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// How long a response waits until its client can hear it.
const MATCH: Duration = Duration::from_secs(2);

/// Period of the check whether it can.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// The bit in the kind of an entity which readers have and writers don't (RTPS 2.5, 9.3.1.2).
const READER: u8 = 0x04;

/// Quality of service of services.
pub const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };

/// Answers requests.
pub trait ServiceHandler: Send + Sync {
    /// The response to a request of a service, which is given by its place among those of the handler.
    fn answer(&mut self, service: usize, request: &Json) -> Json;
}

impl ServiceHandler for InboxHandler {
    /// A service of ROS 2 always has a response, also one that can't report a failure.
    fn answer(&mut self, _: usize, request: &Json) -> Json {
        let (Ok(response) | Err((_, response))) = InboxHandler::answer(self, request);
        response
    }
}

/// A service that an agent offers.
pub struct ServiceServer {
    service: String,
    of: ServiceType,
    reader: TopicReader,
    writer: TopicWriter,
    reported: Option<String>,
}

impl ServiceServer {
    /// Offers a service.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn open(participant: &RosParticipant, service: &str, of: &ServiceType) -> Result<Self, RosError> {
        let reader = participant.reader_at(request_topic(service), of.request().name(), QUALITY)?;
        let writer = participant.writer_at(reply_topic(service), of.response().name(), QUALITY)?;
        Ok(Self { service: service.into(), of: of.clone(), reader, writer, reported: None })
    }

    /// GUID, topic and type of both, for matching.
    pub fn endpoints(&self) -> [(GUID, OwnEndpoint); 2] {
        let wire = |topic, message: &str| (topic, type_name(message));
        let (requests, replies) = (
            wire(request_topic(&self.service), self.of.request().name()),
            wire(reply_topic(&self.service), self.of.response().name()),
        );
        let endpoint = |wire, is_reader| OwnEndpoint {
            topic: self.service.clone(),
            wire,
            message: self.of.name().into(),
            is_reader,
            type_hash: None,
        };
        [(self.reader.guid(), endpoint(requests, true)), (self.writer.guid(), endpoint(replies, false))]
    }

    /// Takes the next request and its identity, if one has come or is invalid; otherwise it wakes the waker.
    pub fn take(&mut self, waker: &Waker, context: &ServeContext) -> Option<(SampleIdentity, Json)> {
        self.reader.drain_read_notifications();
        // Set before the check, so that a later request wakes this thread.
        self.reader.set_waker(Some(waker.clone()));
        loop {
            let change = match self.reader.try_take_one() {
                Ok(change) => change?,
                Err(error) => {
                    self.report(&context.composer, error.to_string());
                    continue;
                }
            };
            // Clients of Fast DDS name the reader of their response there; others none.
            let related = change.related_sample_identity().map(|related| related.writer_guid);
            let client = related.filter(|guid| *guid != GUID::GUID_UNKNOWN).unwrap_or(change.writer_guid);
            let identity = SampleIdentity { writer_guid: client, sequence_number: change.sequence_number };
            match self.of.request().decode(&change.into_value().0) {
                Ok(request) => return Some((identity, request)),
                Err(reason) => self.report(&context.composer, reason),
            }
        }
    }

    /// Responds to a request.
    pub fn reply(&mut self, identity: SampleIdentity, response: &Json, context: &ServeContext) {
        let message = self.of.response().encode(response);
        match message.and_then(|message| self.send(identity, message, context)) {
            Ok(()) => self.reported = None,
            Err(reason) => self.report(&context.composer, reason),
        }
    }

    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    fn send(&self, identity: SampleIdentity, message: Vec<u8>, context: &ServeContext) -> Result<(), String> {
        let client = identity.writer_guid;
        let is_reader = client.to_bytes()[15] & READER != 0;
        let began = Instant::now();
        // A response sent before the match is lost.
        while is_reader && !context.matches.has(self.writer.guid(), client) && !context.is_ended() {
            if began.elapsed() > MATCH {
                return Err("a client has sent a request, and does not listen for the response".into());
            }
            std::thread::sleep(POLL_PERIOD);
        }
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(identity)
            .build();
        let written = self.writer.write_with_options(RawMessage(message), options);
        written.map(drop).map_err(|error| error.to_string())
    }

    /// The same reason is logged once.
    fn report(&mut self, composer: &Composer, reason: String) {
        if self.reported.as_ref() != Some(&reason) {
            composer
                .log(Level::Warn, &format!("ros2: a request to {} is not answered: {reason}", self.service));
            self.reported = Some(reason);
        }
    }
}

/// Services that a thread answers, one request after the other.
pub struct ServiceGroup {
    pub name: &'static str,
    pub servers: Vec<ServiceServer>,
    pub handler: Box<dyn ServiceHandler>,
}

/// State that servers share.
pub struct ServeContext {
    pub composer: Composer,
    pub matches: Arc<Matches>,
    pub wake: Arc<Wake>,
    pub ended: Arc<AtomicBool>,
}

impl ServeContext {
    pub fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}

/// Waits until a rerun can repeat messages, as it sends them after the cycle in which they came.
pub fn wait_for_start(context: &ServeContext) {
    while !context.is_ended() && context.composer.is_lockstep() && context.composer.cycles() == 0 {
        context.wake.wait_timeout(POLL_PERIOD);
    }
}

/// Answers requests of services, one after the other, until the end.
pub fn serve(mut servers: Vec<ServiceServer>, mut handler: Box<dyn ServiceHandler>, context: &ServeContext) {
    let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&context.wake))));
    wait_for_start(context);
    while !context.is_ended() {
        let mut is_idle = true;
        for (place, server) in servers.iter_mut().enumerate() {
            if let Some((identity, request)) = server.take(&waker, context) {
                is_idle = false;
                server.reply(identity, &handler.answer(place, &request), context);
            }
        }
        if is_idle {
            context.wake.wait_timeout(IDLE_PERIOD);
        }
    }
}

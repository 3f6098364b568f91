//! Agent in a domain of DDS.

use std::net::{IpAddr, Ipv4Addr};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use futures_util::Stream;
use rustdds::dds::CreateResult;
use rustdds::no_key::SimpleDataReader;
use rustdds::with_key::{BareDataReaderStream, DataReader, Sample};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent,
    DomainParticipantStatusListener, GUID, Publisher, QosPolicies, QosPolicyBuilder, RTPSEntity, Subscriber,
    Topic, TopicKind,
};
use slate_topics::TopicSink;

use crate::error::DdsError;
use crate::message::DdsMessage;
use crate::quality::Representation;
use crate::topic_type::DdsTopic;
use crate::wire::{DiscoveryProbe, Matches, RawAdapter, RawMessage, policies};

/// Messages of all instances of a topic that wait at least.
const WAITING: i32 = 256;

/// Participant of DDS.
pub struct DdsParticipant {
    domain: u16,
    participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    status: DomainParticipantStatusListener,
    probe: DiscoveryProbe,
}

impl DdsParticipant {
    /// Joins a domain: on this machine, and on others if they are trusted.
    ///
    /// # Errors
    /// DDS refuses.
    pub fn join(domain: u16, trusted: bool) -> Result<Self, DdsError> {
        let refused = |error: &dyn std::fmt::Display| DdsError::Network { domain, reason: error.to_string() };
        let mut builder = DomainParticipantBuilder::new(domain);
        if !trusted {
            builder = builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
        }
        let participant = builder.build().map_err(|error| refused(&error))?;
        let any = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&any).map_err(|error| refused(&error))?;
        let subscriber = participant.create_subscriber(&any).map_err(|error| refused(&error))?;
        let status = participant.status_listener();
        let probe = DiscoveryProbe::start(&participant).map_err(|error| refused(&error))?;
        Ok(Self { domain, participant, publisher, subscriber, status, probe })
    }

    /// Reads a topic.
    ///
    /// # Errors
    /// DDS refuses.
    pub fn reader(
        &self,
        name: &str,
        message: &DdsMessage,
        options: &DdsTopic,
    ) -> Result<DdsReader, DdsError> {
        let depth = if message.has_key() {
            WAITING.max(options.quality.depth.into())
        } else {
            options.quality.depth.into()
        };
        let policies = policies(options.quality, depth, message.readable());
        self.topic(name, message, &policies)
            .and_then(|topic| self.reader_of(&topic, policies))
            .map_err(|error| DdsError::Network { domain: self.domain, reason: error.to_string() })
    }

    fn reader_of(&self, topic: &Topic, policies: QosPolicies) -> CreateResult<DdsReader> {
        if topic.kind() == TopicKind::NoKey {
            let reader = self.subscriber.create_simple_datareader_no_key(topic, Some(policies))?;
            return Ok(DdsReader::NoKey(Box::new(reader)));
        }
        let reader: DataReader<RawMessage, RawAdapter<1>> =
            self.subscriber.create_datareader(topic, Some(policies))?;
        Ok(DdsReader::WithKey(reader.guid(), Box::new(reader.async_bare_sample_stream())))
    }

    /// Writes a topic.
    ///
    /// # Errors
    /// DDS refuses.
    pub fn writer(
        &self,
        name: &str,
        message: &DdsMessage,
        options: &DdsTopic,
        matches: &Arc<Matches>,
    ) -> Result<DdsSink, DdsError> {
        let written = if message.identifier() == 1 { Representation::Xcdr1 } else { Representation::Xcdr2 };
        let policies = policies(options.quality, options.quality.depth.into(), &[written]);
        let writer = self.topic(name, message, &policies).and_then(|topic| match message.identifier() {
            9 => self.writer_of::<9>(&topic, policies),
            7 => self.writer_of::<7>(&topic, policies),
            _ => self.writer_of::<1>(&topic, policies),
        });
        let (guid, write) =
            writer.map_err(|error| DdsError::Network { domain: self.domain, reason: error.to_string() })?;
        let is_transient_local = options.quality.transient_local;
        Ok(DdsSink { guid, write, is_transient_local, matches: Arc::clone(matches) })
    }

    fn writer_of<const ENCODING: u8>(
        &self,
        topic: &Topic,
        policies: QosPolicies,
    ) -> CreateResult<(GUID, WriteMessage)> {
        if topic.kind() == TopicKind::NoKey {
            let writer = self
                .publisher
                .create_datawriter_no_key::<RawMessage, RawAdapter<ENCODING>>(topic, Some(policies))?;
            let guid = writer.guid();
            let write = move |message| writer.write(message, None).map_err(|error| error.to_string());
            return Ok((guid, Box::new(write)));
        }
        let writer =
            self.publisher.create_datawriter::<RawMessage, RawAdapter<ENCODING>>(topic, Some(policies))?;
        let guid = writer.guid();
        Ok((guid, Box::new(move |message| writer.write(message, None).map_err(|error| error.to_string()))))
    }

    fn topic(&self, name: &str, message: &DdsMessage, policies: &QosPolicies) -> CreateResult<Topic> {
        let kind = if message.has_key() { TopicKind::WithKey } else { TopicKind::NoKey };
        self.participant.create_topic(name.into(), message.type_name().into(), policies, kind)
    }

    /// Returns the next event of the domain, if any.
    pub fn next_status(&self) -> Option<DomainParticipantStatusEvent> {
        self.probe.next_event(&self.status)
    }
}

/// Sends a message.
type WriteMessage = Box<dyn Fn(RawMessage) -> Result<(), String> + Send + Sync>;

/// Writer of a topic.
pub struct DdsSink {
    guid: GUID,
    write: WriteMessage,
    /// Transient-local durability: later readers receive values, too.
    is_transient_local: bool,
    matches: Arc<Matches>,
}

impl DdsSink {
    pub fn guid(&self) -> GUID {
        self.guid
    }
}

impl TopicSink for DdsSink {
    fn is_wanted(&self) -> bool {
        self.is_transient_local || self.matches.count(self.guid) > 0
    }

    fn send(&self, message: Vec<u8>) -> Result<(), String> {
        (self.write)(RawMessage(message))
    }
}

/// Reader of a topic, without a key or with one.
pub enum DdsReader {
    NoKey(Box<SimpleDataReader<RawMessage, RawAdapter<1>>>),
    WithKey(GUID, Box<BareDataReaderStream<RawMessage, RawAdapter<1>>>),
}

impl DdsReader {
    pub fn guid(&self) -> GUID {
        match self {
            Self::NoKey(reader) => reader.guid(),
            Self::WithKey(guid, _) => *guid,
        }
    }

    /// Registers `waker` for new data; then [`take`](DdsReader::take) must be called.
    pub fn watch(&self, waker: &Waker) {
        if let Self::NoKey(reader) = self {
            reader.drain_read_notifications();
            reader.set_waker(Some(waker.clone()));
        }
    }

    /// Returns the next message, if any.
    pub fn take(&mut self, waker: &Waker) -> Option<Result<Vec<u8>, String>> {
        match self {
            Self::NoKey(reader) => match reader.try_take_one() {
                Ok(change) => change.map(|change| Ok(change.into_value().0)),
                Err(error) => Some(Err(error.to_string())),
            },
            Self::WithKey(_, stream) => loop {
                match Pin::new(&mut **stream).poll_next(&mut Context::from_waker(waker)) {
                    Poll::Ready(Some(Ok(Sample::Value(message)))) => return Some(Ok(message.0)),
                    // An instance has gone; the input keeps its last value.
                    Poll::Ready(Some(Ok(Sample::Dispose(())))) => {}
                    Poll::Ready(Some(Err(error))) => return Some(Err(error.to_string())),
                    Poll::Ready(None) | Poll::Pending => return None,
                }
            },
        }
    }
}

//! Wire of DDS: a participant of RustDDS.

mod explorer;
mod graph;
mod participant;
mod services;
mod topics;

use std::sync::{Arc, Mutex, PoisonError};

use rustdds::{GUID, RTPSEntity};
use slate_dds::TopicQuality;
use slate_dds::wire::{MatchWords, Matches, OwnEndpoint};
use slate_runtime::Composer;
use slate_sorted::SortedMap;
use slate_topics::{RosError, ServiceType};

use super::{NodeWire, RequestReader, RequestWriter, TopicReader, TopicWriter, WireType};
use crate::name::{message_name, reply_topic, request_topic, type_name, wire_topic};
use crate::settings::{RosSettings, TABLE};
pub use explorer::DdsView;
use participant::RosParticipant;
use services::{DdsCaller, DdsServer};
use topics::{DdsTopicReader, DdsTopicWriter};

/// ROS calls both ends so.
const WORDS: MatchWords = MatchWords {
    scheme: TABLE,
    roles: ["publisher", "subscription"],
    message_name,
    help: "use another topic or interface",
};

/// Quality of service of services.
const SERVICE: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };

/// Node in a domain of DDS.
pub struct DdsWire {
    participant: RosParticipant,
    matches: Arc<Matches>,
    /// Endpoints, until the node is announced.
    own: Mutex<SortedMap<GUID, OwnEndpoint>>,
}

impl DdsWire {
    /// Joins the domain of settings.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn open(settings: &RosSettings) -> Result<Self, RosError> {
        let participant = RosParticipant::open(settings)?;
        Ok(Self { participant, matches: Arc::new(Matches::new(WORDS)), own: Mutex::default() })
    }

    fn note(&self, guid: GUID, endpoint: OwnEndpoint) {
        self.own.lock().unwrap_or_else(PoisonError::into_inner).insert(guid, endpoint);
    }

    fn note_topic(&self, guid: GUID, topic: &str, of: &WireType, is_reader: bool) {
        let wire = (wire_topic(topic), type_name(&of.name));
        let (topic, message, type_hash) = (topic.into(), of.name.clone(), of.hash.clone());
        self.note(guid, OwnEndpoint { topic, wire, message, is_reader, type_hash });
    }

    fn note_service(
        &self,
        guid: GUID,
        (service, of): (&str, &ServiceType),
        (topic, message): (String, &str),
        is_reader: bool,
    ) {
        let wire = (topic, type_name(message));
        let (topic, message) = (service.into(), of.name().into());
        self.note(guid, OwnEndpoint { topic, wire, message, is_reader, type_hash: None });
    }
}

impl NodeWire for DdsWire {
    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError> {
        let reader = self.participant.reader(topic, &of.name, quality)?;
        self.note_topic(reader.guid(), topic, of, true);
        Ok(Arc::new(DdsTopicReader { reader, matches: Arc::clone(&self.matches) }))
    }

    fn writer(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicWriter>, RosError> {
        let writer = self.participant.writer(topic, &of.name, quality)?;
        self.note_topic(writer.guid(), topic, of, false);
        Ok(Arc::new(DdsTopicWriter { writer, matches: Arc::clone(&self.matches) }))
    }

    fn server(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestReader>, RosError> {
        let requests = (request_topic(service), of.request().name());
        let replies = (reply_topic(service), of.response().name());
        let reader = self.participant.reader_at(requests.0.clone(), requests.1, SERVICE)?;
        let writer = self.participant.writer_at(replies.0.clone(), replies.1, SERVICE)?;
        self.note_service(reader.guid(), (service, of), requests, true);
        self.note_service(writer.guid(), (service, of), replies, false);
        Ok(Box::new(DdsServer::new(reader, writer, &self.matches)))
    }

    fn caller(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestWriter>, RosError> {
        let requests = (request_topic(service), of.request().name());
        let replies = (reply_topic(service), of.response().name());
        let reader = self.participant.reader_at(replies.0.clone(), replies.1, SERVICE)?;
        let writer = self.participant.writer_at(requests.0.clone(), requests.1, SERVICE)?;
        self.note_service(reader.guid(), (service, of), replies, true);
        self.note_service(writer.guid(), (service, of), requests, false);
        Ok(Box::new(DdsCaller::new(reader, writer, &self.matches)))
    }

    fn announce(&self) -> Result<(), RosError> {
        let own = std::mem::take(&mut *self.own.lock().unwrap_or_else(PoisonError::into_inner));
        let side = |is_reader: bool| {
            let own = own.iter().filter(move |(_, own)| own.is_reader == is_reader);
            own.map(|(guid, _)| *guid).collect::<Vec<_>>()
        };
        let (readers, writers) = (side(true), side(false));
        self.matches.set_own(own);
        self.participant.announce(&readers, &writers)
    }

    fn check_matches(&self, composer: &Composer) {
        while let Some(event) = self.participant.next_status() {
            self.matches.note(&event, composer);
        }
    }

    fn identity(&self) -> [u8; 12] {
        let mut prefix = [0; 12];
        prefix.copy_from_slice(&self.participant.guid().to_bytes()[..12]);
        prefix
    }
}

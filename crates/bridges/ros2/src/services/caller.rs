//! The client's end of a service.

use std::task::Waker;

use rustdds::{GUID, RTPSEntity, SampleIdentity, SequenceNumber, Timestamp, WriteOptionsBuilder};
use serde_json::Value as Json;
use slate_topics::{RosError, ServiceType};

use super::server::QUALITY;
use crate::name::{reply_topic, request_topic, type_name};
use crate::participant::{RosParticipant, TopicReader, TopicWriter};
use slate_dds::wire::RawMessage;
use slate_dds::wire::{Matches, OwnEndpoint};

/// Sends requests of a service, and takes their responses.
pub struct ServiceCaller {
    service: String,
    of: ServiceType,
    reader: TopicReader,
    writer: TopicWriter,
}

impl ServiceCaller {
    /// A client of a service.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn open(participant: &RosParticipant, service: &str, of: &ServiceType) -> Result<Self, RosError> {
        let reader = participant.reader_at(reply_topic(service), of.response().name(), QUALITY)?;
        let writer = participant.writer_at(request_topic(service), of.request().name(), QUALITY)?;
        Ok(Self { service: service.into(), of: of.clone(), reader, writer })
    }

    /// GUID, topic and type of its reader and its writer.
    pub fn endpoints(&self) -> [(GUID, OwnEndpoint); 2] {
        let endpoint = |topic: String, message: &str, is_reader| OwnEndpoint {
            topic: self.service.clone(),
            wire: (topic, type_name(message)),
            message: self.of.name().into(),
            is_reader,
            type_hash: None,
        };
        let replies = endpoint(reply_topic(&self.service), self.of.response().name(), true);
        let requests = endpoint(request_topic(&self.service), self.of.request().name(), false);
        [(self.reader.guid(), replies), (self.writer.guid(), requests)]
    }

    /// Whether a server is there.
    pub fn has_server(&self, matches: &Matches) -> bool {
        matches.count(self.writer.guid()) > 0 && matches.count(self.reader.guid()) > 0
    }

    /// Sends a request; its number identifies the response.
    ///
    /// # Errors
    /// The request does not fit, or DDS refuses it; the reason in words.
    pub fn send(&self, request: &Json) -> Result<SequenceNumber, String> {
        let request = self.of.request().encode(request)?;
        // Servers on Fast DDS wait until this reader can hear them.
        let own =
            SampleIdentity { writer_guid: self.reader.guid(), sequence_number: SequenceNumber::UNKNOWN };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(own)
            .build();
        let sent = self.writer.write_with_options(RawMessage(request), options);
        sent.map(|sent| sent.sequence_number).map_err(|error| error.to_string())
    }

    /// Takes the response to a request, if it has come; otherwise it wakes the waker.
    ///
    /// # Errors
    /// The response is invalid; the reason in words.
    pub fn take(&self, request: SequenceNumber, waker: &Waker) -> Result<Option<Json>, String> {
        let is_mine = |related: SampleIdentity| {
            related.sequence_number == request
                && (related.writer_guid == self.reader.guid() || related.writer_guid == self.writer.guid())
        };
        self.reader.drain_read_notifications();
        // Set before the check, so that a later response wakes this thread.
        self.reader.set_waker(Some(waker.clone()));
        while let Some(change) = self.reader.try_take_one().map_err(|error| error.to_string())? {
            // Responses to other clients come here, too, and late ones to earlier requests.
            if change.related_sample_identity().is_some_and(is_mine) {
                return self.of.response().decode(&change.into_value().0).map(Some);
            }
        }
        Ok(None)
    }
}

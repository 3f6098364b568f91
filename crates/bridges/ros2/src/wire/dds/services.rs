//! Both ends of services on DDS.

use std::sync::Arc;
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::{GUID, RTPSEntity, SampleIdentity, SequenceNumber, Timestamp, WriteOptionsBuilder};
use slate_dds::wire::{Matches, RawMessage};

use super::participant::{RosDataReader, RosDataWriter};
use crate::wire::{RequestNumber, RequestReader, RequestWriter, Responder, ServiceRequest};

/// Time that a response waits until its client is matched.
const MATCH: Duration = Duration::from_secs(2);

/// Period of the check whether it can.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Bit of readers in the kind of an entity (RTPS 2.5, 9.3.1.2).
/// Writers don't have it.
const READER: u8 = 0x04;

/// Offered service.
pub struct DdsServer {
    reader: RosDataReader,
    replies: Arc<Replies>,
}

/// Writer of responses.
struct Replies {
    writer: RosDataWriter,
    matches: Arc<Matches>,
}

impl DdsServer {
    pub fn new(reader: RosDataReader, writer: RosDataWriter, matches: &Arc<Matches>) -> Self {
        Self { reader, replies: Arc::new(Replies { writer, matches: Arc::clone(matches) }) }
    }
}

impl RequestReader for DdsServer {
    fn set_waker(&self, waker: &Waker) {
        self.reader.drain_read_notifications();
        self.reader.set_waker(Some(waker.clone()));
    }

    fn take(&self) -> Result<Option<ServiceRequest>, String> {
        let Some(change) = self.reader.try_take_one().map_err(|error| error.to_string())? else {
            return Ok(None);
        };
        // Clients of Fast DDS name the reader of their response there; others none.
        let related = change.related_sample_identity().map(|related| related.writer_guid);
        let client = related.filter(|guid| *guid != GUID::GUID_UNKNOWN).unwrap_or(change.writer_guid);
        let identity = SampleIdentity { writer_guid: client, sequence_number: change.sequence_number };
        let responder = DdsResponder { identity, replies: Arc::clone(&self.replies) };
        Ok(Some(ServiceRequest { message: change.into_value().0, responder: Box::new(responder) }))
    }
}

/// Responder to the client of a request.
struct DdsResponder {
    identity: SampleIdentity,
    replies: Arc<Replies>,
}

impl Responder for DdsResponder {
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    fn reply(self: Box<Self>, message: Vec<u8>, is_ended: &dyn Fn() -> bool) -> Result<(), String> {
        let Replies { writer, matches } = &*self.replies;
        let client = self.identity.writer_guid;
        let is_reader = client.to_bytes()[15] & READER != 0;
        let began = Instant::now();
        // A response sent before the match is lost.
        while is_reader && !matches.has(writer.guid(), client) && !is_ended() {
            if began.elapsed() > MATCH {
                return Err("a client has sent a request, and does not listen for the response".into());
            }
            std::thread::sleep(POLL_PERIOD);
        }
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(self.identity)
            .build();
        let written = writer.write_with_options(RawMessage(message), options);
        written.map(drop).map_err(|error| error.to_string())
    }
}

/// Client of a service.
pub struct DdsCaller {
    reader: RosDataReader,
    writer: RosDataWriter,
    matches: Arc<Matches>,
}

impl DdsCaller {
    pub fn new(reader: RosDataReader, writer: RosDataWriter, matches: &Arc<Matches>) -> Self {
        Self { reader, writer, matches: Arc::clone(matches) }
    }
}

impl RequestWriter for DdsCaller {
    fn has_server(&self) -> bool {
        self.matches.count(self.writer.guid()) > 0 && self.matches.count(self.reader.guid()) > 0
    }

    fn send(&self, request: Vec<u8>) -> Result<RequestNumber, String> {
        // Servers on Fast DDS wait until this reader can hear them.
        let own =
            SampleIdentity { writer_guid: self.reader.guid(), sequence_number: SequenceNumber::UNKNOWN };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(own)
            .build();
        let sent = self.writer.write_with_options(RawMessage(request), options);
        sent.map(|sent| sent.sequence_number.into()).map_err(|error| error.to_string())
    }

    fn set_waker(&self, waker: &Waker) {
        self.reader.drain_read_notifications();
        self.reader.set_waker(Some(waker.clone()));
    }

    fn take(&self) -> Result<Option<(RequestNumber, Vec<u8>)>, String> {
        while let Some(change) = self.reader.try_take_one().map_err(|error| error.to_string())? {
            // Responses to other clients come here, too.
            if let Some(related) = change.related_sample_identity()
                && (related.writer_guid == self.reader.guid() || related.writer_guid == self.writer.guid())
            {
                return Ok(Some((related.sequence_number.into(), change.into_value().0)));
            }
        }
        Ok(None)
    }
}

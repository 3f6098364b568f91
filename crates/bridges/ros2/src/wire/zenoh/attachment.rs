//! Attachment of each message of `rmw_zenoh`.

use std::time::{SystemTime, UNIX_EPOCH};

/// Identity of an endpoint.
pub type Gid = [u8; 16];

/// Bytes of an attachment: two numbers, the length of an identity, and that.
const LENGTH: usize = 33;

/// Attachment of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageAttachment {
    /// Number of the message among those of its endpoint, from 1.
    pub sequence_number: i64,
    /// Time of sending, ns since 1970.
    pub source_timestamp: i64,
    /// Endpoint; in a response, that of the client.
    pub source: Gid,
}

impl MessageAttachment {
    /// Creates the attachment of a message that is sent now.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn now(sequence_number: i64, source: Gid) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let source_timestamp = i64::try_from(now.as_nanos()).unwrap_or(i64::MAX);
        Self { sequence_number, source_timestamp, source }
    }

    /// Encodes it as Zenoh's serializer does.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(LENGTH);
        bytes.extend(self.sequence_number.to_le_bytes());
        bytes.extend(self.source_timestamp.to_le_bytes());
        bytes.push(self.source.len() as u8);
        bytes.extend(self.source);
        bytes
    }

    /// Decodes an attachment; `None` if the bytes are not valid.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (sequence_number, bytes) = bytes.split_first_chunk()?;
        let (source_timestamp, bytes) = bytes.split_first_chunk()?;
        let (length, source) = bytes.split_first()?;
        let source: Gid = source.try_into().ok()?;
        (usize::from(*length) == source.len()).then_some(Self {
            sequence_number: i64::from_le_bytes(*sequence_number),
            source_timestamp: i64::from_le_bytes(*source_timestamp),
            source,
        })
    }
}

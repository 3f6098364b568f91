//! Stamp and schema of a value, which travel beside it.

use slate_blackboard::Stamp;

/// Stamp and schema of a published value: the attachment of its sample.
///
/// | bytes | content |
/// |---|---|
/// | 0 | layout, 1 |
/// | 1 to 8 | sequence: how many values the writer wrote, this one included |
/// | 9 to 16 | time of the write on the agent's clock, ns |
/// | 17 to 24 | generation: how many writers the property has had |
/// | 25 to 32 | hash of the interface's schema |
/// | 33 to 40 | number of the sample at its key, from 1; 0 for an answer. What is missing between two was lost; what is missing in the sequence beyond that was not sent, as options or a faster writer wanted it |
///
/// Numbers are unsigned and little-endian: `struct.unpack("<BQQQQQ", attachment)` in Python. Bytes beyond these belong to later
/// layouts that keep the first 41, and are ignored.
///
/// ```
/// use slate_blackboard::Stamp;
/// use slate_network::SampleAttachment;
///
/// let stamp = Stamp { sequence: 7, time: 1_000, generation: 1 };
/// let attachment = SampleAttachment { stamp, hash: 0xabc, number: 3 };
/// assert_eq!(SampleAttachment::decode(&attachment.encode()), Ok(attachment));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleAttachment {
    /// Sequence, time and generation of the write.
    pub stamp: Stamp,
    /// Hash of the interface's schema, as in recordings.
    pub hash: u64,
    /// Number of the sample at its key, from 1; 0 for an answer to a query.
    pub number: u64,
}

/// Reason why bytes are no [`SampleAttachment`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttachmentError {
    /// Too few bytes.
    #[error("the attachment has {0} bytes, expected at least {length}: layout, sequence, time, generation, schema hash, number", length = SampleAttachment::LENGTH)]
    Length(usize),
    /// Unknown layout.
    #[error("the attachment has layout {0}, expected {layout}: both ends need the same version of Slate", layout = SampleAttachment::LAYOUT)]
    Layout(u8),
}

impl SampleAttachment {
    /// Length, bytes.
    pub const LENGTH: usize = 41;

    /// Layout number, the first byte.
    pub const LAYOUT: u8 = 1;

    /// Encodes the attachment.
    pub fn encode(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [Self::LAYOUT; Self::LENGTH];
        let numbers = [self.stamp.sequence, self.stamp.time, self.stamp.generation, self.hash, self.number];
        for (place, number) in bytes[1..].chunks_exact_mut(8).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    /// Reads the bytes beside a value.
    ///
    /// # Errors
    /// When they are too few, or of another layout.
    pub fn decode(bytes: &[u8]) -> Result<Self, AttachmentError> {
        let whole = bytes.first_chunk::<{ Self::LENGTH }>().ok_or(AttachmentError::Length(bytes.len()))?;
        if whole[0] != Self::LAYOUT {
            return Err(AttachmentError::Layout(whole[0]));
        }
        let mut numbers = [0; 5];
        for (number, bytes) in numbers.iter_mut().zip(whole[1..].as_chunks::<8>().0) {
            *number = u64::from_le_bytes(*bytes);
        }
        let [sequence, time, generation, hash, number] = numbers;
        Ok(Self { stamp: Stamp { sequence, time, generation }, hash, number })
    }
}

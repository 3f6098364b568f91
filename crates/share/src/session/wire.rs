//! Wire format: packets of frames, and the messages in the control stream.
//!
//! A packet is a head of fixed size and frames until its end. Whatever can't be read ends the packet, and is counted.
//! The first two bytes and the refusal are the same in every version, so that agents of different versions can say so.

use serde::{Deserialize, Serialize, Serializer};
use slate_blackboard::Stamp;

use super::Options;
use super::delivery::DeliveryStatus;

/// Version of the protocol; agents of different versions refuse each other.
pub const VERSION: u8 = 5;

/// First byte of a packet, which encodes the byte order.
/// Values travel in native byte order, so agents of different byte orders do not understand each other.
const MAGIC: u8 = if cfg!(target_endian = "little") { b'S' } else { b's' };

/// Marker of a refusal in words, in place of the version.
const REFUSAL: u8 = 0;

/// Size of the head of a packet, bytes.
pub(super) const HEAD_SIZE: usize = 18;

/// Largest size of a fragment without its content, bytes.
pub(super) const MAX_FRAGMENT_HEAD_SIZE: usize = 40;

/// Head of a packet: tokens of sender and receiver.
/// Both change with each attempt to connect, so late packets of an old connection never count as part of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PacketHead {
    pub from: u64,
    /// Token of the receiver; 0 if the sender does not know it.
    pub to: u64,
}

/// Parsed packet.
#[derive(Debug)]
pub(super) enum Packet<'a> {
    Frames(PacketHead, &'a [u8]),
    Refusal(&'a str),
    OtherVersion(u8),
    Malformed,
}

impl PacketHead {
    /// Starts a packet with this head.
    pub fn begin(self, packet: &mut Vec<u8>) {
        packet.clear();
        packet.extend([MAGIC, VERSION]);
        packet.extend(self.from.to_le_bytes());
        packet.extend(self.to.to_le_bytes());
    }
}

/// Encodes a refusal with its reason, for agents of any version.
pub fn refusal(reason: &str) -> Vec<u8> {
    let mut packet = vec![MAGIC, REFUSAL];
    packet.extend(reason.as_bytes());
    packet
}

fn read_u64(bytes: &[u8]) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[..8]);
    u64::from_le_bytes(number)
}

/// Parses the head of a packet.
pub(super) fn parse(packet: &[u8]) -> Packet<'_> {
    match packet {
        [MAGIC, REFUSAL, reason @ ..] => {
            std::str::from_utf8(reason).map_or(Packet::Malformed, Packet::Refusal)
        }
        [MAGIC, VERSION, rest @ ..] if rest.len() >= 16 => {
            Packet::Frames(PacketHead { from: read_u64(rest), to: read_u64(&rest[8..]) }, &rest[16..])
        }
        [MAGIC, version, ..] if *version != VERSION => Packet::OtherVersion(*version),
        _ => Packet::Malformed,
    }
}

/// Raw bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub(super) struct RawBytes<'a>(#[serde(borrow)] pub &'a [u8]);

impl Serialize for RawBytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum PacketFrame<'a> {
    #[serde(borrow)]
    Hello(Hello<'a>),
    Beat(Beat),
    #[serde(borrow)]
    Fragment(Fragment<'a>),
    Announcement(Announcement),
    StreamReport(StreamReport),
    #[serde(borrow)]
    Knowledge(KnowledgePiece<'a>),
}

/// Greeting with the sender's identity.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Hello<'a> {
    pub agent: &'a str,
    pub instance: u64,
    /// Number of the connection attempt of this instance.
    pub attempt: u64,
}

/// Heartbeat, which also yields the clock offset.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Beat {
    /// Time of sending by the sender's clock, ns.
    pub sent: u64,
    /// Last received heartbeat: its sending and its arrival.
    /// Each is a time of the observer's clock, ns.
    pub heard: Option<(u64, u64)>,
}

/// Fragment of a stream.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Fragment<'a> {
    /// Stream: 0 for the control stream, else the receiver's subscription.
    pub stream: u32,
    /// Number of the fragment in the stream, from 1.
    pub number: u64,
    /// Index of the fragment in its item.
    pub index: u32,
    /// Number of fragments of the item.
    pub count: u32,
    #[serde(borrow)]
    pub bytes: RawBytes<'a>,
}

/// Announcement of a stream's extent, for a receiver that may have missed it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Announcement {
    pub stream: u32,
    /// Oldest fragment that can be sent again.
    pub first: u64,
    /// Next fragment.
    pub next: u64,
    /// Number of the last value that was sent or skipped, at its origin.
    pub sequence: u64,
    /// Epoch of the offer that the value belongs to.
    pub epoch: u32,
}

/// Report of a receiver about a stream.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StreamReport {
    pub stream: u32,
    /// Number before which all fragments are received.
    pub next: u64,
    /// Ranges of missing fragments, both ends inclusive.
    pub missing: Vec<(u64, u64)>,
}

/// Piece of a message of the team's knowledge.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct KnowledgePiece<'a> {
    /// Number of the message.
    pub number: u32,
    /// Position in the message, bytes.
    pub at: u32,
    pub is_last: bool,
    #[serde(borrow)]
    pub bytes: RawBytes<'a>,
}

/// Message of the control stream.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum ControlMessage<'a> {
    Subscribe {
        id: u32,
        path: &'a str,
        options: Options,
        seen: Option<Seen>,
    },
    Unsubscribe {
        id: u32,
    },
    Accepted {
        id: u32,
        epoch: u32,
        #[serde(borrow)]
        offer: PortableOffer<'a>,
    },
    Begin {
        id: u32,
        epoch: u32,
    },
    Waiting {
        id: u32,
        reason: &'a str,
    },
    Refused {
        id: u32,
        reason: &'a str,
    },
    WriterLeft {
        id: u32,
        generation: u64,
    },
    Send {
        ticket: u64,
        path: &'a str,
        schema: u64,
        items: u64,
        #[serde(borrow)]
        bytes: RawBytes<'a>,
    },
    Answer {
        ticket: u64,
        answer: DeliveryStatus,
    },
    Ask {
        request: u32,
        pattern: &'a str,
        values: bool,
    },
    Part {
        request: u32,
        #[serde(borrow)]
        bytes: RawBytes<'a>,
        last: bool,
    },
    Unanswered {
        request: u32,
        reason: &'a str,
    },
}

/// Newest value that a subscriber has shown, from an earlier connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seen {
    /// Instance of the agent that wrote it.
    pub instance: u64,
    /// Generation of its writer.
    pub generation: u64,
    /// Number of the value.
    pub sequence: u64,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PortableOffer<'a> {
    pub path: &'a str,
    #[serde(borrow)]
    pub interface: RawBytes<'a>,
    pub doc: &'a str,
    pub part: &'a str,
    pub capacity: u64,
    pub depth: u32,
    pub after: u64,
}

/// Size of the head of a value in a stream, bytes.
pub(super) const SAMPLE_HEAD_SIZE: usize = 37;

/// Encoding of a value's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes as in memory.
    Plain,
    /// LZ4 of the bytes in memory.
    Lz4,
    /// Header of an image, and its pixels as JPEG.
    Jpeg,
    /// Reference to shared memory.
    Placed,
}

/// Head of a value in transfer, without its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Number, time and generation at the origin.
    pub stamp: Stamp,
    /// Number of tail items.
    pub items: u32,
    /// Length in memory, bytes.
    pub length: u32,
    /// Encoding of the content.
    pub encoding: Encoding,
}

impl Sample {
    pub(super) fn write(&self, epoch: u32, head: &mut [u8]) {
        head[..8].copy_from_slice(&self.stamp.generation.to_le_bytes());
        head[8..16].copy_from_slice(&self.stamp.sequence.to_le_bytes());
        head[16..24].copy_from_slice(&self.stamp.time.to_le_bytes());
        head[24..28].copy_from_slice(&self.items.to_le_bytes());
        head[28..32].copy_from_slice(&self.length.to_le_bytes());
        head[32] = self.encoding as u8;
        head[33..37].copy_from_slice(&epoch.to_le_bytes());
    }

    /// Parses a value; returns its head, the epoch of its offer, and its content.
    pub(super) fn read(item: &[u8]) -> Option<(Self, u32, &[u8])> {
        let (head, content) = item.split_at_checked(SAMPLE_HEAD_SIZE)?;
        let encoding = [Encoding::Plain, Encoding::Lz4, Encoding::Jpeg, Encoding::Placed];
        let sizes = read_u64(&head[24..32]);
        let sample = Self {
            stamp: Stamp {
                generation: read_u64(head),
                sequence: read_u64(&head[8..]),
                time: read_u64(&head[16..]),
            },
            items: sizes as u32,
            length: (sizes >> 32) as u32,
            encoding: *encoding.get(usize::from(head[32]))?,
        };
        let epoch = u32::from_le_bytes([head[33], head[34], head[35], head[36]]);
        Some((sample, epoch, content))
    }
}

/// Appends the encoding of a value by postcard.
pub(super) fn append(value: &impl Serialize, target: &mut Vec<u8>) {
    let begin = target.len();
    match postcard::to_extend(value, std::mem::take(target)) {
        Ok(written) => *target = written,
        // Only a sequence of unknown length can't be written; the message has none.
        Err(_) => target.truncate(begin),
    }
}

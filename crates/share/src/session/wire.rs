//! What goes over the wire: packets of frames, and the messages in the control stream.
//!
//! A packet is a head of fixed size and frames until its end. Whatever can't be read ends the packet, and is counted.
//! The first two bytes and the refusal are the same in every version, so that agents of different versions can say so.

use serde::{Deserialize, Serialize, Serializer};
use slate_blackboard::Stamp;

use super::Options;
use super::delivery::DeliveryStatus;

/// The protocol's version; agents of different versions refuse each other.
pub const VERSION: u8 = 5;

/// Values travel as they are in memory, so agents on machines of another byte order do not understand each other.
const MAGIC: u8 = if cfg!(target_endian = "little") { b'S' } else { b's' };

/// Stands in the place of the version when the rest is a refusal in words.
const REFUSAL: u8 = 0;

/// Bytes of a packet before its frames.
pub(super) const HEAD: usize = 18;

/// Most bytes that a fragment takes beside its content.
pub(super) const FRAGMENT_HEAD: usize = 40;

/// Who sent a packet, and to whom: both are new with each attempt to connect, so that what was under way when a
/// connection ended is never taken for a part of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PacketHead {
    pub from: u64,
    /// 0 when the sender has not heard of the receiver.
    pub to: u64,
}

/// What a packet turns out to be.
#[derive(Debug)]
pub(super) enum Packet<'a> {
    Frames(PacketHead, &'a [u8]),
    Refusal(&'a str),
    OtherVersion(u8),
    Malformed,
}

impl PacketHead {
    /// Begins a packet.
    pub fn begin(self, packet: &mut Vec<u8>) {
        packet.clear();
        packet.extend([MAGIC, VERSION]);
        packet.extend(self.from.to_le_bytes());
        packet.extend(self.to.to_le_bytes());
    }
}

/// Tells the other side in words why it is not served, whatever its version is.
pub fn refusal(reason: &str) -> Vec<u8> {
    let mut packet = vec![MAGIC, REFUSAL];
    packet.extend(reason.as_bytes());
    packet
}

fn number(bytes: &[u8]) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[..8]);
    u64::from_le_bytes(number)
}

/// Looks at the head of a packet.
pub(super) fn open(packet: &[u8]) -> Packet<'_> {
    match packet {
        [MAGIC, REFUSAL, reason @ ..] => {
            std::str::from_utf8(reason).map_or(Packet::Malformed, Packet::Refusal)
        }
        [MAGIC, VERSION, rest @ ..] if rest.len() >= 16 => {
            Packet::Frames(PacketHead { from: number(rest), to: number(&rest[8..]) }, &rest[16..])
        }
        [MAGIC, version, ..] if *version != VERSION => Packet::OtherVersion(*version),
        _ => Packet::Malformed,
    }
}

/// Bytes that are written and read as a whole.
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

/// Who is there.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Hello<'a> {
    pub agent: &'a str,
    pub instance: u64,
    /// Counts the connections that this instance has begun.
    pub attempt: u64,
}

/// A sign of life, from which the clocks' offset follows.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Beat {
    /// When it was sent, by the sender's clock.
    pub sent: u64,
    /// The last beat that the sender has got: when it was sent, and when it came, each by the clock of who saw it.
    pub heard: Option<(u64, u64)>,
}

/// A part of a stream.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Fragment<'a> {
    /// 0 is the control stream, others are the receiver's subscriptions.
    pub stream: u32,
    /// Counts the fragments of the stream from 1.
    pub number: u64,
    /// Which fragment of its item it is.
    pub index: u32,
    /// How many fragments the item has.
    pub count: u32,
    #[serde(borrow)]
    pub bytes: RawBytes<'a>,
}

/// What there is of a stream, for a receiver that may have missed it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Announcement {
    pub stream: u32,
    /// The oldest fragment that can be had again.
    pub first: u64,
    /// The fragment that comes next.
    pub next: u64,
    /// The origin's number of the last value that went into the stream, or went by.
    pub sequence: u64,
    /// Which offer of the subscription that value belongs to.
    pub epoch: u32,
}

/// What a receiver has of a stream.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StreamReport {
    pub stream: u32,
    /// It has all fragments before this one.
    pub next: u64,
    /// What it lacks beyond: from one number to another, both included.
    pub missing: Vec<(u64, u64)>,
}

/// A piece of a message of the team's knowledge.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct KnowledgePiece<'a> {
    /// Counts the messages.
    pub number: u32,
    /// Where in the message it belongs, bytes.
    pub at: u32,
    pub is_last: bool,
    #[serde(borrow)]
    pub bytes: RawBytes<'a>,
}

/// A message in the control stream.
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

/// The newest value that a subscriber has shown, from an earlier connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seen {
    /// Which instance of the agent it came from.
    pub instance: u64,
    /// The generation of its writer.
    pub generation: u64,
    /// Its number.
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

/// Bytes before the content of a value in a stream.
pub(super) const SAMPLE_HEAD: usize = 37;

/// How the content of a value is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As it is in memory.
    Plain,
    /// LZ4 of what is in memory.
    Lz4,
    /// What stands before an image's pixels, and the pixels as JPEG.
    Jpeg,
    /// In memory that both agents see; the content says where.
    Placed,
}

/// A value on its way, without its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// The origin's number, time and generation.
    pub stamp: Stamp,
    /// How many items its tail has.
    pub items: u32,
    /// How many bytes it takes in memory.
    pub length: u32,
    /// How the content is written.
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

    /// The head of a value with the offer that it belongs to, and its content.
    pub(super) fn read(item: &[u8]) -> Option<(Self, u32, &[u8])> {
        let (head, content) = item.split_at_checked(SAMPLE_HEAD)?;
        let encoding = [Encoding::Plain, Encoding::Lz4, Encoding::Jpeg, Encoding::Placed];
        let sizes = number(&head[24..32]);
        let sample = Self {
            stamp: Stamp {
                generation: number(head),
                sequence: number(&head[8..]),
                time: number(&head[16..]),
            },
            items: sizes as u32,
            length: (sizes >> 32) as u32,
            encoding: *encoding.get(usize::from(head[32]))?,
        };
        let epoch = u32::from_le_bytes([head[33], head[34], head[35], head[36]]);
        Some((sample, epoch, content))
    }
}

/// Appends what can be read again by postcard.
pub(super) fn append(value: &impl Serialize, target: &mut Vec<u8>) {
    let begin = target.len();
    match postcard::to_extend(value, std::mem::take(target)) {
        Ok(written) => *target = written,
        // Only a sequence of unknown length can't be written, and there is none in what is above.
        Err(_) => target.truncate(begin),
    }
}

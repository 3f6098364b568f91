//! The memory in which one thread hands values over: a ring of bytes, in which each value stands behind a head.

use rtrb::{Consumer, Producer, RingBuffer};

/// What stands before a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    /// Which property.
    pub id: u32,
    /// Items of its tail.
    pub items: u32,
    pub length: u32,
    pub sequence: u64,
    pub time: u64,
}

/// Bytes of a head.
pub(super) const HEAD: usize = 28;

impl Head {
    pub fn to_bytes(self) -> [u8; HEAD] {
        let mut bytes = [0; HEAD];
        bytes[..4].copy_from_slice(&self.id.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.items.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.length.to_le_bytes());
        bytes[12..20].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[20..].copy_from_slice(&self.time.to_le_bytes());
        bytes
    }

    pub fn from_bytes(bytes: &[u8; HEAD]) -> Self {
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        Self { id: word(0), items: word(4), length: word(8), sequence: long(12), time: long(20) }
    }
}

/// A ring of so many bytes.
pub(super) fn ring(capacity: usize) -> (Inlet, Outlet) {
    let (producer, consumer) = RingBuffer::new(capacity);
    (Inlet { producer }, Outlet { consumer, head: None })
}

/// A ring of so many bytes whose memory is there, so that the first values in it cost no more than those after.
pub(super) fn warm_ring(capacity: usize) -> (Inlet, Outlet) {
    let (mut producer, mut consumer) = RingBuffer::new(capacity);
    for place in (0..capacity).step_by(PAGE) {
        // There is room, as it is empty and has as many places.
        let _ = producer.push_entire_slice(&[0; PAGE][..PAGE.min(capacity - place)]);
    }
    while let Some(waiting) = Some(consumer.slots()).filter(|waiting| *waiting > 0) {
        let _ = consumer.pop_entire_slice(&mut [0; PAGE][..PAGE.min(waiting)]);
    }
    (Inlet { producer }, Outlet { consumer, head: None })
}

/// Values are small that have no more bytes than this, with their head.
const SMALL: usize = 256;

/// Bytes of a page of memory.
const PAGE: usize = 4096;

/// The end of a thread that writes values.
pub(super) struct Inlet {
    producer: Producer<u8>,
}

impl Inlet {
    /// How many bytes it can hold.
    pub fn capacity(&self) -> usize {
        self.producer.buffer().capacity()
    }

    /// Whether nobody takes values out of it any more.
    pub fn is_abandoned(&self) -> bool {
        self.producer.is_abandoned()
    }

    /// Puts a value in two parts in, if there is room.
    #[inline]
    pub fn push(&mut self, head: Head, first: &[u8], bytes: &[u8]) -> bool {
        let needed = HEAD + first.len() + bytes.len();
        // The first look costs nothing.
        if self.producer.cached_slots() < needed && self.producer.slots() < needed {
            return false;
        }
        let mut whole = [0; SMALL];
        if let Some(value) = whole.get_mut(..needed) {
            // At once: the ring is looked at and moved on once, and not three times.
            let (own, rest) = value.split_at_mut(HEAD);
            let (one, other) = rest.split_at_mut(first.len());
            own.copy_from_slice(&head.to_bytes());
            one.copy_from_slice(first);
            other.copy_from_slice(bytes);
            return self.producer.push_entire_slice(value).is_ok();
        }
        let head = self.producer.push_entire_slice(&head.to_bytes());
        let first = head.and_then(|()| self.producer.push_entire_slice(first));
        first.and_then(|()| self.producer.push_entire_slice(bytes)).is_ok()
    }
}

/// The end of the recorder's thread.
pub(super) struct Outlet {
    consumer: Consumer<u8>,
    /// That of a value which was not there as a whole.
    head: Option<Head>,
}

impl Outlet {
    /// Bytes that wait.
    pub fn waiting(&self) -> usize {
        self.consumer.slots()
    }

    /// Whether nobody puts values in any more.
    pub fn is_abandoned(&self) -> bool {
        self.consumer.is_abandoned()
    }

    /// Takes the next value out, into `bytes`.
    pub fn pop(&mut self, bytes: &mut Vec<u8>) -> Option<Head> {
        let head = match self.head {
            Some(head) => head,
            None => {
                let mut own = [0; HEAD];
                self.consumer.pop_entire_slice(&mut own).ok()?;
                *self.head.insert(Head::from_bytes(&own))
            }
        };
        let length = head.length as usize;
        if self.consumer.slots() < length {
            return None;
        }
        // Never more than the ring has.
        bytes.resize(length, 0);
        self.consumer.pop_entire_slice(bytes).ok()?;
        self.head = None;
        Some(head)
    }
}

//! Ring in which one thread hands values over to the recorder.

use rtrb::{Consumer, Producer, RingBuffer};

/// Header of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ValueHead {
    /// Number of the property's channel.
    pub id: u32,
    /// Items of its tail.
    pub items: u32,
    pub length: u32,
    pub sequence: u64,
    pub time: u64,
}

/// Bytes of a head.
pub(super) const HEAD_SIZE: usize = 28;

impl ValueHead {
    pub fn to_bytes(self) -> [u8; HEAD_SIZE] {
        let mut bytes = [0; HEAD_SIZE];
        bytes[..4].copy_from_slice(&self.id.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.items.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.length.to_le_bytes());
        bytes[12..20].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[20..].copy_from_slice(&self.time.to_le_bytes());
        bytes
    }

    pub fn from_bytes(bytes: &[u8; HEAD_SIZE]) -> Self {
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        Self { id: word(0), items: word(4), length: word(8), sequence: long(12), time: long(20) }
    }
}

/// A value in one cache line, which a thread writes without looking back at it.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct RingLine {
    time: u64,
    sequence: u64,
    id: u32,
    items: u16,
    /// Bytes of the value, or [`EXTERNAL_LENGTH`].
    length: u16,
    /// Bytes of a small value.
    /// For a larger value, its number of items and its length; its bytes are in the ring of bytes.
    words: [u64; LINE_WORDS],
}

/// Number of words of most values of a robot.
/// Examples are a velocity, a pose with its time, the timing of a module.
const LINE_WORDS: usize = 5;

/// Length mark of a value whose bytes are in the ring of bytes.
const EXTERNAL_LENGTH: u16 = u16::MAX;

/// Maximum number of values taken out at once.
const BATCH_SIZE: usize = 256;

/// Creates the ring of one thread.
/// It has a line for each value, and beside the lines a ring of `capacity` bytes for larger values.
pub(super) fn ring(capacity: usize) -> (Inlet, Outlet) {
    let (lines, lines_out) = RingBuffer::new(lines(capacity));
    let (bytes, bytes_out) = RingBuffer::new(capacity);
    (Inlet { lines, bytes }, Outlet { lines: lines_out, bytes: bytes_out })
}

/// Returns the number of lines that take the same memory.
fn lines(capacity: usize) -> usize {
    (capacity / size_of::<RingLine>()).max(1)
}

/// Creates a ring of `capacity` bytes with resident memory.
/// The first values in it therefore cost no more than later ones.
pub(super) fn warm_ring(capacity: usize) -> (Inlet, Outlet) {
    let (mut inlet, mut outlet) = ring(capacity);
    // It has room: it is empty and has as many slots.
    while inlet.lines.push(RingLine::EMPTY).is_ok() {}
    while outlet.lines.pop().is_ok() {}
    for place in (0..capacity).step_by(PAGE_SIZE) {
        let _ = inlet.bytes.push_entire_slice(&[0; PAGE_SIZE][..PAGE_SIZE.min(capacity - place)]);
    }
    while let Some(waiting) = Some(outlet.bytes.slots()).filter(|waiting| *waiting > 0) {
        let _ = outlet.bytes.pop_entire_slice(&mut [0; PAGE_SIZE][..PAGE_SIZE.min(waiting)]);
    }
    (inlet, outlet)
}

/// Bytes of a page of memory.
const PAGE_SIZE: usize = 4096;

impl RingLine {
    const EMPTY: Self = Self { time: 0, sequence: 0, id: 0, items: 0, length: 0, words: [0; LINE_WORDS] };

    /// Creates the line of a small value; `None` if it is too large.
    #[inline]
    fn small<const PARTS: usize>(head: ValueHead, parts: [&[u8]; PARTS]) -> Option<Self> {
        let (items, length) = (u16::try_from(head.items).ok()?, head.length as u16);
        let words = match parts[..] {
            [bytes] => words(bytes)?,
            _ => {
                let mut whole = [0; LINE_WORDS * size_of::<u64>()];
                let mut rest = whole.as_mut_slice();
                for part in parts {
                    let (own, behind) = rest.split_at_mut_checked(part.len())?;
                    own.copy_from_slice(part);
                    rest = behind;
                }
                words(&whole)?
            }
        };
        Some(Self { items, length, words, ..Self::of(head) })
    }

    /// Creates the line of a value whose bytes are in the ring of bytes.
    fn large(head: ValueHead) -> Self {
        let mut words = [0; LINE_WORDS];
        words[0] = u64::from(head.length) | u64::from(head.items) << 32;
        Self { length: EXTERNAL_LENGTH, words, ..Self::of(head) }
    }

    fn of(ValueHead { time, sequence, id, .. }: ValueHead) -> Self {
        Self { time, sequence, id, ..Self::EMPTY }
    }

    fn head(&self) -> ValueHead {
        let Self { time, sequence, id, .. } = *self;
        let (items, length) = match self.length {
            EXTERNAL_LENGTH => ((self.words[0] >> 32) as u32, self.words[0] as u32),
            length => (self.items.into(), length.into()),
        };
        ValueHead { id, items, length, sequence, time }
    }
}

/// Returns up to `8 * LINE_WORDS` bytes as words; `None` for more.
/// Each word is read by itself: a copy made piece by piece and then read as a whole would have to wait until it is
/// written.
#[inline]
fn words(bytes: &[u8]) -> Option<[u64; LINE_WORDS]> {
    let word = |place: usize| match bytes.get(place * 8..) {
        Some(rest) => match rest.first_chunk() {
            Some(whole) => u64::from_le_bytes(*whole),
            None => partial(rest),
        },
        None => 0,
    };
    (bytes.len() <= LINE_WORDS * size_of::<u64>()).then(|| std::array::from_fn(word))
}

/// Returns the word of fewer than eight bytes.
fn partial(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte))
}

/// The end of a thread that writes values.
pub(super) struct Inlet {
    lines: Producer<RingLine>,
    bytes: Producer<u8>,
}

impl Inlet {
    /// Returns the capacity for large values, bytes, and the same for lines.
    pub fn capacity(&self) -> usize {
        self.bytes.buffer().capacity()
    }

    /// Returns true if the reader is gone.
    pub fn is_abandoned(&self) -> bool {
        self.lines.is_abandoned()
    }

    /// Puts in a value whose bytes come in parts, if there is room.
    #[inline]
    pub fn push<const PARTS: usize>(&mut self, head: ValueHead, parts: [&[u8]; PARTS]) -> bool {
        match RingLine::small(head, parts) {
            Some(line) => self.lines.push(line).is_ok(),
            None => self.push_large(head, &parts),
        }
    }

    /// Puts in a value that is too large for a line.
    /// Its bytes come first, so that the reader of the line finds them.
    fn push_large(&mut self, head: ValueHead, parts: &[&[u8]]) -> bool {
        if self.lines.is_full() || self.bytes.slots() < head.length as usize {
            return false;
        }
        // It has room, and no other thread writes to it.
        let all = parts.iter().all(|part| self.bytes.push_entire_slice(part).is_ok());
        all && self.lines.push(RingLine::large(head)).is_ok()
    }
}

/// The end of the recorder's thread.
pub(super) struct Outlet {
    lines: Consumer<RingLine>,
    bytes: Consumer<u8>,
}

impl Outlet {
    /// Values that wait.
    pub fn waiting(&self) -> usize {
        self.lines.slots()
    }

    /// Returns true if the writer is gone.
    pub fn is_abandoned(&self) -> bool {
        self.lines.is_abandoned()
    }

    /// Takes out at most `most` next values, through `bytes`; returns their number.
    /// Their places become free once all are taken: with single places, the cache lines of both ends would go to and
    /// fro with each value.
    pub fn take(
        &mut self,
        most: usize,
        bytes: &mut Vec<u8>,
        mut each: impl FnMut(ValueHead, &[u8]),
    ) -> usize {
        let count = self.lines.slots().min(most).min(BATCH_SIZE);
        let Ok(lines) = self.lines.read_chunk(count) else { return 0 };
        let (first, rest) = lines.as_slices();
        for line in first.iter().chain(rest) {
            let head = line.head();
            bytes.clear();
            if line.length == EXTERNAL_LENGTH {
                // They are there, as the writer puts them there before the line.
                bytes.resize(head.length as usize, 0);
                if self.bytes.pop_entire_slice(bytes).is_err() {
                    continue;
                }
            } else {
                line.words.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
                bytes.truncate(head.length as usize);
            }
            each(head, bytes);
        }
        lines.commit_all();
        count
    }
}

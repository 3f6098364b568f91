use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering, fence};

/// Number of words of an entry.
pub(super) const ENTRY_WORDS: usize = 4;

/// Ring of the last entries of one thread.
/// It never waits for readers, and they detect when it overtook them.
#[derive(Debug)]
pub(super) struct Ring {
    slots: Box<[Slot]>,
    /// Number of entries written.
    written: AtomicU64,
    /// True while it has a writer.
    has_writer: AtomicBool,
}

#[derive(Debug, Default)]
struct Slot {
    /// Number of its entry, from 1; 0 while it is written.
    number: AtomicU64,
    words: [AtomicU64; ENTRY_WORDS],
}

impl Ring {
    /// Returns a ring of at least one entry, with its writer.
    pub fn new(capacity: usize) -> Self {
        Self {
            slots: (0..capacity.max(1)).map(|_| Slot::default()).collect(),
            written: AtomicU64::new(0),
            has_writer: AtomicBool::new(true),
        }
    }

    /// Makes the caller its writer; false when it has one.
    pub fn claim_writer(&self) -> bool {
        !self.has_writer.swap(true, Ordering::Acquire)
    }

    /// Releases the writer's claim.
    pub fn release(&self) {
        self.has_writer.store(false, Ordering::Release);
    }

    /// Writes an entry. Only its writer calls this.
    #[inline]
    pub fn write(&self, words: [u64; ENTRY_WORDS]) {
        let written = self.written.load(Ordering::Relaxed);
        let slot = &self.slots[(written % self.slots.len() as u64) as usize];
        slot.number.store(0, Ordering::Relaxed);
        // A reader of a new word also sees that the entry is being written.
        fence(Ordering::Release);
        for (stored, word) in slot.words.iter().zip(words) {
            stored.store(word, Ordering::Relaxed);
        }
        slot.number.store(written + 1, Ordering::Release);
        self.written.store(written + 1, Ordering::Release);
    }

    /// Returns the number of entries written.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Acquire)
    }

    /// Passes the entries from number `from` on to `take`, oldest first.
    /// Numbers count from 0. Returns the range of examined numbers: those before it and those left out were
    /// overwritten.
    pub fn read(&self, from: u64, mut take: impl FnMut(u64, [u64; ENTRY_WORDS])) -> Range<u64> {
        let written = self.written();
        let first = from.max(written.saturating_sub(self.slots.len() as u64));
        for number in first..written {
            let slot = &self.slots[(number % self.slots.len() as u64) as usize];
            let before = slot.number.load(Ordering::Acquire);
            let words = slot.words.each_ref().map(|word| word.load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if before == number + 1 && slot.number.load(Ordering::Relaxed) == before {
                take(number, words);
            }
        }
        first..written
    }
}

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering, fence};

/// The words of an entry.
pub(super) const WORDS: usize = 4;

/// The last entries that one thread wrote. It never waits for readers, and they see when it overtook them.
#[derive(Debug)]
pub(super) struct Ring {
    slots: Box<[Slot]>,
    /// How many entries were written.
    written: AtomicU64,
    /// Whether somebody may write.
    has_writer: AtomicBool,
}

#[derive(Debug, Default)]
struct Slot {
    /// The number of the entry in it, from 1; 0 while it is written.
    number: AtomicU64,
    words: [AtomicU64; WORDS],
}

impl Ring {
    /// A ring of at least one entry, that has its writer.
    pub fn new(capacity: usize) -> Self {
        Self {
            slots: (0..capacity.max(1)).map(|_| Slot::default()).collect(),
            written: AtomicU64::new(0),
            has_writer: AtomicBool::new(true),
        }
    }

    /// Makes the caller its writer; false when it has one.
    pub fn take(&self) -> bool {
        !self.has_writer.swap(true, Ordering::Acquire)
    }

    /// The writer is gone.
    pub fn release(&self) {
        self.has_writer.store(false, Ordering::Release);
    }

    /// Writes an entry. Only its writer calls this.
    #[inline]
    pub fn write(&self, words: [u64; WORDS]) {
        let written = self.written.load(Ordering::Relaxed);
        let slot = &self.slots[(written % self.slots.len() as u64) as usize];
        slot.number.store(0, Ordering::Relaxed);
        // Whoever sees one of the new words also sees that the entry is being written.
        fence(Ordering::Release);
        for (place, word) in slot.words.iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        slot.number.store(written + 1, Ordering::Release);
        self.written.store(written + 1, Ordering::Release);
    }

    /// How many entries were written.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Acquire)
    }

    /// Hands over the entries that there are, from that number on (they are counted from 0), oldest first; which numbers
    /// it has looked at. Those before them and those that are left out were overwritten.
    pub fn read(&self, from: u64, mut take: impl FnMut(u64, [u64; WORDS])) -> Range<u64> {
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

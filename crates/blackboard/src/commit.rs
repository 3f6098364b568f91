//! Several properties of one writer as one snapshot.

use std::sync::Arc;

use crate::channel::Latest;
use crate::sync::{AtomicU64, Ordering, order};

/// Counts the commits of a writer: odd while one is in progress.
#[derive(Clone, Debug)]
pub struct CommitWord(Arc<AtomicU64>);

impl Default for CommitWord {
    fn default() -> Self {
        Self::new()
    }
}

impl CommitWord {
    /// Creates the word before the first commit.
    pub fn new() -> Self {
        Self(Arc::new(AtomicU64::new(0)))
    }

    /// Begins a commit, before the outputs of a tick are published.
    /// Only the writer calls it.
    #[inline]
    pub fn begin(&self) {
        // The next publication releases this store with it. A commit that never ended is followed by another.
        self.0.store((self.0.load(Ordering::Relaxed) + 1) | 1, Ordering::Relaxed);
    }

    /// Ends a commit, after the outputs of a tick were published.
    #[inline]
    pub fn end(&self) {
        self.0.store((self.0.load(Ordering::Relaxed) | 1) + 1, order::RELEASE);
    }
}

/// Outcome of pinning several values together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pin {
    /// The values are new, and belong together.
    Fresh,
    /// No new value was available.
    Unchanged,
    /// The writer was committing all the time; the previous snapshot is kept.
    Kept,
}

/// Pins the newest values of readers of one writer as one snapshot.
/// It tries `tries` times.
#[inline]
pub fn pin(word: &CommitWord, readers: &mut [Latest], tries: u32) -> Pin {
    pin_both(word, readers, &mut [], tries)
}

/// Pins as [`pin`], for readers in two slices.
#[inline]
pub fn pin_both(word: &CommitWord, first: &mut [Latest], second: &mut [Latest], tries: u32) -> Pin {
    for _ in 0..tries {
        let before = word.0.load(order::ACQUIRE);
        if before % 2 == 1 {
            std::hint::spin_loop();
            continue;
        }
        let mut has_update = false;
        for reader in first.iter_mut().chain(second.iter_mut()) {
            has_update |= reader.propose();
        }
        // A candidate of a later commit brings the store of `begin` with it, so this load sees it.
        if word.0.load(Ordering::Relaxed) == before || cfg!(feature = "mutant-commit") {
            for reader in first.iter_mut().chain(second.iter_mut()) {
                reader.accept();
            }
            return if has_update { Pin::Fresh } else { Pin::Unchanged };
        }
        first.iter_mut().chain(second.iter_mut()).for_each(Latest::reject);
    }
    Pin::Kept
}

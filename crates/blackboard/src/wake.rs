//! Waking a thread that sleeps: no system call when it does not, and no wake-up is lost.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::sync::{AtomicU64, Thread, current, order, park, park_timeout};

/// The bit that says that the thread sleeps; the others are the notifier's.
const SLEEPING: u64 = 1 << 63;

/// One thread's word: what it was notified of, and whether it sleeps. The standard library's parking is a futex word,
/// which is entered only when the thread sleeps indeed.
#[derive(Debug)]
pub struct Wake {
    word: AtomicU64,
    /// Who sleeps. Written before the bit is set and read by the one notifier that clears it, so never contended.
    thread: Mutex<Option<Thread>>,
}

impl Default for Wake {
    fn default() -> Self {
        Self::new()
    }
}

impl Wake {
    /// Nobody sleeps.
    pub fn new() -> Self {
        Self { word: AtomicU64::new(0), thread: Mutex::new(None) }
    }

    /// Adds `bits` (without the highest one) to what the thread finds, and wakes it if it sleeps.
    #[inline]
    pub fn notify(&self, bits: u64) {
        let before = self.word.fetch_or(bits & !SLEEPING, order::PUBLISH);
        if before & SLEEPING != 0 && !cfg!(feature = "mutant-wake") {
            self.wake();
        }
    }

    #[cold]
    fn wake(&self) {
        // Of several notifiers the one that clears the bit wakes the thread.
        if self.word.fetch_and(!SLEEPING, order::PUBLISH) & SLEEPING != 0
            && let Some(thread) = &*self.thread.lock().unwrap_or_else(PoisonError::into_inner)
        {
            thread.unpark();
        }
    }

    fn take(&self) -> u64 {
        self.word.swap(0, order::PUBLISH) & !SLEEPING
    }

    /// Says that this thread is about to sleep; false when there is something to wake up for.
    fn lie_down(&self) -> bool {
        *self.thread.lock().unwrap_or_else(PoisonError::into_inner) = Some(current());
        self.word.compare_exchange(0, SLEEPING, order::PUBLISH, order::ACQUIRE).is_ok()
    }

    /// Sleeps until notified; returns the bits.
    pub fn wait(&self) -> u64 {
        loop {
            let bits = self.take();
            if bits != 0 {
                return bits;
            }
            if self.lie_down() {
                park();
            }
        }
    }

    /// As [`wait`](Wake::wait), but not longer than `limit`; it may return 0 earlier.
    pub fn wait_timeout(&self, limit: Duration) -> u64 {
        let bits = self.take();
        if bits != 0 {
            return bits;
        }
        if self.lie_down() {
            park_timeout(limit);
        }
        self.take()
    }
}

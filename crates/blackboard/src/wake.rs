//! Wake-up of a sleeping thread.
//! It needs no system call for a thread that is awake, and no wake-up is lost.

use std::time::Duration;

use crate::sync::{AtomicPtr, AtomicU64, Ordering, Thread, current, order, park, park_timeout};

/// The bit that says that the thread sleeps; the others are the notifier's.
const SLEEPING_BIT: u64 = 1 << 63;

/// Notification word of one thread: its notifications, and whether it sleeps.
/// The standard library's parking is a futex word, which is entered only if the thread really sleeps.
///
/// One thread waits at a time; it may be another one each time.
#[derive(Debug)]
pub struct Wake {
    word: AtomicU64,
    /// Thread that sleeps, or slept last.
    /// Set before the bit.
    sleeper: AtomicPtr<Sleeper>,
    /// All threads that ever slept here.
    /// They stay, so a notifier that is preempted half-way needs no lock.
    sleepers: AtomicPtr<Sleeper>,
    spins: u32,
}

#[derive(Debug)]
struct Sleeper {
    thread: Thread,
    next: *mut Sleeper,
}

// SAFETY: sleepers are never changed once they are in the list, and freed only with it.
unsafe impl Send for Wake {}
// SAFETY: as above.
unsafe impl Sync for Wake {}

impl Default for Wake {
    fn default() -> Self {
        Self::new()
    }
}

impl Wake {
    /// Creates a word without a sleeping thread.
    pub fn new() -> Self {
        Self::with_spins(0)
    }

    /// Creates a word as [`new`](Wake::new), with spinning before sleep.
    /// A waiting thread polls `spins` times for a notification before it goes to sleep. That pays if a notification
    /// comes within the time that waking takes, and only while there are no more threads than cores.
    pub fn with_spins(spins: u32) -> Self {
        let null = || AtomicPtr::new(std::ptr::null_mut());
        Self { word: AtomicU64::new(0), sleeper: null(), sleepers: null(), spins }
    }

    /// Adds `bits` to the thread's notifications, and wakes it if it sleeps.
    /// `bits` must not have the highest bit.
    #[inline]
    pub fn notify(&self, bits: u64) {
        if self.word.fetch_or(bits & !SLEEPING_BIT, order::PUBLISH) & SLEEPING_BIT != 0 {
            self.wake();
        }
    }

    #[cold]
    fn wake(&self) {
        // Every notifier does this until the sleeper itself clears the bit, so none depends on another one that may
        // be preempted. Unparking is a system call only the first time.
        // SAFETY: the thread that set the bit had set the pointer before, and sleepers are not freed before `self`.
        unsafe { &*self.sleeper.load(order::ACQUIRE) }.thread.unpark();
    }

    #[inline]
    fn take(&self) -> u64 {
        self.word.swap(0, order::PUBLISH) & !SLEEPING_BIT
    }

    fn take_spinning(&self) -> u64 {
        for _ in 0..self.spins {
            if self.word.load(Ordering::Relaxed) != 0 {
                break;
            }
            std::hint::spin_loop();
        }
        self.take()
    }

    /// Announces that this thread is about to sleep; false if it has notifications.
    fn prepare_sleep(&self) -> bool {
        self.sleeper.store(self.own_entry(), order::RELEASE);
        if cfg!(feature = "mutant-wake") {
            self.word.store(SLEEPING_BIT, order::RELEASE);
            return true;
        }
        self.word.compare_exchange(0, SLEEPING_BIT, order::PUBLISH, Ordering::Relaxed).is_ok()
    }

    /// Returns this thread's entry, created at its first sleep here.
    fn own_entry(&self) -> *mut Sleeper {
        let thread = current();
        let mut first = self.sleepers.load(order::ACQUIRE);
        let mut sleeper = first;
        // SAFETY: entries are not changed once they are in the list, and not freed before `self`.
        while let Some(known) = unsafe { sleeper.as_ref() } {
            if known.thread.id() == thread.id() {
                return sleeper;
            }
            sleeper = known.next;
        }
        let own = Box::into_raw(Box::new(Sleeper { thread, next: first }));
        while let Err(other) = self.sleepers.compare_exchange(first, own, order::PUBLISH, order::ACQUIRE) {
            first = other;
            // SAFETY: not in the list yet, so it is this thread's alone.
            unsafe { (*own).next = first };
        }
        own
    }

    /// Sleeps until notified; returns the bits.
    pub fn wait(&self) -> u64 {
        loop {
            let bits = self.take_spinning();
            if bits != 0 {
                return bits;
            }
            if self.prepare_sleep() {
                park();
            }
        }
    }

    /// Waits as [`wait`](Wake::wait), but not longer than `limit`.
    /// It may return 0 earlier.
    pub fn wait_timeout(&self, limit: Duration) -> u64 {
        let bits = self.take_spinning();
        if bits != 0 {
            return bits;
        }
        if self.prepare_sleep() {
            park_timeout(limit);
        }
        self.take()
    }
}

impl Drop for Wake {
    fn drop(&mut self) {
        let mut sleeper = self.sleepers.load(Ordering::Acquire);
        while !sleeper.is_null() {
            // SAFETY: made from a box, freed once, and no thread can notify any more.
            sleeper = unsafe { Box::from_raw(sleeper) }.next;
        }
    }
}

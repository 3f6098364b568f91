//! Lock-free, zero-copy handover of pictures to the vision master.
//! They come from a capture thread.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicU8, Ordering};

use slate_module::blackboard::channel::Writer;

/// State: free, without a new picture.
const FREE: u8 = 0;
/// State: owned by the thread.
const FILLING: u8 = 1;
/// State: free, with a new picture.
const FULL: u8 = 2;
/// State: owned by the master.
const TAKING: u8 = 3;

/// Slot of a camera's newest picture; a new one replaces it.
#[derive(Debug)]
pub(crate) struct Handover {
    state: AtomicU8,
    content: UnsafeCell<Content>,
}

/// Content of the slot.
#[derive(Debug)]
pub(crate) struct Content {
    /// Writer; its draft is the picture.
    pub writer: Option<Writer>,
    /// Size of the pixels, bytes, and capture time, or the reason of a failure.
    pub result: Result<(usize, u64), String>,
}

// SAFETY: the content is used by one thread at a time, as the state says.
unsafe impl Sync for Handover {}

impl Default for Handover {
    fn default() -> Self {
        let content = Content { writer: None, result: Ok((0, 0)) };
        Self { state: AtomicU8::new(FREE), content: UnsafeCell::new(content) }
    }
}

impl Handover {
    /// Puts a new picture; one thread at a time may call it.
    /// It waits while the master takes the previous one, for a few instructions.
    pub fn fill(&self, work: impl FnOnce(&mut Option<Writer>) -> Result<(usize, u64), String>) {
        loop {
            let state = self.state.load(Ordering::Relaxed);
            let is_mine = state != TAKING
                && self.state.compare_exchange(state, FILLING, Ordering::Acquire, Ordering::Relaxed).is_ok();
            if is_mine {
                break;
            }
            std::thread::yield_now();
        }
        // SAFETY: the master takes nothing while it is being filled.
        let content = unsafe { &mut *self.content.get() };
        content.result = work(&mut content.writer);
        self.state.store(FULL, Ordering::Release);
    }

    /// Takes a new picture, if any.
    pub fn take(&self, work: impl FnOnce(&mut Content)) {
        if self.state.compare_exchange(FULL, TAKING, Ordering::Acquire, Ordering::Relaxed).is_err() {
            return;
        }
        // SAFETY: the thread waits while it is being taken.
        work(unsafe { &mut *self.content.get() });
        self.state.store(FREE, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taken_pictures_are_whole_and_never_older_than_before() {
        let handover = Handover::default();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for number in 1..=100_000 {
                    handover.fill(|_| Ok((number, number as u64)));
                }
            });
            let mut last = 0;
            while last < 100_000 {
                handover.take(|content| {
                    assert!(matches!(content.result, Ok((size, time)) if size as u64 == time && time > last));
                    last = content.result.as_ref().map_or(0, |(_, time)| *time);
                });
                std::hint::spin_loop();
            }
        });
    }

    #[test]
    fn the_newest_is_taken_and_once() {
        let handover = Handover::default();
        let taken = || {
            let mut taken = None;
            handover.take(|content| taken = Some(content.result.clone()));
            taken
        };
        assert_eq!(taken(), None);
        handover.fill(|_| Err("unplugged".into()));
        handover.fill(|_| Ok((4, 7)));
        assert_eq!((taken(), taken()), (Some(Ok((4, 7))), None));
    }
}

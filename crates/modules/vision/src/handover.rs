//! Pictures on their way from the thread that takes them to the master, which shows them to all at once: without a copy, and
//! without a lock.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicU8, Ordering};

use slate_module::blackboard::channel::Writer;

/// Nobody has the content, and there is nothing new in it.
const FREE: u8 = 0;
/// The thread has it.
const FILLING: u8 = 1;
/// Nobody has it, and it is new.
const FULL: u8 = 2;
/// The master has it.
const TAKING: u8 = 3;

/// Where a thread puts the newest picture of a camera; one that nobody has taken makes room.
#[derive(Debug)]
pub(crate) struct Handover {
    state: AtomicU8,
    content: UnsafeCell<Content>,
}

/// What is handed over.
#[derive(Debug)]
pub(crate) struct Content {
    /// In its draft is the picture.
    pub writer: Option<Writer>,
    /// The bytes of its pixels and when it was taken, or why there is none.
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
    /// Puts something new in. Only one thread does so at a time; it waits while the master takes the last one, which is no
    /// longer than a few instructions.
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

    /// Takes what is new, if there is something.
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

use std::sync::OnceLock;

use slate_blackboard::wake::Wake;

use super::sync::{AtomicBool, Ordering};

/// Seats for sleeping threads, one each.
/// Their number is the maximum of simultaneous sleepers so far; none is removed, so a wake-up needs no lock.
#[derive(Debug, Default)]
pub(super) struct Seats {
    first: OnceLock<Box<Seat>>,
}

#[derive(Debug, Default)]
struct Seat {
    taken: AtomicBool,
    wake: Wake,
    next: OnceLock<Box<Seat>>,
}

/// Seat taken by this thread, until it is dropped.
pub(super) struct Taken<'a>(&'a Seat);

impl Seats {
    /// Takes a free seat, or makes one.
    pub fn sit(&self) -> Taken<'_> {
        let mut seat = self.first.get_or_init(Box::default);
        while seat.taken.swap(true, Ordering::AcqRel) {
            seat = seat.next.get_or_init(Box::default);
        }
        Taken(seat)
    }

    /// Wakes all sleeping threads.
    #[inline]
    pub fn wake(&self) {
        let mut next = self.first.get();
        while let Some(seat) = next {
            if seat.taken.load(Ordering::Acquire) {
                seat.wake.notify(1);
            }
            next = seat.next.get();
        }
    }
}

impl Taken<'_> {
    pub fn wake(&self) -> &Wake {
        &self.0.wake
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        self.0.taken.store(false, Ordering::Release);
    }
}

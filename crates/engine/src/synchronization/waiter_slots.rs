use std::sync::OnceLock;

use slate_blackboard::wake::Wake;

use super::sync::{AtomicBool, Ordering};

/// Slots for sleeping threads, one each.
/// Their number is the maximum of simultaneous sleepers so far; none is removed, so a wake-up needs no lock.
#[derive(Debug, Default)]
pub(super) struct WaiterSlots {
    first: OnceLock<Box<WaiterSlot>>,
}

#[derive(Debug, Default)]
struct WaiterSlot {
    taken: AtomicBool,
    wake: Wake,
    next: OnceLock<Box<WaiterSlot>>,
}

/// Slot taken by this thread, until it is dropped.
pub(super) struct AcquiredSlot<'a>(&'a WaiterSlot);

impl WaiterSlots {
    /// Takes a free slot, or makes one.
    pub fn acquire(&self) -> AcquiredSlot<'_> {
        let mut slot = self.first.get_or_init(Box::default);
        while slot.taken.swap(true, Ordering::AcqRel) {
            slot = slot.next.get_or_init(Box::default);
        }
        AcquiredSlot(slot)
    }

    /// Wakes all sleeping threads.
    #[inline]
    pub fn wake(&self) {
        let mut next = self.first.get();
        while let Some(slot) = next {
            if slot.taken.load(Ordering::Acquire) {
                slot.wake.notify(1);
            }
            next = slot.next.get();
        }
    }
}

impl AcquiredSlot<'_> {
    pub fn wake(&self) -> &Wake {
        &self.0.wake
    }
}

impl Drop for AcquiredSlot<'_> {
    fn drop(&mut self) {
        self.0.taken.store(false, Ordering::Release);
    }
}

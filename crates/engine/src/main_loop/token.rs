use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicU32, Ordering};

use super::Core;

/// Core of the loop and its token, which one thread at a time holds.
pub(super) struct LoopToken {
    core: UnsafeCell<Core>,
    /// [`FREE`] or [`TAKEN`].
    state: AtomicU32,
}

const FREE: u32 = 0;
const TAKEN: u32 = 1;

// SAFETY: the core is used only by the thread that holds the token.
unsafe impl Sync for LoopToken {}

impl LoopToken {
    /// Returns a free token.
    pub fn new(core: Core) -> Self {
        Self { core: UnsafeCell::new(core), state: AtomicU32::new(FREE) }
    }

    /// Returns the core.
    ///
    /// # Safety
    /// The caller holds the token, or no thread does.
    #[allow(clippy::mut_from_ref, reason = "the token grants the access")]
    #[inline]
    pub unsafe fn core(&self) -> &mut Core {
        // SAFETY: passed on to the caller.
        unsafe { &mut *self.core.get() }
    }

    pub fn try_take(&self) -> bool {
        self.state.compare_exchange(FREE, TAKEN, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    /// Takes the token as soon as it is free.
    /// That is soon: a run of the loop is never waited for here.
    pub fn take(&self) {
        while !self.try_take() {
            std::thread::yield_now();
        }
    }

    pub fn release(&self) {
        self.state.store(FREE, Ordering::Release);
    }
}

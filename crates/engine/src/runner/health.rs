use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use slate_composition::own::ModuleCondition;

use crate::timing::LiveHistogram;

/// Health of a module, as the host sees it.
#[derive(Debug)]
pub struct Health {
    condition: AtomicU8,
    /// Ticks that took longer than the deadline, or came too late.
    pub misses: AtomicU64,
    /// Panics caught.
    pub panics: AtomicU64,
    /// Wall-clock nanoseconds of all ticks that were timed.
    pub histogram: LiveHistogram,
}

impl Default for Health {
    /// Returns the health of a module that is not loaded.
    fn default() -> Self {
        Self {
            condition: AtomicU8::new(ModuleCondition::UNLOADED.0),
            misses: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            histogram: LiveHistogram::default(),
        }
    }
}

impl Health {
    /// Resets all to zero for a module that begins.
    pub fn begin(&self) {
        for counter in [&self.misses, &self.panics] {
            counter.store(0, Ordering::Relaxed);
        }
        self.histogram.clear();
        self.set(ModuleCondition::WORKING);
    }

    /// Returns the condition.
    #[inline]
    pub fn condition(&self) -> ModuleCondition {
        ModuleCondition(self.condition.load(Ordering::Relaxed))
    }

    /// Returns true if its outputs are the module's, and not safe values.
    #[inline]
    pub fn is_working(&self) -> bool {
        self.condition().is_working()
    }

    /// Sets the condition.
    pub fn set(&self, condition: ModuleCondition) {
        self.condition.store(condition.0, Ordering::Relaxed);
    }
}

/// Increments a counter that only one thread at a time writes.
/// It is cheaper than an atomic read-modify-write.
#[inline]
pub fn count(counter: &AtomicU64) {
    counter.store(counter.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
}

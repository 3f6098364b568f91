use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use slate_composition::own::ModuleCondition;

use crate::timing::LiveHistogram;

/// How a module is, as the host sees it.
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

/// The condition of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Condition {
    /// Not enabled.
    Inactive = 0,
    /// As intended.
    Working = 1,
    /// With less than it wants.
    Degraded = 2,
    /// It could not do its work in its last tick.
    Failed = 3,
    /// Its tick has not returned in time; its outputs are safe values.
    Late = 4,
    /// It panicked too often, or could not be made anew.
    Faulted = 5,
    /// Its plugin is not loaded.
    Unloaded = 6,
    /// A service that it needs is not provided.
    Waiting = 7,
}

impl Condition {
    /// The condition of a number.
    pub fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Inactive,
            1 => Self::Working,
            2 => Self::Degraded,
            3 => Self::Failed,
            4 => Self::Late,
            5 => Self::Faulted,
            6 => Self::Unloaded,
            _ => Self::Waiting,
        }
    }

    /// As [`ModuleCondition`] calls it.
    pub fn name(self) -> &'static str {
        ModuleCondition(self as u8).name()
    }

    /// Whether outputs are what the module means.
    pub fn is_working(self) -> bool {
        matches!(self, Self::Working | Self::Degraded)
    }
}

impl Default for Health {
    /// Of a module that is not loaded.
    fn default() -> Self {
        Self {
            condition: AtomicU8::new(Condition::Unloaded as u8),
            misses: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            histogram: LiveHistogram::default(),
        }
    }
}

impl Health {
    /// A module begins, with everything at zero.
    pub fn begin(&self) {
        for counter in [&self.misses, &self.panics] {
            counter.store(0, Ordering::Relaxed);
        }
        self.histogram.clear();
        self.set(Condition::Working);
    }

    /// The condition.
    pub fn condition(&self) -> Condition {
        Condition::from_number(self.condition.load(Ordering::Relaxed))
    }

    /// Whether its outputs are what the module means.
    #[inline]
    pub fn is_working(&self) -> bool {
        let number = self.condition.load(Ordering::Relaxed);
        number == Condition::Working as u8 || number == Condition::Degraded as u8
    }

    /// Sets the condition.
    pub fn set(&self, condition: Condition) {
        self.condition.store(condition as u8, Ordering::Relaxed);
    }
}

/// Adds one to a counter that only one thread at a time writes: cheaper than a read-modify-write.
pub fn count(counter: &AtomicU64) {
    counter.store(counter.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
}

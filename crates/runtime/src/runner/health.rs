use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// How a module is, as its readers and users see it.
#[derive(Debug)]
pub(crate) struct Health {
    condition: AtomicU8,
    /// Ticks made.
    pub ticks: AtomicU64,
    /// Ticks that took longer than the deadline, or came too late.
    pub misses: AtomicU64,
    /// Panics caught.
    pub panics: AtomicU64,
    /// Wall-clock nanoseconds of the last tick.
    pub duration: AtomicU64,
}

/// The condition of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Condition {
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
}

impl Condition {
    /// Whether outputs are what the module means.
    pub fn is_working(self) -> bool {
        matches!(self, Self::Working | Self::Degraded)
    }
}

impl Health {
    pub fn new() -> Self {
        Self {
            condition: AtomicU8::new(Condition::Working as u8),
            ticks: AtomicU64::new(0),
            misses: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            duration: AtomicU64::new(0),
        }
    }

    pub fn condition(&self) -> Condition {
        match self.condition.load(Ordering::Relaxed) {
            0 => Condition::Inactive,
            1 => Condition::Working,
            2 => Condition::Degraded,
            3 => Condition::Failed,
            4 => Condition::Late,
            _ => Condition::Faulted,
        }
    }

    pub fn set(&self, condition: Condition) {
        self.condition.store(condition as u8, Ordering::Relaxed);
    }
}

/// Adds one to a counter that only one thread at a time writes: cheaper than a read-modify-write.
pub(crate) fn count(counter: &AtomicU64) {
    counter.store(counter.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
}

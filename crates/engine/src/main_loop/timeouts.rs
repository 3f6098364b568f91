use std::sync::atomic::{AtomicU64, Ordering};

/// How long stages may take.
pub(super) struct StageTimeouts {
    /// When the time of the present stage is up, monotonic; 0 for never.
    deadline: AtomicU64,
    /// The shortest time-out of a stage, nanoseconds.
    shortest: AtomicU64,
}

impl Default for StageTimeouts {
    /// Of stages that may take any time.
    fn default() -> Self {
        Self { deadline: AtomicU64::new(0), shortest: AtomicU64::new(u64::MAX) }
    }
}

impl StageTimeouts {
    /// When the time of the present stage is up, monotonic; 0 for never.
    pub fn deadline(&self) -> u64 {
        self.deadline.load(Ordering::Acquire)
    }

    /// Says when the time of the present stage is up, monotonic; 0 for never.
    pub fn set_deadline(&self, deadline: u64) {
        self.deadline.store(deadline, Ordering::Release);
    }

    /// The shortest time-out of a stage, nanoseconds.
    pub fn shortest(&self) -> u64 {
        self.shortest.load(Ordering::Relaxed)
    }

    /// Says what the shortest one is, if a stage has one.
    pub fn set_shortest(&self, shortest: Option<u64>) {
        self.shortest.store(shortest.unwrap_or(u64::MAX), Ordering::Relaxed);
    }
}

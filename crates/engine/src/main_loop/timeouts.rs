use std::sync::atomic::{AtomicU64, Ordering};

/// Timeouts of stages.
pub(super) struct StageTimeouts {
    /// Deadline of the present stage, monotonic, ns; 0 for none.
    deadline: AtomicU64,
    /// Shortest timeout of a stage, ns.
    shortest: AtomicU64,
}

impl Default for StageTimeouts {
    /// Returns no timeouts.
    fn default() -> Self {
        Self { deadline: AtomicU64::new(0), shortest: AtomicU64::new(u64::MAX) }
    }
}

impl StageTimeouts {
    /// Returns the deadline of the present stage, monotonic, ns; 0 for none.
    pub fn deadline(&self) -> u64 {
        self.deadline.load(Ordering::Acquire)
    }

    /// Sets the deadline of the present stage, monotonic, ns; 0 for none.
    pub fn set_deadline(&self, deadline: u64) {
        self.deadline.store(deadline, Ordering::Release);
    }

    /// Returns the shortest timeout of a stage, ns.
    pub fn shortest(&self) -> u64 {
        self.shortest.load(Ordering::Relaxed)
    }

    /// Sets the shortest timeout of a stage, if any has one.
    pub fn set_shortest(&self, shortest: Option<u64>) {
        self.shortest.store(shortest.unwrap_or(u64::MAX), Ordering::Relaxed);
    }
}

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// The agent's time, nanoseconds since its start: the system's, or what a time source says.
#[derive(Debug)]
pub(crate) enum Clock {
    /// The system's monotonic clock.
    System(Instant),
    /// A time source drives it.
    Driven(AtomicU64),
}

impl Clock {
    #[allow(clippy::disallowed_methods, reason = "the host is where time comes from")]
    pub fn system() -> Self {
        Self::System(Instant::now())
    }

    pub fn driven() -> Self {
        Self::Driven(AtomicU64::new(0))
    }

    pub fn now(&self) -> u64 {
        match self {
            Self::System(start) => start.elapsed().as_nanos() as u64,
            Self::Driven(now) => now.load(Ordering::Acquire),
        }
    }

    /// Sets a driven clock; the system's goes by itself.
    pub fn set(&self, time: u64) {
        if let Self::Driven(now) = self {
            now.store(time, Ordering::Release);
        }
    }
}

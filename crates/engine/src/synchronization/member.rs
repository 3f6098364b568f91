use std::fmt;
use std::sync::Arc;

use super::sync::{AtomicU64, Ordering};

/// Registered emitter of a point.
pub(super) struct Member {
    /// Unique number.
    pub number: u64,
    pub name: Arc<str>,
    emitted: AtomicU64,
}

impl Member {
    pub fn new(number: u64, name: &str) -> Arc<Self> {
        Arc::new(Self { number, name: name.into(), emitted: AtomicU64::new(0) })
    }

    /// Counts an emit; the points' counts, which follow, publish it.
    #[inline]
    pub fn count(&self) {
        self.emitted.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the number of its emits.
    pub fn emitted(&self) -> u64 {
        self.emitted.load(Ordering::Relaxed)
    }
}

impl fmt::Debug for Member {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Member").field(&self.name).field(&self.emitted()).finish()
    }
}

use std::fmt;
use std::sync::Arc;

use super::Point;
use super::sync::{AtomicU64, Ordering};

/// Someone who emits a point.
pub(super) struct Member {
    /// Tells it from all others.
    pub number: u64,
    pub name: Arc<str>,
    emitted: AtomicU64,
}

impl Member {
    pub fn new(number: u64, name: &str) -> Arc<Self> {
        Arc::new(Self { number, name: name.into(), emitted: AtomicU64::new(0) })
    }

    /// How often it emitted.
    pub fn emitted(&self) -> u64 {
        self.emitted.load(Ordering::Relaxed)
    }
}

impl fmt::Debug for Member {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Member").field(&self.name).field(&self.emitted()).finish()
    }
}

/// Emits a point. Dropping it says that nobody needs to wait for it any more.
#[derive(Debug)]
pub struct Emitter {
    point: Arc<Point>,
    member: Arc<Member>,
}

impl Emitter {
    pub(super) fn new(point: Arc<Point>, member: Arc<Member>) -> Self {
        let emitter = Self { point, member };
        emitter.enter();
        emitter
    }

    /// The point that it emits.
    pub fn point(&self) -> &Arc<Point> {
        &self.point
    }

    /// Whether somebody has ever asked for the point, or one above it, by [`Synchronization::point`]. Who emits often need
    /// not do it before; the point's count then begins with the first emit that somebody could wait for.
    ///
    /// [`Synchronization::point`]: super::Synchronization::point
    #[inline]
    pub fn is_wanted(&self) -> bool {
        self.point.is_wanted()
    }

    /// Emits the point and those above it.
    #[inline]
    pub fn emit(&self) {
        // The points' counts, which follow, publish it.
        self.member.emitted.fetch_add(1, Ordering::Relaxed);
        self.point.with_ancestors().for_each(|point| point.notify(1));
    }

    /// Says that somebody may wait for it to emit, as from its beginning.
    pub fn enter(&self) {
        self.point.with_ancestors().for_each(|point| point.enter(&self.member));
    }

    /// Says that nobody needs to wait for it for now.
    pub fn leave(&self) {
        self.point.with_ancestors().for_each(|point| point.leave(&self.member));
    }
}

impl Drop for Emitter {
    fn drop(&mut self) {
        self.leave();
    }
}

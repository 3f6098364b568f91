use std::sync::Arc;

use super::Point;
use super::member::Member;

/// Emitter of a point; waits exclude it once it is dropped.
#[derive(Debug)]
pub struct Emitter {
    point: Arc<Point>,
    member: Arc<Member>,
}

impl Emitter {
    pub(super) fn new(point: Arc<Point>, member: Arc<Member>) -> Self {
        let emitter = Self { point, member };
        emitter.register();
        emitter
    }

    /// Returns the point that it emits.
    pub fn point(&self) -> &Arc<Point> {
        &self.point
    }

    /// Returns true if the point, or one above it, was ever requested.
    /// Requested by [`Synchronization::point`]. A frequent emitter may skip its emits before that; the point's count
    /// then begins with the first emit that a thread could wait for.
    ///
    /// [`Synchronization::point`]: super::Synchronization::point
    #[inline]
    pub fn is_requested(&self) -> bool {
        self.point.is_requested()
    }

    /// Emits the point and those above it.
    #[inline]
    pub fn emit(&self) {
        self.member.count();
        self.point.with_ancestors().for_each(|point| point.notify(1));
    }

    /// Registers the emitter, so that waits include it, as at its beginning.
    pub fn register(&self) {
        self.point.with_ancestors().for_each(|point| point.register(&self.member));
    }

    /// Unregisters the emitter, so that waits exclude it for now.
    pub fn unregister(&self) {
        self.point.with_ancestors().for_each(|point| point.unregister(&self.member));
    }
}

impl Drop for Emitter {
    fn drop(&mut self) {
        self.unregister();
    }
}

use std::sync::Arc;

use super::Point;
use super::member::Member;

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
        self.member.count();
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

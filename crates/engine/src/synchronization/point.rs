use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use slate_sorted::SortedMap;

use super::member::Member;
use super::sync::{AtomicBool, AtomicU64, Mutex, MutexGuard, Ordering};
use super::waiter_slots::WaiterSlots;

/// Number of emits of a point, since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(u64);

impl Count {
    /// Never.
    pub const ZERO: Self = Self(0);

    /// Returns a count of that number.
    pub fn new(count: u64) -> Self {
        Self(count)
    }

    /// Returns the number.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// Numbers of emits of all emitters of a point at one time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mark(SortedMap<u64, u64>);

impl Mark {
    fn from_members(members: &SortedMap<u64, Arc<Member>>) -> Self {
        Self(members.iter().map(|(number, member)| (*number, member.emitted())).collect())
    }
}

/// Timeout of a wait for a point.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("nothing was emitted at `{point}` within {limit:?}")]
pub struct TimedOut {
    /// Name of the point.
    pub point: Arc<str>,
    /// Timeout of the wait.
    pub limit: Duration,
}

/// Some did not emit the point in time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{point}` was not emitted within {limit:?} by {}", names(.late))]
pub struct Late {
    /// Name of the point.
    pub point: Arc<str>,
    /// Timeout of the wait.
    pub limit: Duration,
    /// Names of the late emitters, in the order of their registration.
    pub late: Vec<Arc<str>>,
}

fn names(late: &[Arc<str>]) -> String {
    late.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Synchronization point.
#[derive(Debug)]
pub struct Point {
    name: Arc<str>,
    parent: Option<Arc<Point>>,
    /// Number of emits here and below.
    /// Emitters and waiters only ever exchange it, and so each learns what those before it did: an emitter after a
    /// waiter's check sees the waiter's slot, and the waiter sees an earlier emit.
    count: AtomicU64,
    waiter_slots: WaiterSlots,
    /// True once the point, or one above it, was requested.
    requested: AtomicBool,
    /// Emitters here and below; not used by an emit.
    members: Mutex<SortedMap<u64, Arc<Member>>>,
}

impl Point {
    pub(super) fn new(name: Arc<str>, parent: Option<Arc<Point>>) -> Self {
        let requested = parent.as_ref().is_some_and(|parent| parent.is_requested());
        Self {
            requested: AtomicBool::new(requested),
            name,
            parent,
            count: AtomicU64::new(0),
            waiter_slots: WaiterSlots::default(),
            members: Mutex::new(SortedMap::new()),
        }
    }

    /// Returns the name, such as `/stage/act/start`.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Returns the number of emits here and below.
    pub fn count(&self) -> Count {
        Count(self.count.load(Ordering::Acquire))
    }

    /// Waits for more than `since` emits; returns their number.
    /// A waiter that passes the last returned count misses nothing; several emits that it was too slow for come as one.
    ///
    /// # Errors
    /// When that does not happen within `limit` of wall-clock time.
    pub fn wait(&self, since: Count, limit: Duration) -> Result<Count, TimedOut> {
        let timed_out = || TimedOut { point: Arc::clone(&self.name), limit };
        self.wait_until(limit, |count| (count > since).then_some(count)).ok_or_else(timed_out)
    }

    /// Returns the present number of emits of each of its emitters.
    pub fn mark(&self) -> Mark {
        Mark::from_members(&self.members())
    }

    /// Waits until each emitter of the mark `since`, here or below, has emitted again.
    /// Returns the next mark, which includes later emitters. One that leaves delays no waiter; without any left, it
    /// returns at once.
    ///
    /// # Errors
    /// When some have not within `limit` of wall-clock time; it names them.
    pub fn wait_all(&self, since: &Mark, limit: Duration) -> Result<Mark, Late> {
        let mut late = Vec::new();
        let result = self.wait_until(limit, |_| {
            let members = self.members();
            let now = Mark::from_members(&members);
            let behind = members.iter().filter(|(number, _)| since.0.get(number) == now.0.get(number));
            late = behind.map(|(_, member)| Arc::clone(&member.name)).collect();
            late.is_empty().then_some(now)
        });
        result.ok_or_else(|| Late { point: Arc::clone(&self.name), limit, late })
    }

    /// Returns true if the point, or one above it, was requested.
    #[inline]
    pub(super) fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// Marks the point as requested.
    pub(super) fn request(&self) {
        self.requested.store(true, Ordering::Relaxed);
    }

    /// Returns the point, its parent, and so on.
    #[inline]
    pub(super) fn with_ancestors(&self) -> impl Iterator<Item = &Point> {
        std::iter::successors(Some(self), |point| point.parent.as_deref())
    }

    /// Counts emits, and wakes the waiting threads.
    #[inline]
    pub(super) fn notify(&self, emits: u64) {
        self.count.fetch_add(emits, Ordering::AcqRel);
        self.waiter_slots.wake();
    }

    pub(super) fn register(&self, member: &Arc<Member>) {
        self.members().insert(member.number, Arc::clone(member));
    }

    pub(super) fn unregister(&self, member: &Member) {
        self.members().remove(&member.number);
        // Nothing was emitted, but a thread may wait for this emitter.
        self.notify(0);
    }

    fn members(&self) -> MutexGuard<'_, SortedMap<u64, Arc<Member>>> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls `check` after each event until it succeeds; `None` after the timeout.
    #[allow(clippy::disallowed_methods, reason = "threads outside the loop wait on the wall clock")]
    fn wait_until<T>(&self, limit: Duration, mut check: impl FnMut(Count) -> Option<T>) -> Option<T> {
        let start = Instant::now();
        let slot = self.waiter_slots.acquire();
        loop {
            let found = check(Count(self.count.fetch_add(0, Ordering::AcqRel)));
            let left = limit.saturating_sub(start.elapsed());
            if found.is_some() || left.is_zero() {
                return found;
            }
            slot.wake().wait_timeout(left);
        }
    }
}

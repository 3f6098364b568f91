use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use super::member::Member;
use super::seats::Seats;
use super::sync::{AtomicBool, AtomicU64, Mutex, MutexGuard, Ordering};

/// How often a point was emitted, since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(u64);

impl Count {
    /// Never.
    pub const ZERO: Self = Self(0);

    /// So often.
    pub fn new(count: u64) -> Self {
        Self(count)
    }

    /// The number.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// How often each emitter of a point had emitted at one time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mark(BTreeMap<u64, u64>);

impl Mark {
    fn of(members: &BTreeMap<u64, Arc<Member>>) -> Self {
        Self(members.iter().map(|(number, member)| (*number, member.emitted())).collect())
    }
}

/// The point was not emitted in time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("nothing was emitted at `{point}` within {limit:?}")]
pub struct TimedOut {
    /// Which one.
    pub point: Arc<str>,
    /// How long was waited.
    pub limit: Duration,
}

/// Some did not emit the point in time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{point}` was not emitted within {limit:?} by {}", names(.late))]
pub struct Late {
    /// Which one.
    pub point: Arc<str>,
    /// How long was waited.
    pub limit: Duration,
    /// Who is late, in the order of their registration.
    pub late: Vec<Arc<str>>,
}

fn names(late: &[Arc<str>]) -> String {
    late.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// A synchronisation point.
#[derive(Debug)]
pub struct Point {
    name: Arc<str>,
    parent: Option<Arc<Point>>,
    /// Emits here and below. Emitters and waiters only ever exchange it, and so each learns what those before it did:
    /// whoever emits after a waiter has looked sees that one's seat, and before, the waiter sees the emit.
    count: AtomicU64,
    seats: Seats,
    /// Whether somebody asked for it, or for a point above it.
    wanted: AtomicBool,
    /// Who emits here and below. Not used when they emit.
    members: Mutex<BTreeMap<u64, Arc<Member>>>,
}

impl Point {
    pub(super) fn new(name: Arc<str>, parent: Option<Arc<Point>>) -> Self {
        let wanted = parent.as_ref().is_some_and(|parent| parent.is_wanted());
        Self {
            wanted: AtomicBool::new(wanted),
            name,
            parent,
            count: AtomicU64::new(0),
            seats: Seats::default(),
            members: Mutex::new(BTreeMap::new()),
        }
    }

    /// Its name, such as `/stage/act/start`.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// How often it was emitted, or one below it.
    pub fn count(&self) -> Count {
        Count(self.count.load(Ordering::Acquire))
    }

    /// Waits until it was emitted more often than `since`, and says how often. With the count that it returned last, a
    /// waiter misses nothing; several emits that it was too slow for come as one.
    ///
    /// # Errors
    /// When that does not happen within `limit` of wall-clock time.
    pub fn wait(&self, since: Count, limit: Duration) -> Result<Count, TimedOut> {
        let timed_out = || TimedOut { point: Arc::clone(&self.name), limit };
        self.wait_until(limit, |count| (count > since).then_some(count)).ok_or_else(timed_out)
    }

    /// How often each of its emitters has emitted until now.
    pub fn mark(&self) -> Mark {
        Mark::of(&self.members())
    }

    /// Waits until each emitter that was registered at the mark `since`, here or below, has emitted after it; returns
    /// the next mark, which has those in it that came since. One that leaves holds nobody up; when none is left there
    /// is nothing to wait for.
    ///
    /// # Errors
    /// When some have not within `limit` of wall-clock time; it names them.
    pub fn wait_all(&self, since: &Mark, limit: Duration) -> Result<Mark, Late> {
        let mut late = Vec::new();
        let everybody = self.wait_until(limit, |_| {
            let members = self.members();
            let now = Mark::of(&members);
            let behind = members.iter().filter(|(number, _)| since.0.get(number) == now.0.get(number));
            late = behind.map(|(_, member)| Arc::clone(&member.name)).collect();
            late.is_empty().then_some(now)
        });
        everybody.ok_or_else(|| Late { point: Arc::clone(&self.name), limit, late })
    }

    /// Whether somebody asked for it, or for a point above it.
    #[inline]
    pub(super) fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Says that somebody asks for it.
    pub(super) fn want(&self) {
        self.wanted.store(true, Ordering::Relaxed);
    }

    /// It, its parent, and so on.
    #[inline]
    pub(super) fn with_ancestors(&self) -> impl Iterator<Item = &Point> {
        std::iter::successors(Some(self), |point| point.parent.as_deref())
    }

    /// Counts so many emits, and wakes who waits.
    #[inline]
    pub(super) fn notify(&self, emits: u64) {
        self.count.fetch_add(emits, Ordering::AcqRel);
        self.seats.wake();
    }

    pub(super) fn enter(&self, member: &Arc<Member>) {
        self.members().insert(member.number, Arc::clone(member));
    }

    pub(super) fn leave(&self, member: &Member) {
        self.members().remove(&member.number);
        // Nothing was emitted, but somebody may have waited for this one.
        self.notify(0);
    }

    fn members(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<Member>>> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks whenever something has happened, and sleeps in between; none when the time is up.
    #[allow(clippy::disallowed_methods, reason = "threads outside the loop wait on the wall clock")]
    fn wait_until<T>(&self, limit: Duration, mut look: impl FnMut(Count) -> Option<T>) -> Option<T> {
        let start = Instant::now();
        let seat = self.seats.sit();
        loop {
            let found = look(Count(self.count.fetch_add(0, Ordering::AcqRel)));
            let left = limit.saturating_sub(start.elapsed());
            if found.is_some() || left.is_zero() {
                return found;
            }
            seat.wake().wait_timeout(left);
        }
    }
}

//! Where an agent's time comes from.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds of the machine's monotonic clock, which no change of the date touches; from the start of the machine.
#[inline]
pub fn monotonic() -> u64 {
    // What the standard library's instant makes of it takes as long again, and a loop asks once for each step.
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Says what date and time it is.
pub type Calendar = Arc<dyn Fn() -> SystemTime + Send + Sync>;

/// Sets the agent's time: a simulator, a replay. It is asked before each cycle of the main loop.
///
/// ```
/// use slate_engine::clock::TimeSource;
///
/// /// Every cycle is twice as long as the one before.
/// struct Slower(u64);
///
/// impl TimeSource for Slower {
///     fn next(&mut self, last: Option<u64>, planned: u64) -> u64 {
///         self.0 *= 2;
///         last.map_or(planned, |last| last + self.0)
///     }
/// }
/// ```
pub trait TimeSource: Send {
    /// The time of the next cycle, nanoseconds. `last` is the time of the cycle before, if there was one, and `planned`
    /// is a period after that. A time before the last one is refused and counted, and the agent's time stands still.
    fn next(&mut self, last: Option<u64>, planned: u64) -> u64;

    /// What it needs to go on from a snapshot; nothing for one that has no state.
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Goes on from what was saved; false, and nothing is changed, when that does not fit.
    fn restore(&mut self, _saved: &[u8]) -> bool {
        true
    }
}

/// The times of a recorded run, one for each cycle; after the last of them cycles follow one another by the period.
#[derive(Clone, Debug)]
pub struct RecordedTimes {
    times: Vec<u64>,
    next: usize,
}

impl RecordedTimes {
    /// From the times in nanoseconds, in their order.
    pub fn new(times: Vec<u64>) -> Self {
        Self { times, next: 0 }
    }
}

impl TimeSource for RecordedTimes {
    fn next(&mut self, _: Option<u64>, planned: u64) -> u64 {
        let next = self.times.get(self.next).copied();
        self.next += usize::from(next.is_some());
        next.unwrap_or(planned)
    }

    fn save(&self) -> Vec<u8> {
        (self.next as u64).to_le_bytes().into()
    }

    fn restore(&mut self, saved: &[u8]) -> bool {
        let next = saved.try_into().ok().map(|next| u64::from_le_bytes(next) as usize);
        let Some(next) = next.filter(|next| *next <= self.times.len()) else { return false };
        self.next = next;
        true
    }
}

/// The agent's time, nanoseconds since its start: the system's monotonic clock, or what a time source says.
pub struct Clock {
    /// The monotonic time at the start; another one when the agent goes on from a snapshot.
    start: AtomicI64,
    /// What the time source said last, if there is one.
    driven: Option<AtomicU64>,
    calendar: Calendar,
    /// The date at the start.
    date: SystemTime,
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Clock").field("now", &self.now()).field("driven", &self.driven.is_some()).finish()
    }
}

impl Clock {
    /// A clock that a time source drives, or the system's.
    pub fn new(driven: bool, calendar: Option<Calendar>) -> Self {
        let calendar = calendar.unwrap_or_else(|| Arc::new(date));
        let date = calendar();
        Self {
            start: AtomicI64::new(monotonic() as i64),
            driven: driven.then(AtomicU64::default),
            calendar,
            date,
        }
    }

    /// The agent's time, nanoseconds.
    #[inline]
    pub fn now(&self) -> u64 {
        match &self.driven {
            None => self.at(monotonic()),
            Some(now) => now.load(Ordering::Acquire),
        }
    }

    /// Whether a time source drives it.
    pub fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// A monotonic time as one since the agent's start; on the system's clock that is the agent's time.
    #[inline]
    pub fn at(&self, monotonic: u64) -> u64 {
        // Whoever looks while an agent goes on from a snapshot gets a time before it, or of it.
        (monotonic as i64).saturating_sub(self.start.load(Ordering::Relaxed)).max(0) as u64
    }

    /// Sets a driven clock; the system's goes by itself.
    pub fn set(&self, time: u64) {
        if let Some(now) = &self.driven {
            now.store(time, Ordering::Release);
        }
    }

    /// Goes on from another time: a driven clock as said, and the system's from now on.
    pub fn resume(&self, time: u64) {
        self.set(time);
        self.start.store((monotonic() as i64).saturating_sub_unsigned(time), Ordering::Relaxed);
    }

    /// The date of an agent's time: for people, who read logs. Nothing is measured with it, as it may jump.
    pub fn date_of(&self, time: u64) -> SystemTime {
        if self.is_driven() {
            return self.date + Duration::from_nanos(time);
        }
        let (now, date) = (self.now(), (self.calendar)());
        let ago = Duration::from_nanos(now.saturating_sub(time));
        date.checked_sub(ago).unwrap_or(date) + Duration::from_nanos(time.saturating_sub(now))
    }
}

#[allow(clippy::disallowed_methods, reason = "the one place that knows the date")]
fn date() -> SystemTime {
    SystemTime::now()
}

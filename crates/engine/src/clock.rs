//! Clock and time sources of an agent.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use rustix::time::{ClockId, clock_gettime};

/// Returns the machine's monotonic time, ns since the start of the machine.
/// Changes of the date do not affect it.
#[inline]
pub fn monotonic() -> u64 {
    // The standard library's instant costs twice as much, and the loop reads the clock in each step.
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Source of the present date and time.
pub type Calendar = Arc<dyn Fn() -> SystemTime + Send + Sync>;

/// Source of the agent's time, such as a simulator or a replay.
/// It is called before each cycle of the main loop.
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
    /// Returns the time of the next cycle, ns.
    /// `last` is the time of the cycle before, if any, and `planned` is one period later. A time before `last` is
    /// rejected and counted, and the agent's time stands still.
    fn next(&mut self, last: Option<u64>, planned: u64) -> u64;

    /// Returns the state for a snapshot; empty if the source has none.
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Restores a saved state; false, without any change, if it does not fit.
    fn restore(&mut self, _saved: &[u8]) -> bool {
        true
    }
}

/// Recorded cycle times of a run; after the last one, cycles follow by the period.
#[derive(Clone, Debug)]
pub struct RecordedTimes {
    times: Vec<u64>,
    next: usize,
}

impl RecordedTimes {
    /// Returns a source of these times, ns, in their order.
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

/// Agent's time, ns since its start: the monotonic clock, or a time source.
pub struct Clock {
    /// Monotonic time of the start, ns; shifted when the agent resumes from a snapshot.
    start: AtomicI64,
    /// Last time of the time source, ns; `None` on the system's clock.
    driven: Option<AtomicU64>,
    calendar: Calendar,
    /// Date at the start.
    date: SystemTime,
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Clock").field("now", &self.now()).field("driven", &self.driven.is_some()).finish()
    }
}

impl Clock {
    /// Returns a clock that a time source drives, or the system's.
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

    /// Returns the agent's time, ns.
    #[inline]
    pub fn now(&self) -> u64 {
        match &self.driven {
            None => self.at(monotonic()),
            Some(now) => now.load(Ordering::Acquire),
        }
    }

    /// Returns true if a time source drives the clock.
    pub fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// Converts a monotonic time to one since the agent's start, ns.
    /// On the system's clock that is the agent's time.
    #[inline]
    pub fn at(&self, monotonic: u64) -> u64 {
        // A reader gets a time before or at the snapshot while the agent resumes from it.
        (monotonic as i64).saturating_sub(self.start.load(Ordering::Relaxed)).max(0) as u64
    }

    /// Sets a driven clock; the system's goes by itself.
    pub fn set(&self, time: u64) {
        if let Some(now) = &self.driven {
            now.store(time, Ordering::Release);
        }
    }

    /// Resumes at another time, ns.
    /// A driven clock stays there until it is set; the system's advances from it.
    pub fn resume(&self, time: u64) {
        self.set(time);
        self.start.store((monotonic() as i64).saturating_sub_unsigned(time), Ordering::Relaxed);
    }

    /// Returns the date of an agent's time, for the readers of logs.
    /// Nothing is measured with it, as it may jump.
    pub fn date_of(&self, time: u64) -> SystemTime {
        if self.is_driven() {
            return self.date + Duration::from_nanos(time);
        }
        let (now, date) = (self.now(), (self.calendar)());
        let age = Duration::from_nanos(now.saturating_sub(time));
        date.checked_sub(age).unwrap_or(date) + Duration::from_nanos(time.saturating_sub(now))
    }
}

#[allow(clippy::disallowed_methods, reason = "the one place that knows the date")]
fn date() -> SystemTime {
    SystemTime::now()
}

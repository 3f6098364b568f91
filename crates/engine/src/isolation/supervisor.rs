use std::collections::VecDeque;

/// When a process that failed, that of an isolated module or of an agent, starts anew: after a delay that doubles with
/// each failure, and not too often.
///
/// ```
/// use slate_engine::isolation::Supervisor;
///
/// let mut supervisor = Supervisor::default();
/// let delay = supervisor.failed(0).unwrap_or_default();
/// assert!(!supervisor.take_due(delay - 1) && supervisor.take_due(delay));
/// assert_eq!(supervisor.failed(delay), Some(2 * delay));
/// ```
#[derive(Debug, Default)]
pub struct Supervisor {
    /// Times of the last restarts, nanoseconds.
    restarts: VecDeque<u64>,
    /// The last delay, nanoseconds; 0 before the first failure.
    delay: u64,
    /// When the next restart is due.
    due: Option<u64>,
}

const MILLISECOND: u64 = 1_000_000;
const SECOND: u64 = 1000 * MILLISECOND;
const FIRST_DELAY: u64 = 100 * MILLISECOND;
const LONGEST_DELAY: u64 = 10 * SECOND;
/// After so long without a failure the delay begins anew.
const HEALTHY: u64 = 30 * SECOND;
const LIMIT: usize = 5;
const SPAN: u64 = 60 * SECOND;

impl Supervisor {
    /// It failed at `now` (nanoseconds, from whenever): the delay in nanoseconds until it starts anew, or nothing when it
    /// has failed too often.
    pub fn failed(&mut self, now: u64) -> Option<u64> {
        while self.restarts.front().is_some_and(|restart| now.saturating_sub(*restart) > SPAN) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= LIMIT {
            self.due = None;
            return None;
        }
        let healthy = self.restarts.back().is_none_or(|restart| now.saturating_sub(*restart) >= HEALTHY);
        self.delay = if healthy { FIRST_DELAY } else { (self.delay * 2).min(LONGEST_DELAY) };
        self.due = Some(now + self.delay);
        Some(self.delay)
    }

    /// Forgets all failures, as its code is another one now. A restart that is waited for is still made.
    pub fn forget(&mut self) {
        self.restarts.clear();
        self.delay = 0;
    }

    /// Whether a restart is waited for.
    pub fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    /// Whether a restart is due; it then counts as made.
    pub fn take_due(&mut self, now: u64) -> bool {
        let due = self.due.is_some_and(|due| now >= due);
        if due {
            self.due = None;
            self.restarts.push_back(now);
        }
        due
    }

    /// When the next restart is due, if one is.
    pub fn due(&self) -> Option<u64> {
        self.due
    }

    /// How often is too often, in words, for who reads that it was given up.
    pub fn too_often() -> String {
        format!("it was started anew {LIMIT} times within {} s and stays off", SPAN / SECOND)
    }

    /// The same of an isolated module.
    pub fn limit() -> String {
        format!("{} until its plugin is reloaded", Self::too_often())
    }
}

#[cfg(test)]
mod tests {
    use super::{HEALTHY, LONGEST_DELAY, MILLISECOND, SECOND, Supervisor};

    #[test]
    fn the_delay_doubles_and_the_limit_holds() {
        let mut supervisor = Supervisor::default();
        let mut now = SECOND;
        for delay in [100, 200, 400, 800, 1600] {
            assert_eq!(supervisor.failed(now), Some(delay * MILLISECOND));
            assert!(!supervisor.take_due(now + delay * MILLISECOND - 1));
            now += delay * MILLISECOND;
            assert!(supervisor.take_due(now));
            assert!(!supervisor.take_due(now), "once");
        }
        assert_eq!(supervisor.failed(now), None);
        assert!(!supervisor.take_due(now + 100 * SECOND));
    }

    #[test]
    fn health_begins_anew() {
        let mut supervisor = Supervisor::default();
        let mut now = SECOND;
        for _ in 0..100 {
            now += HEALTHY;
            assert_eq!(supervisor.failed(now), Some(100 * MILLISECOND));
            now += 100 * MILLISECOND;
            assert!(supervisor.take_due(now));
        }
    }

    #[test]
    fn the_delay_has_an_end() {
        let mut supervisor = Supervisor::default();
        let mut now = SECOND;
        let mut longest = 0;
        for _ in 0..20 {
            now += 15 * SECOND;
            let delay = supervisor.failed(now).unwrap_or_default();
            longest = longest.max(delay);
            now += delay;
            supervisor.take_due(now);
        }
        assert_eq!(longest, LONGEST_DELAY);
    }
}

use std::collections::VecDeque;

/// Restart policy of a process that failed: exponential backoff with a limit.
/// For the process of an isolated module, or of an agent. The delay doubles with each failure.
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
    /// Times of the last restarts, ns.
    restarts: VecDeque<u64>,
    /// Last delay, ns; 0 before the first failure.
    delay: u64,
    /// Time of the next restart, ns.
    due: Option<u64>,
}

const MILLISECOND: u64 = 1_000_000;
const SECOND: u64 = 1000 * MILLISECOND;
const FIRST_DELAY: u64 = 100 * MILLISECOND;
const LONGEST_DELAY: u64 = 10 * SECOND;
/// Time without a failure after which the delay begins again, ns.
const HEALTHY_PERIOD: u64 = 30 * SECOND;
const RESTART_LIMIT: usize = 5;
const RESTART_WINDOW: u64 = 60 * SECOND;

impl Supervisor {
    /// Registers a failure at `now`; returns the delay until the restart, ns.
    /// `now` is in ns from any origin. `None` after too many failures.
    pub fn failed(&mut self, now: u64) -> Option<u64> {
        while self.restarts.front().is_some_and(|restart| now.saturating_sub(*restart) > RESTART_WINDOW) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= RESTART_LIMIT {
            self.due = None;
            return None;
        }
        let healthy =
            self.restarts.back().is_none_or(|restart| now.saturating_sub(*restart) >= HEALTHY_PERIOD);
        self.delay = if healthy { FIRST_DELAY } else { (self.delay * 2).min(LONGEST_DELAY) };
        self.due = Some(now + self.delay);
        Some(self.delay)
    }

    /// Clears all failures, for new code; a pending restart is kept.
    pub fn forget(&mut self) {
        self.restarts.clear();
        self.delay = 0;
    }

    /// Returns true while a restart is pending.
    pub fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    /// Returns true if a restart is due, and counts it as done.
    pub fn take_due(&mut self, now: u64) -> bool {
        let due = self.due.is_some_and(|due| now >= due);
        if due {
            self.due = None;
            self.restarts.push_back(now);
        }
        due
    }

    /// Returns the time of the next restart, ns; `None` if none is pending.
    pub fn due(&self) -> Option<u64> {
        self.due
    }

    /// Describes the limit of restarts, for the message that it was reached.
    pub fn too_often() -> String {
        format!("it was restarted {RESTART_LIMIT} times within {} s and stays off", RESTART_WINDOW / SECOND)
    }

    /// Describes the limit of restarts for an isolated module.
    pub fn limit() -> String {
        format!("{} until its plugin is reloaded", Self::too_often())
    }
}

#[cfg(test)]
mod tests {
    use super::{HEALTHY_PERIOD, LONGEST_DELAY, MILLISECOND, SECOND, Supervisor};

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
            now += HEALTHY_PERIOD;
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

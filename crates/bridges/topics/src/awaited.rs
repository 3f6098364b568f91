//! Values that wait until a cycle takes them.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Period of the check whether a wait has become pointless.
const CHECK_PERIOD: Duration = Duration::from_millis(20);

/// Values of several inputs, each in the order in which they came.
#[derive(Debug)]
pub(crate) struct AwaitedValues {
    /// Queues by place.
    queues: Mutex<Vec<AwaitedQueue>>,
    arrived: Condvar,
}

#[derive(Debug, Default)]
struct AwaitedQueue {
    values: VecDeque<Vec<u8>>,
    /// Values that had no room.
    lost: u64,
}

impl AwaitedValues {
    /// Creates empty queues for this number of inputs.
    pub fn new(count: usize) -> Self {
        let queues = (0..count).map(|_| AwaitedQueue::default()).collect();
        Self { queues: Mutex::new(queues), arrived: Condvar::new() }
    }

    fn queues(&self) -> MutexGuard<'_, Vec<AwaitedQueue>> {
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends a value.
    /// Returns false if `depth` values were waiting, so that the oldest is dropped.
    pub fn push(&self, index: usize, value: Vec<u8>, depth: usize) -> bool {
        let mut queues = self.queues();
        let queue = &mut queues[index];
        let has_room = queue.values.len() < depth;
        if !has_room {
            queue.values.pop_front();
            queue.lost += 1;
        }
        queue.values.push_back(value);
        self.arrived.notify_all();
        has_room
    }

    /// Counts values that had no room before they came here.
    pub fn note_lost(&self, index: usize, count: u64) {
        self.queues()[index].lost += count;
    }

    /// Returns the number of values dropped for lack of room since the last call.
    pub fn take_lost(&self, index: usize) -> u64 {
        std::mem::take(&mut self.queues()[index].lost)
    }

    /// Takes the oldest value.
    pub fn take(&self, index: usize) -> Option<Vec<u8>> {
        self.queues()[index].values.pop_front()
    }

    /// Waits for a value until a deadline, while `continues`; returns whether it came.
    #[allow(clippy::disallowed_methods, reason = "nodes answer by the machine's clock")]
    pub fn wait(&self, index: usize, until: Instant, continues: impl Fn() -> bool) -> bool {
        let mut queues = self.queues();
        loop {
            if !queues[index].values.is_empty() {
                return true;
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || !continues() {
                return false;
            }
            let waited = self.arrived.wait_timeout(queues, left.min(CHECK_PERIOD));
            queues = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

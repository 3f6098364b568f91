//! Delivery of external values to inputs.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use crate::{Composer, ExternalContent, ExternalInputError, ExternalValue};

/// Longest sleep of the thread while the queue is empty.
const PAUSE: Duration = Duration::from_millis(100);

/// Polling interval until the agent begins its first cycle.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Bounded queue of external values for inputs.
/// Programs outside of the agent fill it, and one thread [runs](Self::run) it. In lockstep it sets all values that
/// arrived before the end of a cycle before the next one, so a rerun sets the same values after the same cycles.
pub struct ExternalDelivery {
    composer: Composer,
    inputs: Vec<DeliveryInput>,
    waiting: Mutex<WaitingValues>,
    wake: Wake,
    ended: AtomicBool,
}

struct DeliveryInput {
    path: Arc<str>,
    /// Values that may wait, at most.
    depth: usize,
}

/// Waiting values in the order of arrival, each with the index of its input.
struct WaitingValues {
    values: VecDeque<(usize, ExternalContent)>,
    /// Number of waiting values by input.
    counts: Vec<usize>,
}

impl ExternalDelivery {
    /// Makes an empty queue for inputs, each with its path and depth.
    pub fn new(composer: Composer, inputs: impl IntoIterator<Item = (String, usize)>) -> Self {
        let input = |(path, depth): (String, usize)| DeliveryInput { path: path.into(), depth: depth.max(1) };
        let inputs: Vec<_> = inputs.into_iter().map(input).collect();
        let waiting = WaitingValues { values: VecDeque::new(), counts: vec![0; inputs.len()] };
        Self {
            composer,
            inputs,
            waiting: Mutex::new(waiting),
            wake: Wake::new(),
            ended: AtomicBool::new(false),
        }
    }

    /// Queues a value for an input; false if this drops the input's oldest value.
    /// `place` is the index of the input.
    pub fn push(&self, place: usize, content: ExternalContent) -> bool {
        let mut waiting = locked(&self.waiting);
        let is_full = waiting.counts[place] >= self.inputs[place].depth;
        if is_full {
            let oldest = waiting.values.iter().position(|(own, _)| *own == place);
            drop(oldest.and_then(|oldest| waiting.values.remove(oldest)));
        } else {
            waiting.counts[place] += 1;
        }
        waiting.values.push_back((place, content));
        drop(waiting);
        self.wake.notify(1);
        !is_full
    }

    /// Sets inputs to the queued values until [`end`](Self::end).
    /// Reports the result of each value with the index of its input.
    pub fn run(&self, report: impl Fn(usize, Result<(), ExternalInputError>)) {
        while !self.ended.load(Ordering::Acquire) {
            if self.composer.cycles() == 0 {
                self.wake.wait_timeout(POLL_PERIOD);
                continue;
            }
            let values = self.take();
            if values.is_empty() {
                self.wake.wait_timeout(PAUSE);
                continue;
            }
            let places: Vec<_> = values.iter().map(|(place, _)| *place).collect();
            let external = values.into_iter().map(|(place, content)| {
                let input = Arc::clone(&self.inputs[place].path);
                ExternalValue { input, content }
            });
            let results = self.composer.set_external(external.collect());
            places.into_iter().zip(results).for_each(|(place, result)| report(place, result));
        }
    }

    /// Ends [`run`](Self::run).
    /// A thread that waits for the end of a cycle returns only after it.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
    }

    fn take(&self) -> VecDeque<(usize, ExternalContent)> {
        let mut waiting = locked(&self.waiting);
        waiting.counts.fill(0);
        std::mem::take(&mut waiting.values)
    }
}

impl std::fmt::Debug for ExternalDelivery {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ExternalDelivery").field("inputs", &self.inputs.len()).finish_non_exhaustive()
    }
}

/// Locks a mutex, also a poisoned one.
/// The guarded data stays intact when another thread panics while it holds the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

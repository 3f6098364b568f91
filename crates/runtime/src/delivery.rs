//! Values from outside on their way to inputs.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use crate::{Composer, ExternalContent, ExternalInputError, ExternalValue};

/// How long the thread sleeps when nothing comes.
const PAUSE: Duration = Duration::from_millis(100);

/// How often it is looked whether an agent has begun.
const LOOK: Duration = Duration::from_millis(2);

/// A bounded queue of values for inputs, which programs outside of the agent fill. One thread [runs](Self::run) it; in lockstep
/// it sets all that came until the end of a cycle before the next one, so a rerun sets the same values after the same cycles.
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

/// Values in the order in which they came, each with the place of its input.
struct WaitingValues {
    values: VecDeque<(usize, ExternalContent)>,
    /// By input.
    counts: Vec<usize>,
}

impl ExternalDelivery {
    /// An empty queue for inputs, each a path with how many of its values may wait.
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

    /// Puts a value for the input at a place behind the others; false when its oldest one went for it.
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

    /// Sets inputs to what came, until [`end`](Self::end), and tells what became of each value by the place of its input.
    pub fn run(&self, tell: impl Fn(usize, Result<(), ExternalInputError>)) {
        while !self.ended.load(Ordering::Acquire) {
            if self.composer.cycles() == 0 {
                self.wake.wait_timeout(LOOK);
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
            places.into_iter().zip(results).for_each(|(place, result)| tell(place, result));
        }
    }

    /// Ends the thread that runs it, unless that waits for a cycle that does not end.
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

/// What stays intact when another thread panicked while it held the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

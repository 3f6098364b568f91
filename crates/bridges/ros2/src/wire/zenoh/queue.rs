//! Queue of samples from Zenoh to a thread of the bridge.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Waker;

/// Bytes of items that wait, at most; a larger one waits alone.
const MAX_BYTES: usize = 64 << 20;

/// Bounded queue between Zenoh's threads and one of the bridge.
/// The oldest value is dropped when it is full.
pub struct ReceiveQueue<T> {
    room: usize,
    state: Mutex<ReceiveQueueState<T>>,
}

struct ReceiveQueueState<T> {
    /// Values with their sizes.
    items: VecDeque<(T, usize)>,
    bytes: usize,
    dropped: u64,
    waker: Option<Waker>,
}

impl<T> ReceiveQueue<T> {
    pub fn new(room: usize) -> Self {
        let state = ReceiveQueueState { items: VecDeque::new(), bytes: 0, dropped: 0, waker: None };
        Self { room, state: Mutex::new(state) }
    }

    /// Adds an item of so many bytes, and wakes the thread.
    pub fn push(&self, item: T, size: usize) {
        let mut state = locked(&self.state);
        while (state.items.len() >= self.room || state.bytes + size > MAX_BYTES)
            && let Some((_, oldest)) = state.items.pop_front()
        {
            state.bytes -= oldest;
            state.dropped += 1;
        }
        state.items.push_back((item, size));
        state.bytes += size;
        let waker = state.waker.clone();
        drop(state);
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    /// Takes the oldest item.
    pub fn take(&self) -> Option<T> {
        let mut state = locked(&self.state);
        let (item, size) = state.items.pop_front()?;
        state.bytes -= size;
        Some(item)
    }

    /// Returns the number of values dropped for lack of room since the last call.
    pub fn take_dropped(&self) -> u64 {
        std::mem::take(&mut locked(&self.state).dropped)
    }

    pub fn set_waker(&self, waker: &Waker) {
        let own = &mut locked(&self.state).waker;
        if own.as_ref().is_none_or(|own| !own.will_wake(waker)) {
            *own = Some(waker.clone());
        }
    }
}

/// Locks data that stays intact when another thread panics with the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

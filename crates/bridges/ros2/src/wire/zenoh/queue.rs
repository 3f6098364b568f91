//! What Zenoh delivers, until a thread of the bridge takes it.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Waker;

/// A bounded queue between Zenoh's threads and one of the bridge. The oldest goes when there is no room.
pub struct Queue<T> {
    room: usize,
    state: Mutex<QueueState<T>>,
}

struct QueueState<T> {
    items: VecDeque<T>,
    dropped: u64,
    waker: Option<Waker>,
}

impl<T> Queue<T> {
    pub fn new(room: usize) -> Self {
        let state = QueueState { items: VecDeque::new(), dropped: 0, waker: None };
        Self { room, state: Mutex::new(state) }
    }

    /// Adds an item, and wakes the thread.
    pub fn push(&self, item: T) {
        let mut state = locked(&self.state);
        let oldest = if state.items.len() >= self.room { state.items.pop_front() } else { None };
        state.dropped += u64::from(oldest.is_some());
        state.items.push_back(item);
        let waker = state.waker.clone();
        drop(state);
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    /// Takes the oldest item.
    pub fn take(&self) -> Option<T> {
        locked(&self.state).items.pop_front()
    }

    /// How many had no room since the last call.
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

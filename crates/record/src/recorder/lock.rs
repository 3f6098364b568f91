use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks a mutex whose data stay valid when another thread panics while it holds the lock.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

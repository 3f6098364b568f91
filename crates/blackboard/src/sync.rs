//! The atomics of the standard library, or those of a checker: one source for all.

#[cfg(loom)]
pub(crate) use loom::{
    sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering},
    sync::{Mutex, MutexGuard, RwLock},
    thread::{Thread, current, park},
};
#[cfg(all(not(loom), feature = "shuttle"))]
pub(crate) use shuttle::{
    sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering},
    sync::{Mutex, MutexGuard, RwLock},
    thread::{Thread, current, park, park_timeout},
};
#[cfg(all(not(loom), not(feature = "shuttle")))]
pub(crate) use std::{
    sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering},
    sync::{Mutex, MutexGuard, RwLock},
    thread::{Thread, current, park, park_timeout},
};

/// Waits without a limit, because loom has no time.
#[cfg(loom)]
pub(crate) fn park_timeout(_: std::time::Duration) {
    park();
}

/// Orderings that a mutant weakens, to see that the checkers catch it.
pub(crate) mod order {
    use super::Ordering;

    pub const PUBLISH: Ordering =
        if cfg!(feature = "mutant-ordering") { Ordering::Relaxed } else { Ordering::AcqRel };
    pub const ACQUIRE: Ordering =
        if cfg!(feature = "mutant-ordering") { Ordering::Relaxed } else { Ordering::Acquire };
    pub const RELEASE: Ordering =
        if cfg!(feature = "mutant-ordering") { Ordering::Relaxed } else { Ordering::Release };
}

/// Memory that a protocol guards.
/// Under loom every access is checked against the others.
#[cfg(loom)]
#[derive(Debug)]
pub(crate) struct GuardedCell<T>(loom::cell::UnsafeCell<T>);

#[cfg(loom)]
impl<T> GuardedCell<T> {
    pub fn new(value: T) -> Self {
        Self(loom::cell::UnsafeCell::new(value))
    }

    pub fn read(&self) -> ReadGuard<T> {
        ReadGuard(self.0.get())
    }

    pub fn write<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
        self.0.with_mut(write)
    }
}

/// Access that lasts as long as it lives.
#[cfg(loom)]
#[derive(Debug)]
pub(crate) struct ReadGuard<T>(loom::cell::ConstPtr<T>);

#[cfg(loom)]
impl<T> ReadGuard<T> {
    /// # Safety
    /// No thread writes while this lives.
    pub unsafe fn get(&self) -> &T {
        // SAFETY: passed on to the caller.
        unsafe { self.0.deref() }
    }
}

/// Memory that a protocol guards.
#[cfg(not(loom))]
#[derive(Debug)]
pub(crate) struct GuardedCell<T>(std::cell::UnsafeCell<T>);

#[cfg(not(loom))]
impl<T> GuardedCell<T> {
    pub fn new(value: T) -> Self {
        Self(std::cell::UnsafeCell::new(value))
    }

    #[inline]
    pub fn read(&self) -> ReadGuard<T> {
        ReadGuard(self.0.get())
    }

    #[inline]
    pub fn write<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
        write(self.0.get())
    }
}

/// Access that lasts as long as it lives.
#[cfg(not(loom))]
#[derive(Debug)]
pub(crate) struct ReadGuard<T>(*const T);

#[cfg(not(loom))]
impl<T> ReadGuard<T> {
    /// # Safety
    /// No thread writes while this lives, and the memory outlives it.
    #[inline]
    pub unsafe fn get(&self) -> &T {
        // SAFETY: passed on to the caller.
        unsafe { &*self.0 }
    }
}

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Switch of the recording of spans, on while it has users.
#[derive(Debug, Default)]
pub struct Switch {
    on: AtomicBool,
    users: Mutex<SwitchUsers>,
}

#[derive(Debug, Default)]
struct SwitchUsers {
    /// By the program, which exports them afterwards.
    starts: usize,
    /// By recordings.
    leases: usize,
}

/// Holds a switch on as long as it lives.
#[derive(Debug)]
pub struct Lease(Arc<Switch>);

impl Switch {
    /// Returns true if it is on.
    /// A reader of true also sees the writes before it was switched on.
    #[inline]
    pub fn is_on(&self) -> bool {
        self.on.load(Ordering::Acquire)
    }

    /// Switches on for the program, once more.
    pub fn start(&self) {
        self.change(|users| users.starts += 1);
    }

    /// Takes a start back, if there is one.
    pub fn stop(&self) {
        self.change(|users| users.starts = users.starts.saturating_sub(1));
    }

    /// Switches on for a recording, as long as the lease lives.
    pub fn lease(self: &Arc<Self>) -> Lease {
        self.change(|users| users.leases += 1);
        Lease(Arc::clone(self))
    }

    fn change(&self, change: impl FnOnce(&mut SwitchUsers)) {
        let mut users = self.users.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut users);
        self.on.store(users.starts + users.leases > 0, Ordering::Release);
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.0.change(|users| users.leases -= 1);
    }
}

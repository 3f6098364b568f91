//! Control of an actuator over plain requests: a lease that ends unless renewed.

use std::io::{self, Read};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use slate_runtime::Teleoperation;
use slate_sorted::SortedMap;
use tokio::time::Instant;

/// Time that a lease holds unless renewed.
/// A command holds for much less.
pub const LEASE_DURATION: Duration = Duration::from_secs(5);

/// Period at which expired leases are searched for.
pub const LEASE_CHECK_PERIOD: Duration = Duration::from_millis(250);

/// Leases, by names that only their holders know.
#[derive(Default)]
pub struct Leases(Mutex<SortedMap<String, Lease>>);

struct Lease {
    controls: Teleoperation,
    until: Instant,
}

impl Leases {
    /// Begins a lease of these controls; returns its name.
    pub fn begin(&self, controls: Teleoperation) -> io::Result<String> {
        let name = random_name()?;
        self.all().insert(name.clone(), Lease { controls, until: Instant::now() + LEASE_DURATION });
        Ok(name)
    }

    /// Renews a lease and calls `act` with its controls.
    /// Returns `None` if no lease has that name.
    pub fn renew<R>(&self, name: &str, act: impl FnOnce(&mut Teleoperation) -> R) -> Option<R> {
        let mut all = self.all();
        let lease = all.get_mut(name).filter(|lease| lease.until > Instant::now())?;
        lease.until = Instant::now() + LEASE_DURATION;
        Some(act(&mut lease.controls))
    }

    /// Releases a control lease; false if no lease has that name.
    pub fn end(&self, name: &str) -> bool {
        let ended = self.all().remove(name);
        ended.is_some()
    }

    /// Ends those that were not renewed.
    pub fn end_old(&self) {
        let now = Instant::now();
        let mut all = self.all();
        let old = all.extract_if(|_, lease| lease.until <= now);
        drop(all);
        drop(old);
    }

    fn all(&self) -> MutexGuard<'_, SortedMap<String, Lease>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns a name that can't be guessed.
pub(crate) fn random_name() -> std::io::Result<String> {
    let mut bytes = [0; 8];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

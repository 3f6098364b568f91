//! Controls that somebody has over plain requests: a lease of an actuator, which ends when it is not renewed.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use slate_runtime::Teleoperation;
use tokio::time::Instant;

/// For how long a lease holds that is not renewed. A command holds for much less.
pub const TERM: Duration = Duration::from_secs(5);

/// How often it is looked for leases that are over.
pub const LOOK: Duration = Duration::from_millis(250);

/// The leases, by names that only their holders know.
#[derive(Default)]
pub struct Leases(Mutex<BTreeMap<String, Lease>>);

struct Lease {
    controls: Teleoperation,
    until: Instant,
}

impl Leases {
    /// A lease of these controls, by its name.
    pub fn begin(&self, controls: Teleoperation) -> io::Result<String> {
        let name = random_name()?;
        self.all().insert(name.clone(), Lease { controls, until: Instant::now() + TERM });
        Ok(name)
    }

    /// Renews a lease, and does something with its controls; nothing when there is none of that name.
    pub fn renew<R>(&self, name: &str, act: impl FnOnce(&mut Teleoperation) -> R) -> Option<R> {
        let mut all = self.all();
        let lease = all.get_mut(name).filter(|lease| lease.until > Instant::now())?;
        lease.until = Instant::now() + TERM;
        Some(act(&mut lease.controls))
    }

    /// Releases a control lease; false when there is no lease of that name.
    pub fn end(&self, name: &str) -> bool {
        let ended = self.all().remove(name);
        ended.is_some()
    }

    /// Ends those that were not renewed.
    pub fn end_old(&self) {
        let now = Instant::now();
        let mut all = self.all();
        let old: Vec<_> = all.extract_if(.., |_, lease| lease.until <= now).collect();
        drop(all);
        drop(old);
    }

    fn all(&self) -> MutexGuard<'_, BTreeMap<String, Lease>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A name that nobody guesses.
pub(crate) fn random_name() -> std::io::Result<String> {
    let mut bytes = [0; 8];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

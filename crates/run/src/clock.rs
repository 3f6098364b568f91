//! Wall clock.

use std::time::Instant;

/// Returns the current time of the machine's monotonic clock.
#[allow(clippy::disallowed_methods, reason = "terminals and processes live by the wall clock")]
pub fn now() -> Instant {
    Instant::now()
}

//! Filter of repeated requests for the log.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use slate_sorted::SortedMap;
use tokio::time::Instant;

/// Time after which the same request counts as new again.
const REPEAT_PERIOD: Duration = Duration::from_secs(10);

/// Number of requests that are remembered.
const MAX_REQUESTS: usize = 256;

/// Requests of the last seconds.
#[derive(Default)]
pub(crate) struct RepeatFilter(Mutex<SortedMap<String, Instant>>);

impl RepeatFilter {
    /// Returns whether a request was not made a moment ago.
    pub fn is_new(&self, request: &str) -> bool {
        let now = Instant::now();
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= MAX_REQUESTS {
            known.retain(|_, last| now.duration_since(*last) < REPEAT_PERIOD);
            if known.len() >= MAX_REQUESTS {
                known.clear();
            }
        }
        let last = known.insert(request.to_owned(), now);
        last.is_none_or(|last| now.duration_since(last) >= REPEAT_PERIOD)
    }
}

//! Values as they come.

use std::collections::VecDeque;
use std::ffi::c_char;
use std::time::{Duration, Instant};

use slate_control::{Client, Reading, Watched};

use crate::agent::SlateAgent;
use crate::boundary::{SlateSample, attempt, borrow, text};
use crate::error::{ClientFailure, SlateError};

/// Longest wait of one request; a longer one is repeated.
const REQUEST: Duration = Duration::from_secs(5);

/// Values of a property as they come, until `slate_watch_free`.
/// It has a connection of its own. One thread uses it at a time.
#[derive(Debug)]
pub struct SlateWatch {
    client: Client,
    url: String,
    after: Option<u64>,
    /// Values that have come, with the number of those missed before each.
    came: VecDeque<(Reading, u64)>,
}

impl SlateWatch {
    /// Returns the next value; `None` if none comes in time.
    fn next(&mut self, timeout: Duration) -> Result<Option<SlateSample>, ClientFailure> {
        #[allow(clippy::disallowed_methods, reason = "a program's own time, not that of a module")]
        let end = Instant::now() + timeout;
        loop {
            if let Some((reading, missed)) = self.came.pop_front() {
                return Ok(Some(SlateSample::new(&reading, missed)));
            }
            #[allow(clippy::disallowed_methods, reason = "as above")]
            let left = end.saturating_duration_since(Instant::now());
            let watched = Watched { url: self.url.clone(), after: self.after };
            for update in self.client.watch(&[watched], left.min(REQUEST))? {
                let missed = std::iter::once(update.missed).chain(std::iter::repeat(0));
                self.after = update.readings.last().map_or(self.after, |last| Some(last.sequence));
                self.came.extend(update.readings.into_iter().zip(missed));
            }
            if self.came.is_empty() && left.is_zero() {
                return Ok(None);
            }
        }
    }
}

/// Begins to watch a property or a field; its newest value is the first one.
/// Returns NULL on an error.
///
/// # Safety
/// The agent came from this library and was not freed; the text ends with a zero byte; `error` is null or a place for a
/// pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_agent_watch(
    agent: *const SlateAgent,
    url: *const c_char,
    error: *mut *mut SlateError,
) -> *mut SlateWatch {
    let open = || {
        // SAFETY: passed on to the caller.
        let (agent, url) = unsafe { (borrow(agent, "agent")?, text(url, "the URL")?) };
        let mut client = agent.target.connect()?;
        // An unknown URL is found here rather than at the first value.
        client.read(url)?;
        let watch = SlateWatch { client, url: url.to_owned(), after: None, came: VecDeque::new() };
        Ok(Box::into_raw(Box::new(watch)))
    };
    // SAFETY: as above.
    unsafe { attempt(error, open) }.unwrap_or(std::ptr::null_mut())
}

/// Waits for the next value for at most `timeout` seconds.
/// Returns 1 with it in `sample`, 0 if none comes in time, and -1 on an error.
///
/// # Safety
/// The watch came from this library and was not freed, and no other thread uses it; `sample` is a place for a sample;
/// `error` is null or a place for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_watch_next(
    watch: *mut SlateWatch,
    timeout: f64,
    sample: *mut SlateSample,
    error: *mut *mut SlateError,
) -> i32 {
    let next = || {
        // SAFETY: passed on to the caller.
        let watch = unsafe { watch.as_mut() };
        let watch = watch.ok_or_else(|| {
            ClientFailure::invalid("the watch is NULL".into(), "see the error of slate_agent_watch")
        })?;
        let within = Duration::try_from_secs_f64(timeout.clamp(0.0, 1e9)).map_err(|_| {
            ClientFailure::invalid("the timeout is not a number".into(), "pass seconds, such as 5.0")
        })?;
        let Some(came) = watch.next(within)? else { return Ok(0) };
        // SAFETY: as above.
        unsafe { sample.write(came) };
        Ok(1)
    };
    // SAFETY: as above.
    unsafe { attempt(error, next) }.unwrap_or(-1)
}

/// Ends a watch; null is allowed.
///
/// # Safety
/// `watch` is null, or came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_watch_free(watch: *mut SlateWatch) {
    if !watch.is_null() {
        // SAFETY: `slate_agent_watch` has made it as a box.
        drop(unsafe { Box::from_raw(watch) });
    }
}

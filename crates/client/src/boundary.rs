//! Arguments and samples between C and Rust, and calls that no panic leaves.

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use serde_json::Value as Json;
use slate_control::Reading;

use crate::error::{ClientFailure, SlateError};
use crate::text::give;

/// Value of a property.
/// The text belongs to the caller, who frees it with `slate_text_free`.
#[repr(C)]
#[derive(Debug)]
pub struct SlateSample {
    /// Value as JSON; null before the first write.
    pub json: *mut c_char,
    /// Number of values written up to this one; 0 before the first write.
    pub sequence: u64,
    /// Agent's time of the write, s.
    pub time: f64,
    /// Number of values before this one that the reader was too slow for.
    pub missed: u64,
}

impl SlateSample {
    /// Returns the sample of a value.
    pub(crate) fn new(reading: &Reading, missed: u64) -> Self {
        Self {
            json: give(reading.value.to_string()),
            sequence: reading.sequence,
            time: reading.time as f64 * 1e-9,
            missed,
        }
    }

    /// Sample of a property that was never written.
    pub(crate) const NONE: Self = Self { json: std::ptr::null_mut(), sequence: 0, time: 0.0, missed: 0 };
}

/// Runs a call, and stores its error in `error` unless that is null.
/// A panic is an error, too.
///
/// # Safety
/// `error` is null or a place for a pointer.
pub(crate) unsafe fn attempt<R>(
    error: *mut *mut SlateError,
    call: impl FnOnce() -> Result<R, ClientFailure>,
) -> Option<R> {
    let result = catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(ClientFailure::internal("the client panicked; its message is on stderr")));
    let failure = match result {
        Ok(value) => return Some(value),
        Err(failure) => failure,
    };
    if !error.is_null() {
        // SAFETY: passed on to the caller.
        unsafe { error.write(Box::into_raw(Box::new(SlateError::new(failure)))) };
    }
    None
}

/// Reads a text of the caller.
///
/// # Safety
/// `text` is null, or ends with a zero byte and lives during `'a`.
pub(crate) unsafe fn text<'a>(text: *const c_char, what: &str) -> Result<&'a str, ClientFailure> {
    if text.is_null() {
        return Err(ClientFailure::invalid(format!("{what} is NULL"), "pass a text"));
    }
    // SAFETY: passed on to the caller.
    unsafe { CStr::from_ptr(text) }
        .to_str()
        .map_err(|_| ClientFailure::invalid(format!("{what} is no UTF-8"), "pass a text in UTF-8"))
}

/// As [`text`]; `None` for null and an empty text.
///
/// # Safety
/// As for [`text`].
pub(crate) unsafe fn optional<'a>(
    pointer: *const c_char,
    what: &str,
) -> Result<Option<&'a str>, ClientFailure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: passed on to the caller.
    unsafe { text(pointer, what) }.map(|text| Some(text).filter(|text| !text.is_empty()))
}

/// Reads JSON of the caller.
///
/// # Safety
/// As for [`text`].
pub(crate) unsafe fn json(pointer: *const c_char, what: &str) -> Result<Json, ClientFailure> {
    // SAFETY: passed on to the caller.
    let text = unsafe { text(pointer, what) }?;
    serde_json::from_str(text).map_err(|error| {
        ClientFailure::invalid(
            format!("{what} is no JSON: {error}"),
            "pass a number such as 0.3, a text in quotes, or fields such as {\"x\": 1.0}",
        )
    })
}

/// Borrows an object of the caller.
///
/// # Safety
/// `object` is null, or came from this library and was not freed.
pub(crate) unsafe fn borrow<'a, T>(object: *const T, what: &str) -> Result<&'a T, ClientFailure> {
    // SAFETY: passed on to the caller.
    unsafe { object.as_ref() }.ok_or_else(|| {
        ClientFailure::invalid(format!("the {what} is NULL"), "see the error of the call that made it")
    })
}

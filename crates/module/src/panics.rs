//! Source locations of panics, for the log of the module.
//! Only the panic hook gets the location.
//!
//! A caught panic is logged, so nothing else is printed. Printing a backtrace takes longer than many a cycle;
//! `RUST_BACKTRACE=full` requests it.

use std::any::Any;
use std::cell::Cell;
use std::fmt::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

/// Source file and line; a long path is truncated.
#[derive(Clone, Copy)]
pub(crate) struct PanicLocation {
    text: [u8; 120],
    length: usize,
}

thread_local! {
    /// Location of this thread's last panic.
    /// It has nothing to drop: a thread's destructors would keep the library of the module open.
    static LAST_LOCATION: Cell<Option<PanicLocation>> = const { Cell::new(None) };
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Installs a panic hook that records locations.
/// It passes panics that are not caught here on to the previous hook.
pub(crate) fn record_locations() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let is_full = std::env::var_os("RUST_BACKTRACE").is_some_and(|wanted| wanted == "full");
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let location = panic.location().map(|source| {
                let mut location = PanicLocation { text: [0; 120], length: 0 };
                // The rest is cut.
                let _ = write!(location, "{}:{}", source.file(), source.line());
                location
            });
            // A second panic before the first was caught ends the process.
            let is_first = LAST_LOCATION.replace(location).is_none();
            if is_full || !(is_first && IS_CAUGHT.get()) {
                before(panic);
            }
        }));
    });
}

/// Runs a call whose panics are caught, for the log.
#[inline]
pub(crate) fn catch<R>(call: impl FnOnce() -> R) -> std::thread::Result<R> {
    run_caught(true, call)
}

/// Runs a call whose panics are caught and ignored; they are printed as usual.
pub(crate) fn catch_silently<R>(call: impl FnOnce() -> R) -> std::thread::Result<R> {
    let result = run_caught(false, call);
    let _ = take_location();
    result
}

#[inline]
fn run_caught<R>(is_caught: bool, call: impl FnOnce() -> R) -> std::thread::Result<R> {
    let before = exchange_caught(is_caught);
    let result = catch_unwind(AssertUnwindSafe(call));
    exchange_caught(before);
    result
}

/// Sets whether this thread's next panic is caught; returns what was set before.
/// It is a function, as the access to a thread's variable takes several calls in the crates of modules.
fn exchange_caught(is_caught: bool) -> bool {
    IS_CAUGHT.replace(is_caught)
}

/// Takes the location of this thread's last panic.
pub(crate) fn take_location() -> Option<PanicLocation> {
    LAST_LOCATION.take()
}

/// Drops the payload of a panic, which may itself panic.
pub(crate) fn discard(payload: Box<dyn Any + Send>) {
    let _ = catch_silently(move || drop(payload));
}

/// Returns the message of a panic that was just caught, with its location.
pub(crate) fn placed_message(payload: &(dyn Any + Send)) -> String {
    let message = panic_message(payload);
    match take_location() {
        Some(location) => format!("{message} (at {location})"),
        None => message,
    }
}

pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    format!("panicked: {}", text.unwrap_or("without a message"))
}

impl Write for PanicLocation {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = &mut self.text[self.length..];
        let length = text.floor_char_boundary(room.len());
        room[..length].copy_from_slice(&text.as_bytes()[..length]);
        self.length += length;
        if length < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}

impl fmt::Display for PanicLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(std::str::from_utf8(&self.text[..self.length]).unwrap_or_default())
    }
}

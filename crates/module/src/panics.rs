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
pub(crate) struct PanicPlace {
    text: [u8; 120],
    length: usize,
}

thread_local! {
    /// Location of this thread's last panic.
    /// It has nothing to drop: a thread's destructors would keep the library of the module open.
    static LAST: Cell<Option<PanicPlace>> = const { Cell::new(None) };
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Installs a panic hook that records locations.
/// It passes panics that nobody catches here on to the hook before it.
pub(crate) fn remember() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let is_full = std::env::var_os("RUST_BACKTRACE").is_some_and(|wanted| wanted == "full");
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let place = panic.location().map(|location| {
                let mut place = PanicPlace { text: [0; 120], length: 0 };
                // What doesn't fit is cut.
                let _ = write!(place, "{}:{}", location.file(), location.line());
                place
            });
            // A second panic before the first was caught ends the process.
            let is_first = LAST.replace(place).is_none();
            if is_full || !(is_first && IS_CAUGHT.get()) {
                before(panic);
            }
        }));
    });
}

/// Runs a call whose panics are caught, for the log.
#[inline]
pub(crate) fn catch<R>(call: impl FnOnce() -> R) -> std::thread::Result<R> {
    run(true, call)
}

/// Runs a call whose panics are caught and ignored; they are printed as usual.
pub(crate) fn catch_aside<R>(call: impl FnOnce() -> R) -> std::thread::Result<R> {
    let result = run(false, call);
    let _ = take();
    result
}

#[inline]
fn run<R>(is_caught: bool, call: impl FnOnce() -> R) -> std::thread::Result<R> {
    let before = IS_CAUGHT.replace(is_caught);
    let result = catch_unwind(AssertUnwindSafe(call));
    IS_CAUGHT.set(before);
    result
}

/// Takes the location of this thread's last panic.
pub(crate) fn take() -> Option<PanicPlace> {
    LAST.take()
}

/// Drops the payload of a panic, which may itself panic.
pub(crate) fn discard(payload: Box<dyn Any + Send>) {
    let _ = catch_aside(move || drop(payload));
}

/// Returns the message of a panic that was just caught, with its location.
pub(crate) fn placed_message(payload: &(dyn Any + Send)) -> String {
    let message = panic_message(payload);
    match take() {
        Some(place) => format!("{message} (at {place})"),
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

impl Write for PanicPlace {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = &mut self.text[self.length..];
        let length = text.floor_char_boundary(room.len());
        room[..length].copy_from_slice(&text.as_bytes()[..length]);
        self.length += length;
        if length < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}

impl fmt::Display for PanicPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(std::str::from_utf8(&self.text[..self.length]).unwrap_or_default())
    }
}

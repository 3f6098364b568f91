//! What calls of services take and give.

use slate_blackboard::Pattern;
use slate_module::table::{Bytes, Sink};

/// # Safety
/// The sink is as the module made it.
pub(super) unsafe fn say(sink: *const Sink, text: &str) {
    // SAFETY: passed on to the caller.
    unsafe { ((*sink).write)((*sink).context, text.as_ptr(), text.len()) }
}

/// # Safety
/// The bytes are readable during the call.
pub(super) unsafe fn text(bytes: Bytes) -> String {
    // SAFETY: passed on to the caller.
    String::from_utf8_lossy(unsafe { bytes.as_slice() }).into_owned()
}

/// A name as it stands in the module's memory; what is no text is no name of anything either.
///
/// # Safety
/// The bytes are readable during `'a`.
pub(super) unsafe fn name<'a>(bytes: Bytes) -> &'a str {
    // SAFETY: passed on to the caller.
    std::str::from_utf8(unsafe { bytes.as_slice() }).unwrap_or("\u{fffd}")
}

/// The pattern that every path is meant by.
pub(super) fn every_path() -> Pattern {
    Pattern::parse("**").unwrap_or_else(|_| unreachable!("`**` is a pattern"))
}

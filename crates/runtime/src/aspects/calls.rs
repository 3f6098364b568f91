//! What the calls of services have in common.

use slate_blackboard::Pattern;
use slate_module::table::{Bytes, Sink};

/// Tells the module something in words.
///
/// # Safety
/// The sink is as the module made it.
pub(super) unsafe fn say(sink: *const Sink, text: &str) {
    // SAFETY: passed on to the caller.
    unsafe { ((*sink).write)((*sink).context, text.as_ptr(), text.len()) }
}

/// A text of the module; empty when it is none.
///
/// # Safety
/// The bytes are readable during the call.
pub(super) unsafe fn text<'a>(bytes: Bytes) -> &'a str {
    // SAFETY: passed on to the caller.
    std::str::from_utf8(unsafe { bytes.as_slice() }).unwrap_or_default()
}

/// The pattern that every path is meant by.
pub(super) fn every_path() -> Pattern {
    Pattern::parse("**").unwrap_or_else(|_| unreachable!("`**` is a pattern"))
}

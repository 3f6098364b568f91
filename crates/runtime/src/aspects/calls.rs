//! Arguments and results of service calls.

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

/// Returns a name in the module's memory.
/// Bytes that are no UTF-8 become a name that nothing has.
///
/// # Safety
/// The bytes are readable during `'a`.
pub(super) unsafe fn name<'a>(bytes: Bytes) -> &'a str {
    // SAFETY: passed on to the caller.
    std::str::from_utf8(unsafe { bytes.as_slice() }).unwrap_or("\u{fffd}")
}

/// Pattern of all paths.
pub(super) fn every_path() -> Pattern {
    Pattern::parse("**").unwrap_or_else(|_| unreachable!("`**` is a pattern"))
}

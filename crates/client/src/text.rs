//! Texts that calls return.

use std::ffi::{CString, c_char};

/// Gives a text to the caller; it ends at its first zero byte.
pub(crate) fn give(text: String) -> *mut c_char {
    let mut bytes = text.into_bytes();
    if let Some(zero) = bytes.iter().position(|byte| *byte == 0) {
        bytes.truncate(zero);
    }
    // Without a zero byte it is a text of C.
    CString::new(bytes).unwrap_or_default().into_raw()
}

/// Frees a text that a call returned; null is allowed.
///
/// # Safety
/// `text` is null, or came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn slate_text_free(text: *mut c_char) {
    if !text.is_null() {
        // SAFETY: `give` made it.
        drop(unsafe { CString::from_raw(text) });
    }
}

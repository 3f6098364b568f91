//! Library file whose description is read before its code.

use std::path::PathBuf;
use std::sync::OnceLock;

use crate::memory::within;
use slate_runtime::plugin::LibraryOutline;

/// Reads a file of those bytes.
pub fn run(bytes: &[u8]) {
    static FILE: OnceLock<PathBuf> = OnceLock::new();
    let file = FILE.get_or_init(|| crate::folder().join("library.so"));
    std::fs::write(file, bytes).expect("there is room");
    let read = within((1 << 20) + 64 * bytes.len(), || LibraryOutline::read(file));
    match read {
        Ok(outline) => assert!(!outline.name.is_empty(), "a plugin without a name"),
        Err(error) => assert!(error.to_string().contains("library.so"), "{error} names no file"),
    }
}

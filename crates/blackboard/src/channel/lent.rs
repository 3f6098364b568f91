use std::fmt;
use std::ptr::NonNull;

/// Bytes of a value that are read in place, in memory that a channel does not own.
/// Dropping this gives them back, in whatever thread writes to the channel, or drops the last handle of it.
///
/// # Safety
/// Until this is dropped the bytes are initialized, stay at their address and unchanged, and can be read by all threads.
/// Moving this does not move them. Where another process could change them all the same, only such values may be lent
/// in which every bit pattern is valid: then it spoils values and nothing more.
pub unsafe trait LentBytes: fmt::Debug + Send + Sync {
    /// Returns the bytes; the same ones at each call.
    fn bytes(&self) -> NonNull<[u8]>;
}

/// Bytes that a slot shows instead of its own memory.
#[derive(Debug)]
pub(super) struct Lent {
    pub slot: u16,
    /// Kept for what its drop does.
    pub _bytes: Box<dyn LentBytes>,
}

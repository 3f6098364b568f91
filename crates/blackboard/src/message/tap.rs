use std::fmt;
use std::sync::{Arc, OnceLock};

use super::Message;
use crate::Stamp;

/// Observer of every value of a channel, or every message of a mailbox.
/// The writer of the values does not matter.
pub trait Tap: Send + Sync {
    /// Notes a published value of `items` tail items.
    /// Called in the thread of the writer, which waits for it.
    fn wrote(&self, bytes: &[u8], items: usize, stamp: Stamp);

    /// Notes a message that is processed from the host's time `now` on, nanoseconds.
    /// Called in the thread of the receiver, which waits for it.
    fn took(&self, message: &Message<'_>, now: u64) {
        let _ = (message, now);
    }
}

/// Observer of the values.
#[derive(Default)]
pub(crate) struct TapCell(OnceLock<Arc<dyn Tap>>);

impl TapCell {
    pub fn set(&self, tap: Arc<dyn Tap>) {
        // The first one stays, as a writer looks without a lock.
        let _ = self.0.set(tap);
    }

    #[inline]
    pub fn get(&self) -> Option<&dyn Tap> {
        self.0.get().map(|tap| &**tap)
    }
}

impl fmt::Debug for TapCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.get().is_some() { "Tapped(set)" } else { "Tapped(none)" })
    }
}

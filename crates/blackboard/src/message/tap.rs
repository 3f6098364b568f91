use std::fmt;
use std::sync::{Arc, OnceLock};

use super::Message;
use crate::Stamp;

/// Sees every value of a channel, whoever writes it, or every message of a mailbox.
pub trait Tap: Send + Sync {
    /// A value of `items` tail items was published. It is called in the thread of the writer, which waits for it.
    fn wrote(&self, bytes: &[u8], items: usize, stamp: Stamp);

    /// A message is dealt with from the host's time `now` on, nanoseconds. It is called in the thread of the receiver, which
    /// waits for it.
    fn took(&self, message: &Message<'_>, now: u64) {
        let _ = (message, now);
    }
}

/// Who sees the values.
#[derive(Default)]
pub(crate) struct Tapped(OnceLock<Arc<dyn Tap>>);

impl Tapped {
    pub fn set(&self, tap: Arc<dyn Tap>) {
        // The first one stays, as a writer looks without a lock.
        let _ = self.0.set(tap);
    }

    #[inline]
    pub fn get(&self) -> Option<&dyn Tap> {
        self.0.get().map(|tap| &**tap)
    }
}

impl fmt::Debug for Tapped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.get().is_some() { "Tapped(set)" } else { "Tapped(none)" })
    }
}

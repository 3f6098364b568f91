use std::fmt;
use std::sync::OnceLock;

/// Change of the handles: one came or left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HandleChange {
    /// The writer of that generation.
    WriterCame(u64),
    /// The writer of that generation.
    WriterLeft(u64),
    /// A reader.
    ReaderCame,
    /// A reader.
    ReaderLeft,
}

/// Callback for handles that come and go.
#[derive(Default)]
pub(super) struct Hook(OnceLock<Box<dyn Fn(HandleChange) + Send + Sync>>);

impl Hook {
    pub fn set(&self, call: impl Fn(HandleChange) + Send + Sync + 'static) {
        // A channel belongs to one property, so it is set once.
        let _ = self.0.set(Box::new(call));
    }

    pub fn call(&self, link: HandleChange) {
        if let Some(call) = self.0.get() {
            call(link);
        }
    }
}

impl fmt::Debug for Hook {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.get().is_some() { "Hook(set)" } else { "Hook(none)" })
    }
}

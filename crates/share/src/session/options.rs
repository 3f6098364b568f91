use serde::{Deserialize, Serialize};

/// How a subscription is served; each subscriber of a property may want it otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Options {
    /// When a value is sent.
    pub mode: Mode,
    /// Whether all values are sent or the newest.
    pub content: Content,
    /// Whether what was lost on the way is sent again: each value of a queue, and the newest value otherwise.
    pub reliable: bool,
    /// Whether values are made smaller on the way.
    pub compression: Compression,
}

/// When a value is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// When it was written, but not earlier than so many nanoseconds after the one before.
    OnChange(u64),
    /// Every so many nanoseconds, if it was written since.
    Periodic(u64),
}

/// What of a property is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// The newest value.
    Newest,
    /// Every value that is still kept, in order; what is not is counted.
    All,
}

/// How values are made smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compression {
    /// Not at all.
    None,
    /// Without loss, where that pays.
    Lossless,
    /// Images as JPEG of that quality (1 to 100), others without loss; all without loss where the agent that sends them
    /// is built without the feature `jpeg`.
    Jpeg(u8),
}

impl Default for Options {
    /// The newest value, on change and reliably, without loss.
    fn default() -> Self {
        Self {
            mode: Mode::OnChange(0),
            content: Content::Newest,
            reliable: true,
            compression: Compression::Lossless,
        }
    }
}

impl Options {
    /// Every value, in order.
    pub fn queue() -> Self {
        Self { content: Content::All, ..Self::default() }
    }

    /// What is lost on the way stays lost.
    #[must_use]
    pub fn best_effort(self) -> Self {
        Self { reliable: false, ..self }
    }

    /// Values follow each other by that many nanoseconds at least.
    #[must_use]
    pub fn minimum_interval(self, interval: u64) -> Self {
        Self { mode: Mode::OnChange(interval), ..self }
    }

    /// A value is sent that often, every so many nanoseconds.
    #[must_use]
    pub fn periodic(self, period: u64) -> Self {
        Self { mode: Mode::Periodic(period), ..self }
    }

    /// Whether values are left out because nobody wants them so often.
    pub(super) fn thins(&self) -> bool {
        let is_limited = match self.mode {
            Mode::OnChange(interval) => interval > 0,
            Mode::Periodic(_) => true,
        };
        is_limited && self.content == Content::Newest
    }

    /// Values are made smaller in that way.
    #[must_use]
    pub fn compression(self, compression: Compression) -> Self {
        Self { compression, ..self }
    }
}

/// What a session takes at most, so that whatever comes, its memory is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one value or message, also once it is unpacked.
    pub value: usize,
    /// Subscriptions in each direction.
    pub subscriptions: usize,
    /// Bytes of control messages that wait for the other side.
    pub control: usize,
    /// Bytes of a stream that are sent and not confirmed, beside the value that is on its way; and bytes that are
    /// kept because something before them is missing.
    pub window: usize,
    /// How long nothing may be heard of the other agent, nanoseconds.
    pub silence: u64,
    /// How often an agent shows that it is there, nanoseconds.
    pub heartbeat: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            value: 16 << 20,
            subscriptions: 1024,
            control: 4 << 20,
            window: 256 << 10,
            silence: 300_000_000,
            heartbeat: 50_000_000,
        }
    }
}

use serde::{Deserialize, Serialize};

/// Delivery options of a subscription; each subscriber chooses its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Options {
    /// Timing of values.
    pub mode: Mode,
    /// Selection of values.
    pub content: Content,
    /// Reliable delivery: retransmission of lost values.
    /// It covers each value of a queue, and otherwise the newest value.
    pub reliable: bool,
    /// Compression of values.
    pub compression: Compression,
}

/// Timing of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// After each write, with at least that interval between two values, ns.
    OnChange(u64),
    /// Period, ns; a value is sent if it was written since the last one.
    Periodic(u64),
}

/// Values of a property that are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// Newest value only.
    Newest,
    /// All values that are still kept, in order; others are counted.
    All,
}

/// Compression of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compression {
    /// No compression.
    None,
    /// Lossless compression where it pays.
    Lossless,
    /// JPEG of that quality (1 to 100) for images, lossless compression otherwise.
    /// Always lossless if the sending agent is built without the feature `jpeg`.
    Jpeg(u8),
}

impl Default for Options {
    /// Newest value, on change, reliable, lossless.
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
    /// Creates options for every value, in order.
    pub fn queue() -> Self {
        Self { content: Content::All, ..Self::default() }
    }

    /// Turns retransmission of lost values off.
    #[must_use]
    pub fn best_effort(self) -> Self {
        Self { reliable: false, ..self }
    }

    /// Sets the minimum interval between values, ns.
    #[must_use]
    pub fn minimum_interval(self, interval: u64) -> Self {
        Self { mode: Mode::OnChange(interval), ..self }
    }

    /// Sets the period of values, ns.
    #[must_use]
    pub fn periodic(self, period: u64) -> Self {
        Self { mode: Mode::Periodic(period), ..self }
    }

    /// Returns whether the options reduce the rate of values.
    pub(super) fn thins(&self) -> bool {
        let is_limited = match self.mode {
            Mode::OnChange(interval) => interval > 0,
            Mode::Periodic(_) => true,
        };
        is_limited && self.content == Content::Newest
    }

    /// Sets the compression of values.
    #[must_use]
    pub fn compression(self, compression: Compression) -> Self {
        Self { compression, ..self }
    }
}

/// Limits of a session, which bound its memory for any input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest value or message, also after decompression, bytes.
    pub value: usize,
    /// Largest number of subscriptions in each direction.
    pub subscriptions: usize,
    /// Largest size of control messages waiting for the other side, bytes.
    pub control: usize,
    /// Window of a stream, bytes.
    /// The sender keeps at most that many unconfirmed bytes beside the value in transfer, the receiver that many after
    /// a missing fragment.
    pub window: usize,
    /// Longest silence of the other agent, ns.
    pub silence: u64,
    /// Heartbeat period, ns.
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

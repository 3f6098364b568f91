use std::cmp::Reverse;

/// What a span is called: a module or a stage. Made once, so that recording copies a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label(pub(super) u32);

/// Something that took some time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// What.
    pub label: Label,
    /// When it began, the agent's time in nanoseconds.
    pub start: u64,
    /// How long it took, nanoseconds.
    pub duration: u64,
    /// The number of the main loop's cycle.
    pub cycle: u64,
}

impl Span {
    #[inline]
    pub(super) fn to_words(self) -> [u64; 4] {
        [u64::from(self.label.0), self.start, self.duration, self.cycle]
    }

    pub(super) fn from_words([label, start, duration, cycle]: [u64; 4]) -> Self {
        Self { label: Label(label as u32), start, duration, cycle }
    }

    pub(super) fn end(&self) -> u64 {
        self.start.saturating_add(self.duration)
    }

    /// What began first stands first, and around what began with it.
    pub(super) fn order(&self) -> (u64, Reverse<u64>) {
        (self.start, Reverse(self.duration))
    }

    pub(super) fn is_within(&self, from: u64, to: u64) -> bool {
        self.start < to && (self.end() > from || self.start >= from)
    }
}

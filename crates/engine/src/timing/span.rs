use std::cmp::Reverse;

/// Label of a span, such as a module or a stage.
/// Made once, so that recording copies a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label(pub(super) u32);

/// Span of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Name.
    pub label: Label,
    /// Begin, ns of the agent's time.
    pub start: u64,
    /// Duration, ns.
    pub duration: u64,
    /// Number of the main loop's cycle.
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

    /// Returns the sort key: by beginning; of equal ones the longest first.
    pub(super) fn order(&self) -> (u64, Reverse<u64>) {
        (self.start, Reverse(self.duration))
    }

    pub(super) fn is_within(&self, from: u64, to: u64) -> bool {
        self.start < to && (self.end() > from || self.start >= from)
    }
}

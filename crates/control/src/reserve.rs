//! A descriptor in reserve, so that a stop comes through when no other is left.

use std::fs::File;

/// A descriptor that is given up for one brief connection at a time when the process has no other for it.
#[derive(Debug)]
pub struct DescriptorReserve(Option<File>);

impl DescriptorReserve {
    /// Takes a descriptor. Without one now there is none in reserve either.
    pub fn take() -> Self {
        Self(File::open("/dev/null").ok())
    }

    /// Gives the descriptor up; false when there is none.
    pub fn give(&mut self) -> bool {
        self.0.take().is_some()
    }

    /// Whether it is given up.
    pub fn is_given(&self) -> bool {
        self.0.is_none()
    }

    /// Takes a descriptor again, as soon as there is one.
    pub fn refill(&mut self) {
        if self.is_given() {
            *self = Self::take();
        }
    }
}

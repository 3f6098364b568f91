//! Reserve descriptor, so that a stop comes through when no other is left.

use std::fs::File;

/// Reserve file descriptor for one brief connection at a time.
/// It is given up when the process has no other for the connection.
#[derive(Debug)]
pub struct DescriptorReserve(Option<File>);

impl DescriptorReserve {
    /// Opens the reserve descriptor; without a free one, the reserve is empty.
    pub fn take() -> Self {
        Self(File::open("/dev/null").ok())
    }

    /// Gives the descriptor up; false if the reserve is empty.
    pub fn give(&mut self) -> bool {
        self.0.take().is_some()
    }

    /// Returns whether it is given up.
    pub fn is_given(&self) -> bool {
        self.0.is_none()
    }

    /// Opens the descriptor again, as soon as one is free.
    pub fn refill(&mut self) {
        if self.is_given() {
            *self = Self::take();
        }
    }
}

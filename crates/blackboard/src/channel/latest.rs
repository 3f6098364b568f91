use std::sync::Arc;

use super::pool::{Held, Loan};
use super::{Channel, Link};
use crate::Stamp;

/// A reader of the newest value. It pins the value that it has seen last, and at times a candidate for the next.
#[derive(Debug)]
pub struct Latest {
    channel: Arc<Channel>,
    held: Option<Held>,
    sequence: u64,
    candidate: Option<Held>,
    /// Whether it is not counted.
    probe: bool,
}

impl Latest {
    pub(super) fn new(channel: Arc<Channel>, probe: bool) -> Self {
        Self { channel, held: None, sequence: 0, candidate: None, probe }
    }

    /// Whether a newer value is there than the one held.
    #[inline]
    pub fn has_news(&self) -> bool {
        self.channel.published() > self.sequence
    }

    /// Takes over the newest value; false when the one held is the newest.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        self.propose() && self.accept()
    }

    /// The value held; nothing before the first write.
    #[inline]
    pub fn value(&self) -> Option<Loan<'_>> {
        // SAFETY: the pin is not given back until `self` is used mutably.
        self.held.map(|held| unsafe { held.lend() })
    }

    /// The number of the value that it has seen last; 0 before the first.
    pub fn cursor(&self) -> u64 {
        self.sequence
    }

    /// Goes on as a reader that has seen the values until that number. It holds the newest one, if that is the one; else
    /// none before it is refreshed.
    pub fn resume(&mut self, cursor: u64) {
        self.reject();
        if let Some(held) = self.held.take() {
            held.give_back();
        }
        self.sequence = 0;
        if cursor < self.channel.published() {
            self.sequence = cursor;
        } else {
            self.refresh();
        }
    }

    /// Copies the value held, as much of it as fits; says how many items its tail has, and its stamp.
    pub fn copy_to(&self, target: &mut [u8]) -> Option<(usize, Stamp)> {
        let loan = self.value()?;
        let bytes = loan.bytes();
        let length = bytes.len().min(target.len());
        target[..length].copy_from_slice(&bytes[..length]);
        Some((loan.items(), loan.stamp()))
    }

    /// Pins the newest value beside the one held; false when that is the newest.
    #[inline]
    pub fn propose(&mut self) -> bool {
        let tail = self.channel.published();
        if tail <= self.sequence {
            return false;
        }
        // A handle never has more than two pins: that is what the pool counts with.
        self.reject();
        // What stands in the cell is the value of that number, or a newer one.
        self.candidate = Some(self.channel.pool.pin(self.channel.cell(tail)));
        true
    }

    /// The candidate, if there is one, becomes the value held; says whether there was one.
    #[inline]
    pub fn accept(&mut self) -> bool {
        let Some(candidate) = self.candidate.take() else { return false };
        if let Some(old) = self.held.replace(candidate) {
            old.give_back();
        }
        self.sequence = candidate.sequence();
        true
    }

    /// The candidate is given back.
    #[inline]
    pub fn reject(&mut self) {
        if let Some(candidate) = self.candidate.take() {
            candidate.give_back();
        }
    }
}

impl Drop for Latest {
    fn drop(&mut self) {
        self.reject();
        if let Some(held) = self.held.take() {
            held.give_back();
        }
        let mut desk = self.channel.desk();
        desk.latest -= 1;
        desk.probes -= u16::from(self.probe);
        drop(desk);
        if !self.probe {
            self.channel.hook.call(Link::ReaderLeft);
        }
    }
}

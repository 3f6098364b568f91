use std::collections::VecDeque;
use std::sync::Arc;

use slate_sorted::SortedSet;

use super::Content;
use super::wire::{Announcement, StreamReport};

/// Most fragments that are sent and not confirmed.
const MAX_FRAGMENTS_IN_FLIGHT: usize = 512;

/// Sending end of a stream, which cuts items into fragments.
/// A reliable stream keeps them until they are confirmed.
#[derive(Debug)]
pub(super) struct Outbound {
    reliable: bool,
    content: Content,
    /// Largest size of fragments in flight, bytes.
    window: usize,
    /// Number of the next fragment.
    next: u64,
    /// Unconfirmed fragments, from number `next - flight.len()` on.
    unconfirmed: VecDeque<Part>,
    bytes_in_flight: usize,
    /// Unsent rest of the current item.
    unsent: Option<UnsentItem>,
    retransmissions: SortedSet<u64>,
    /// Number before which all fragments are confirmed or obsolete.
    confirmed: u64,
    announce_at: Option<u64>,
    announce_interval: u64,
    /// Number of the last value.
    pub sequence: u64,
    announced: u64,
}

#[derive(Debug)]
struct UnsentItem {
    item: Arc<Vec<u8>>,
    start: usize,
    size: usize,
    index: u32,
    count: u32,
}

/// Fragment of an item.
#[derive(Clone, Debug)]
pub(super) struct Part {
    item: Arc<Vec<u8>>,
    start: usize,
    end: usize,
    pub index: u32,
    pub count: u32,
}

impl Part {
    pub fn bytes(&self) -> &[u8] {
        &self.item[self.start..self.end]
    }
}

/// Time for a confirmation before the receiver gets an announcement, ns.
const MIN_ANNOUNCE_INTERVAL: u64 = 20_000_000;

/// Longest interval between announcements, ns.
const MAX_ANNOUNCE_INTERVAL: u64 = 200_000_000;

impl Outbound {
    pub fn new(content: Content, reliable: bool, window: usize) -> Self {
        Self {
            reliable,
            content,
            window,
            next: 1,
            unconfirmed: VecDeque::new(),
            bytes_in_flight: 0,
            unsent: None,
            retransmissions: SortedSet::new(),
            confirmed: 1,
            announce_at: None,
            announce_interval: MIN_ANNOUNCE_INTERVAL,
            sequence: 0,
            announced: 0,
        }
    }

    /// Returns whether the stream takes the next item.
    pub fn is_ready(&self) -> bool {
        if self.unsent.is_some() {
            return false;
        }
        match self.content {
            _ if !self.reliable => true,
            // An older value that fits into one fragment need not be sent again once there is a newer one. One that
            // takes several would never come through if each newer one pushed it out.
            Content::Newest => self.unconfirmed.iter().all(|part| part.count == 1),
            Content::All => self.has_room(),
        }
    }

    /// Takes an item that is to be sent in fragments of at most `size` bytes.
    pub fn push(&mut self, item: Vec<u8>, size: usize) {
        if self.reliable && self.content == Content::Newest {
            self.unconfirmed.clear();
            self.retransmissions.clear();
            self.bytes_in_flight = 0;
        }
        let size = size.max(1);
        let count = item.len().div_ceil(size).max(1) as u32;
        self.unsent = Some(UnsentItem { item: Arc::new(item), start: 0, size, index: 0, count });
    }

    /// Returns whether a fragment is to be sent.
    pub fn has_fragment(&self) -> bool {
        !self.retransmissions.is_empty() || self.unsent.is_some() && self.has_room()
    }

    /// Returns whether more fragments may be in flight.
    fn has_room(&self) -> bool {
        !self.reliable
            || self.bytes_in_flight < self.window && self.unconfirmed.len() < MAX_FRAGMENTS_IN_FLIGHT
    }

    /// Returns the length of the next fragment, bytes.
    pub fn next_length(&self) -> usize {
        match (self.retransmissions.first(), &self.unsent) {
            (Some(number), _) => self.unconfirmed_part(*number).map_or(0, |part| part.end - part.start),
            (None, Some(rest)) => rest.size.min(rest.item.len() - rest.start),
            (None, None) => 0,
        }
    }

    fn unconfirmed_part(&self, number: u64) -> Option<&Part> {
        let first = self.next - self.unconfirmed.len() as u64;
        self.unconfirmed.get(usize::try_from(number.checked_sub(first)?).ok()?)
    }

    /// Returns the next fragment and its number; retransmissions come first.
    pub fn pop(&mut self, now: u64) -> Option<(u64, Part)> {
        while let Some(number) = self.retransmissions.pop_first() {
            if let Some(part) = self.unconfirmed_part(number) {
                return Some((number, part.clone()));
            }
        }
        if !self.has_room() {
            return None;
        }
        let rest = self.unsent.as_mut()?;
        let end = (rest.start + rest.size).min(rest.item.len());
        let part = Part {
            item: Arc::clone(&rest.item),
            start: rest.start,
            end,
            index: rest.index,
            count: rest.count,
        };
        (rest.start, rest.index) = (end, rest.index + 1);
        if rest.index == rest.count {
            self.unsent = None;
        }
        let number = self.next;
        self.next += 1;
        if self.reliable {
            self.bytes_in_flight += end - part.start;
            self.unconfirmed.push_back(part.clone());
        }
        if self.reliable || self.content == Content::All {
            self.announce_interval = MIN_ANNOUNCE_INTERVAL;
            self.announce_at = Some(now + MIN_ANNOUNCE_INTERVAL);
        }
        Some((number, part))
    }

    /// Notes that a value was skipped.
    /// The receiver must learn of it even if no other value follows.
    pub fn pass(&mut self, sequence: u64, now: u64) {
        self.sequence = self.sequence.max(sequence);
        self.announce_at.get_or_insert(now + MIN_ANNOUNCE_INTERVAL);
    }

    /// Returns the time of the next announcement.
    pub fn announce_at(&self) -> Option<u64> {
        // While an item is on its way the receiver hears of the stream anyhow.
        self.announce_at.filter(|_| self.unsent.is_none() || !self.has_room())
    }

    /// Returns an announcement, and schedules the next one after twice the interval.
    /// Announcements end with the confirmation.
    pub fn announcement(&mut self, stream: u32, epoch: u32, now: u64) -> Announcement {
        self.announce_at = Some(now + self.announce_interval);
        self.announce_interval = (self.announce_interval * 2).min(MAX_ANNOUNCE_INTERVAL);
        self.announced = self.sequence;
        let first = self.next - self.unconfirmed.len() as u64;
        Announcement { stream, first, next: self.next, sequence: self.sequence, epoch }
    }

    /// Takes a report of the receiver.
    pub fn report(&mut self, report: &StreamReport, now: u64) {
        if report.next > self.next {
            return;
        }
        if report.next > self.confirmed || !report.missing.is_empty() {
            self.announce_interval = MIN_ANNOUNCE_INTERVAL;
            self.announce_at = self.announce_at.map(|_| now + MIN_ANNOUNCE_INTERVAL);
        }
        self.confirmed = self.confirmed.max(report.next);
        while self.next - self.unconfirmed.len() as u64 <= self.confirmed.saturating_sub(1) {
            let Some(part) = self.unconfirmed.pop_front() else { break };
            self.bytes_in_flight -= part.end - part.start;
        }
        let first = self.next - self.unconfirmed.len() as u64;
        self.retransmissions = self.retransmissions.split_off(&first);
        let mut requested = 0;
        for (from, to) in &report.missing {
            for number in (*from).max(first)..=(*to).min(self.next - 1) {
                if requested == MAX_FRAGMENTS_IN_FLIGHT {
                    return;
                }
                requested += 1;
                self.retransmissions.insert(number);
            }
        }
        if self.confirmed == self.next && (self.content == Content::Newest || self.announced == self.sequence)
        {
            self.announce_at = None;
        }
    }

    /// Returns the number of unconfirmed fragments.
    pub fn in_flight(&self) -> usize {
        self.unconfirmed.len()
    }
}

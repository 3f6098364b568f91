use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use super::Content;
use super::wire::{Announcement, StreamReport};

/// Most fragments that are sent and not confirmed.
const FLIGHT: usize = 512;

/// The sending end of a stream: cuts items into fragments, and keeps those of a reliable stream until they came.
#[derive(Debug)]
pub(super) struct Outbound {
    reliable: bool,
    content: Content,
    /// Bytes that may be in flight.
    window: usize,
    /// The number of the fragment that is sent next.
    next: u64,
    /// Sent and not confirmed, from `next - flight.len()` on.
    flight: VecDeque<Part>,
    flying: usize,
    /// The item that is being sent.
    rest: Option<UnsentRest>,
    again: BTreeSet<u64>,
    /// All fragments before this one came, or need not.
    confirmed: u64,
    announce_at: Option<u64>,
    retry_interval: u64,
    /// The number of the last value.
    pub sequence: u64,
    announced: u64,
}

#[derive(Debug)]
struct UnsentRest {
    item: Arc<Vec<u8>>,
    start: usize,
    size: usize,
    index: u32,
    count: u32,
}

/// A fragment.
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

/// How long a receiver may take to confirm, nanoseconds, before it is told what there is.
const RETRY_INTERVAL: u64 = 20_000_000;

/// The longest that is waited from one announcement to the next.
const LONGEST_RETRY_INTERVAL: u64 = 200_000_000;

impl Outbound {
    pub fn new(content: Content, reliable: bool, window: usize) -> Self {
        Self {
            reliable,
            content,
            window,
            next: 1,
            flight: VecDeque::new(),
            flying: 0,
            rest: None,
            again: BTreeSet::new(),
            confirmed: 1,
            announce_at: None,
            retry_interval: RETRY_INTERVAL,
            sequence: 0,
            announced: 0,
        }
    }

    /// Whether the next item can be given to it.
    pub fn is_ready(&self) -> bool {
        if self.rest.is_some() {
            return false;
        }
        match self.content {
            _ if !self.reliable => true,
            // An older value that fits into one fragment need not be sent again once there is a newer one. One that
            // takes several would never come through if each newer one pushed it out.
            Content::Newest => self.flight.iter().all(|part| part.count == 1),
            Content::All => self.has_room(),
        }
    }

    /// Takes an item that is to be sent in fragments of at most `size` bytes.
    pub fn push(&mut self, item: Vec<u8>, size: usize) {
        if self.reliable && self.content == Content::Newest {
            self.flight.clear();
            self.again.clear();
            self.flying = 0;
        }
        let size = size.max(1);
        let count = item.len().div_ceil(size).max(1) as u32;
        self.rest = Some(UnsentRest { item: Arc::new(item), start: 0, size, index: 0, count });
    }

    /// Whether there is a fragment to be sent.
    pub fn has_fragment(&self) -> bool {
        !self.again.is_empty() || self.rest.is_some() && self.has_room()
    }

    /// Whether more may be in flight.
    fn has_room(&self) -> bool {
        !self.reliable || self.flying < self.window && self.flight.len() < FLIGHT
    }

    /// How many bytes the next fragment has.
    pub fn next_length(&self) -> usize {
        match (self.again.first(), &self.rest) {
            (Some(number), _) => self.kept(*number).map_or(0, |part| part.end - part.start),
            (None, Some(rest)) => rest.size.min(rest.item.len() - rest.start),
            (None, None) => 0,
        }
    }

    fn kept(&self, number: u64) -> Option<&Part> {
        let first = self.next - self.flight.len() as u64;
        self.flight.get(usize::try_from(number.checked_sub(first)?).ok()?)
    }

    /// The next fragment and its number: first what has to be sent again.
    pub fn pop(&mut self, now: u64) -> Option<(u64, Part)> {
        while let Some(number) = self.again.pop_first() {
            if let Some(part) = self.kept(number) {
                return Some((number, part.clone()));
            }
        }
        if !self.has_room() {
            return None;
        }
        let rest = self.rest.as_mut()?;
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
            self.rest = None;
        }
        let number = self.next;
        self.next += 1;
        if self.reliable {
            self.flying += end - part.start;
            self.flight.push_back(part.clone());
        }
        if self.reliable || self.content == Content::All {
            self.retry_interval = RETRY_INTERVAL;
            self.announce_at = Some(now + RETRY_INTERVAL);
        }
        Some((number, part))
    }

    /// A value went by unsent, so the receiver has to hear of it even if nothing follows.
    pub fn pass(&mut self, sequence: u64, now: u64) {
        self.sequence = self.sequence.max(sequence);
        self.announce_at.get_or_insert(now + RETRY_INTERVAL);
    }

    /// When there is something to be announced.
    pub fn announce_at(&self) -> Option<u64> {
        // While an item is on its way the receiver hears of the stream anyhow.
        self.announce_at.filter(|_| self.rest.is_none() || !self.has_room())
    }

    /// What is announced, and again after twice the time, until it is confirmed.
    pub fn announcement(&mut self, stream: u32, epoch: u32, now: u64) -> Announcement {
        self.announce_at = Some(now + self.retry_interval);
        self.retry_interval = (self.retry_interval * 2).min(LONGEST_RETRY_INTERVAL);
        self.announced = self.sequence;
        let first = self.next - self.flight.len() as u64;
        Announcement { stream, first, next: self.next, sequence: self.sequence, epoch }
    }

    /// What the receiver has.
    pub fn report(&mut self, report: &StreamReport, now: u64) {
        if report.next > self.next {
            return;
        }
        if report.next > self.confirmed || !report.missing.is_empty() {
            self.retry_interval = RETRY_INTERVAL;
            self.announce_at = self.announce_at.map(|_| now + RETRY_INTERVAL);
        }
        self.confirmed = self.confirmed.max(report.next);
        while self.next - self.flight.len() as u64 <= self.confirmed.saturating_sub(1) {
            let Some(part) = self.flight.pop_front() else { break };
            self.flying -= part.end - part.start;
        }
        let first = self.next - self.flight.len() as u64;
        self.again = self.again.split_off(&first);
        let mut asked = 0;
        for (from, to) in &report.missing {
            for number in (*from).max(first)..=(*to).min(self.next - 1) {
                if asked == FLIGHT {
                    return;
                }
                asked += 1;
                self.again.insert(number);
            }
        }
        if self.confirmed == self.next && (self.content == Content::Newest || self.announced == self.sequence)
        {
            self.announce_at = None;
        }
    }

    /// How many fragments are sent and not confirmed.
    pub fn in_flight(&self) -> usize {
        self.flight.len()
    }
}

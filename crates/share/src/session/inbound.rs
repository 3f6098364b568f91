use slate_sorted::MapEntry;
use slate_sorted::SortedMap;

use super::Content;
use super::wire::{Announcement, Fragment, StreamReport};

/// Number of fragments after which a report is sent.
const REPORT_FRAGMENTS: u32 = 64;

/// Number of bytes after which a report is sent; less than any window.
const REPORT_BYTES: usize = 32 << 10;

/// Delay until missing fragments are requested again, ns.
const RETRANSMIT_DELAY: u64 = 10_000_000;

/// Largest number of ranges of missing fragments in a report.
const MAX_MISSING_RANGES: usize = 32;

/// Largest number of items assembled at once in an unreliable stream.
const MAX_PARTIAL_ITEMS: usize = 2;

/// Largest distance of a fragment from the expected one.
const MAX_SEQUENCE_LEAD: u64 = 4096;

/// Smallest size of all fragments of an item but the last, bytes.
/// The overhead of a fragment is memory, too, so the size of an item bounds the number of its fragments.
const MIN_FRAGMENT_SIZE: usize = 512;

/// Receiving end of a stream, which assembles items.
/// A reliable stream delivers all fragments in order; otherwise only complete items count.
#[derive(Debug)]
pub(super) struct Inbound {
    content: Content,
    reliable: bool,
    /// Largest item, bytes.
    limit: usize,
    /// Largest size of early fragments, bytes.
    window: usize,
    /// Number of the first missing fragment.
    expected: u64,
    early: SortedMap<u64, ItemPiece>,
    early_bytes: usize,
    /// Item being assembled in order, and the number of its received fragments.
    item: Vec<u8>,
    received_fragments: u32,
    /// Incomplete items, by the number of their first fragment.
    partial_items: SortedMap<u64, PartialItem>,
    unreported: u32,
    unreported_bytes: usize,
    owes_report: bool,
    requested_at: Option<u64>,
    /// Next fragment number, as the sender announced it.
    known: u64,
    announced: bool,
}

#[derive(Debug)]
struct ItemPiece {
    index: u32,
    count: u32,
    bytes: Vec<u8>,
}

#[derive(Debug, Default)]
struct PartialItem {
    pieces: SortedMap<u32, Vec<u8>>,
    bytes: usize,
}

impl Inbound {
    pub fn new(content: Content, reliable: bool, limit: usize, window: usize) -> Self {
        Self {
            content,
            reliable,
            limit,
            // A sender may have a whole window in flight, and the item that is on its way.
            window: window.saturating_mul(2),
            expected: 1,
            early: SortedMap::new(),
            early_bytes: 0,
            item: Vec::new(),
            received_fragments: 0,
            partial_items: SortedMap::new(),
            unreported: 0,
            unreported_bytes: 0,
            owes_report: false,
            requested_at: None,
            known: 1,
            announced: false,
        }
    }

    /// Creates a placeholder for a stream in use.
    pub fn idle() -> Self {
        Self::new(Content::Newest, false, 0, 0)
    }

    /// Takes a fragment; returns whether it is consistent with earlier ones.
    /// Completed items go to `deliver`.
    pub fn receive(&mut self, fragment: &Fragment<'_>, deliver: &mut dyn FnMut(&[u8])) -> bool {
        let Fragment { number, index, count, .. } = *fragment;
        // The numbers after the last one are counted with, too.
        if index >= count || number == 0 || number >= u64::MAX - 1 || u64::from(index) >= number {
            return false;
        }
        self.known = self.known.max(number + 1);
        if self.reliable {
            self.take_ordered(fragment, deliver)
        } else {
            self.take_unordered(fragment, deliver)
        }
    }

    fn take_ordered(&mut self, fragment: &Fragment<'_>, deliver: &mut dyn FnMut(&[u8])) -> bool {
        let number = fragment.number;
        if number < self.expected {
            // The sender would not send it again if it knew.
            self.owes_report = true;
            return true;
        }
        let start = number - u64::from(fragment.index);
        if self.content == Content::Newest && start > self.expected {
            // A newer item is only sent when the ones before came or are of no use.
            self.skip_to(start);
        }
        if number > self.expected {
            let bytes = fragment.bytes.0;
            let fits =
                self.early_bytes + bytes.len() <= self.window && number - self.expected < MAX_SEQUENCE_LEAD;
            if fits && !self.early.contains_key(&number) {
                self.early_bytes += bytes.len();
                let piece = ItemPiece { index: fragment.index, count: fragment.count, bytes: bytes.to_vec() };
                self.early.insert(number, piece);
            }
            self.owes_report = true;
            return true;
        }
        let mut fine = self.take(fragment.index, fragment.count, fragment.bytes.0, deliver);
        fine &= self.drain(deliver);
        self.unreported += 1;
        self.unreported_bytes += fragment.bytes.0.len();
        self.owes_report |= self.unreported >= REPORT_FRAGMENTS || self.unreported_bytes >= REPORT_BYTES;
        fine
    }

    /// Takes early fragments that are expected now.
    fn drain(&mut self, deliver: &mut dyn FnMut(&[u8])) -> bool {
        let mut fine = true;
        while let Some(piece) = self.early.remove(&self.expected) {
            self.early_bytes -= piece.bytes.len();
            fine &= self.take(piece.index, piece.count, &piece.bytes, deliver);
        }
        fine
    }

    fn take(&mut self, index: u32, count: u32, bytes: &[u8], deliver: &mut dyn FnMut(&[u8])) -> bool {
        self.expected += 1;
        if count == 1 {
            self.clear_item();
            let fits = bytes.len() <= self.limit;
            if fits {
                deliver(bytes);
            }
            return fits;
        }
        if index == 0 {
            self.clear_item();
        }
        if index != self.received_fragments || self.item.len() + bytes.len() > self.limit {
            self.clear_item();
            return false;
        }
        self.item.extend_from_slice(bytes);
        self.received_fragments += 1;
        if self.received_fragments == count {
            deliver(&self.item);
            self.clear_item();
            // The next item may wait for this one to be confirmed.
            self.owes_report = true;
        }
        true
    }

    fn clear_item(&mut self) {
        self.received_fragments = 0;
        // Memory that one big value took is not kept for ever by a stream of small ones.
        if self.item.capacity() > 1 << 16 { self.item = Vec::new() } else { self.item.clear() }
    }

    fn take_unordered(&mut self, fragment: &Fragment<'_>, deliver: &mut dyn FnMut(&[u8])) -> bool {
        let Fragment { number, index, count, bytes, .. } = *fragment;
        let start = number - u64::from(index);
        if start < self.expected {
            return true;
        }
        if count == 1 {
            self.finish(number + 1);
            let fits = bytes.0.len() <= self.limit;
            if fits {
                deliver(bytes.0);
            }
            return fits;
        }
        if count as usize > self.limit / MIN_FRAGMENT_SIZE + 1 {
            return false;
        }
        let item = self.partial_items.entry(start).or_default();
        if item.bytes + bytes.0.len() > self.limit {
            self.partial_items.remove(&start);
            return false;
        }
        if let MapEntry::Vacant(place) = item.pieces.entry(index) {
            item.bytes += bytes.0.len();
            place.insert(bytes.0.to_vec());
        }
        if item.pieces.len() == count as usize {
            let pieces = self.partial_items.remove(&start).unwrap_or_default().pieces;
            self.finish(start + u64::from(count));
            let whole: Vec<u8> = pieces.into_values().flatten().collect();
            deliver(&whole);
        }
        while self.partial_items.len() > MAX_PARTIAL_ITEMS {
            self.partial_items.pop_first();
        }
        true
    }

    /// Drops all fragments before `next`, which are not needed.
    fn finish(&mut self, next: u64) {
        self.expected = next;
        self.partial_items = self.partial_items.split_off(&next);
    }

    /// Takes an announcement of the sender about the extent of the stream.
    pub fn announce(&mut self, announcement: &Announcement, deliver: &mut dyn FnMut(&[u8])) -> bool {
        let Announcement { first, next, .. } = *announcement;
        if first == 0 || first > next || next == u64::MAX {
            return false;
        }
        self.known = self.known.max(next);
        self.owes_report = true;
        self.announced = true;
        if !self.reliable {
            return true;
        }
        let mut fine = true;
        if first > self.expected {
            self.skip_to(first);
            fine = self.drain(deliver);
        }
        fine
    }

    /// Skips to `next`, as earlier fragments will not come.
    fn skip_to(&mut self, next: u64) {
        self.clear_item();
        self.expected = next;
        self.early = self.early.split_off(&next);
        self.early_bytes = self.early.values().map(|piece| piece.bytes.len()).sum();
    }

    /// Returns whether all announced fragments have arrived or never will.
    pub fn is_complete(&self) -> bool {
        !self.reliable || self.expected >= self.known
    }

    /// Returns the time of the next report.
    pub fn report_at(&self, now: u64) -> Option<u64> {
        if !self.owes_report {
            return None;
        }
        // Requested fragments need time to arrive.
        let missing = !self.early.is_empty() && !self.announced;
        Some(if missing {
            self.requested_at.map_or(now, |requested_at| requested_at + RETRANSMIT_DELAY)
        } else {
            now
        })
    }

    /// Returns a report of received and missing fragments.
    pub fn report(&mut self, stream: u32, now: u64) -> StreamReport {
        (self.owes_report, self.announced) = (false, false);
        (self.unreported, self.unreported_bytes) = (0, 0);
        if !self.reliable {
            return StreamReport { stream, next: self.known, missing: Vec::new() };
        }
        let mut missing = Vec::new();
        let mut from = self.expected;
        for number in self.early.keys().copied().chain([self.known]) {
            if number > from && missing.len() < MAX_MISSING_RANGES {
                missing.push((from, number - 1));
            }
            from = from.max(number + 1);
        }
        if !missing.is_empty() {
            self.requested_at = Some(now);
            // If they don't come, the next announcement asks again.
        }
        StreamReport { stream, next: self.expected, missing }
    }
}

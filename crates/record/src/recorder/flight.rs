//! Flight recorder: the last seconds of values, in memory.
//! They are kept as written, in pieces of which the oldest makes room for the newest.

use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

use slate_blackboard::Stamp;
use slate_blackboard::channel::StampedValue;
use slate_runtime::configuration::Flight as Settings;
use slate_runtime::recording::{Change, History, HistoryRequest, Left, TakeValue};
use slate_sorted::SortedMap;

use super::channels::Channel;
use super::hub::{ChannelFilter, FIRST_TOPIC_ID};
use super::messages::{CHANGE_TOPIC, read_change};
use super::ring::{HEAD_SIZE, ValueHead};

/// The last seconds of an agent.
pub(super) struct Flight {
    keep: u64,
    memory: usize,
    /// Bytes of a piece.
    piece: usize,
    pieces: VecDeque<Arc<Piece>>,
    open: Piece,
    /// Bytes of all pieces but the open one.
    bytes: usize,
    /// The last value of each property that is in no piece any more.
    before: SortedMap<u32, FlightValue>,
    past: Past,
    /// A piece that can be used again.
    spare: Option<Piece>,
    wants: ChannelFilter,
    /// Wanted flags by property; `None` before its first value.
    wanted: Vec<Option<bool>>,
}

/// State before the first value that is kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Past {
    /// Set if there were values before.
    pub is_there: bool,
    /// Settings changed since the beginning; `None` for the value of the files.
    pub settings: SortedMap<String, Option<String>>,
    /// The order of the modules, where it was another one at the beginning.
    pub stages: Option<Vec<(String, Vec<String>)>>,
    /// Set if the code differs from that at the beginning.
    pub has_new_code: bool,
}

/// Values, each behind its head.
#[derive(Debug, Default)]
struct Piece {
    bytes: Vec<u8>,
    /// The times of the first and the last value.
    from: u64,
    to: u64,
    /// By property, the offsets of its values.
    /// Made when the past of any property is requested, once no more values come.
    index: OnceLock<SortedMap<u32, Vec<u32>>>,
}

/// A value that was written.
#[derive(Clone, Debug)]
struct FlightValue {
    head: ValueHead,
    bytes: Vec<u8>,
}

/// The values in memory at a moment.
pub(super) struct Captured {
    before: SortedMap<u32, FlightValue>,
    pub past: Past,
    pieces: Vec<Arc<Piece>>,
    pub channels: Vec<Channel>,
    pub from: u64,
    pub to: u64,
}

/// Number of pieces that fill the memory, or the time.
const PIECE_COUNT: usize = 32;

/// The largest piece, bytes.
const MAX_PIECE_SIZE: usize = 1 << 20;

impl Flight {
    /// Creates the flight recorder; `None` if it is not enabled.
    pub fn new(settings: &Settings, wants: ChannelFilter) -> Option<Self> {
        let memory = usize::try_from(settings.memory).unwrap_or(usize::MAX);
        let flight = Self {
            keep: settings.keep,
            memory,
            piece: (memory / PIECE_COUNT).min(MAX_PIECE_SIZE),
            pieces: VecDeque::new(),
            open: Piece::default(),
            bytes: 0,
            before: SortedMap::new(),
            past: Past::default(),
            spare: None,
            wants,
            wanted: Vec::new(),
        };
        settings.enabled.then_some(flight)
    }

    fn wants(&mut self, id: u32, channel: &Channel) -> bool {
        let index = id as usize;
        if self.wanted.len() <= index {
            self.wanted.resize(index + 1, None);
        }
        *self.wanted[index].get_or_insert_with(|| (self.wants)(channel))
    }

    /// Takes a value if the flight recorder keeps it.
    /// A recording may have requested it alone.
    pub fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        if channel.is_some_and(|channel| !self.wants(id, channel)) {
            return;
        }
        let needed = HEAD_SIZE + bytes.len();
        if needed > self.memory / 2 {
            // It would leave no room for others; its property shows a gap.
            return;
        }
        let is_long = stamp.time.saturating_sub(self.open.from) > self.keep / PIECE_COUNT as u64;
        if !self.open.bytes.is_empty() && (is_long || self.open.bytes.len() + needed > self.piece) {
            self.close();
        }
        let open = &mut self.open;
        if open.bytes.is_empty() {
            open.from = stamp.time;
            open.bytes.reserve(self.piece.max(needed));
        }
        open.to = if stamp.time > open.to { stamp.time } else { open.to };
        // Lengths fit, as they came in such a head.
        let (items, length) = (items as u32, bytes.len() as u32);
        let head = ValueHead { id, items, length, sequence: stamp.sequence, time: stamp.time };
        open.bytes.extend_from_slice(&head.to_bytes());
        open.bytes.extend_from_slice(bytes);
        while let Some(first) = self.pieces.front()
            && (self.bytes + self.open.bytes.len() > self.memory
                || first.to.saturating_add(self.keep) < self.open.to)
        {
            self.drop_first();
        }
    }

    fn close(&mut self) {
        let next = self.spare.take().unwrap_or_default();
        let piece = std::mem::replace(&mut self.open, next);
        // Time may have gone back, as when the agent continued from a snapshot; what is older then stays for its bytes.
        self.open.to = 0;
        self.bytes += piece.bytes.len();
        self.pieces.push_back(Arc::new(piece));
    }

    fn drop_first(&mut self) {
        let Some(piece) = self.pieces.pop_front() else { return };
        self.bytes -= piece.bytes.len();
        self.past.is_there = true;
        piece.each(|head, bytes| {
            if head.id >= FIRST_TOPIC_ID {
                if head.id == CHANGE_TOPIC.id {
                    self.past.note(bytes);
                }
                return;
            }
            let value = self.before.entry(head.id).or_insert_with(|| FlightValue { head, bytes: Vec::new() });
            value.head = head;
            value.bytes.clear();
            value.bytes.extend_from_slice(bytes);
        });
        if let Some(mut piece) = Arc::into_inner(piece) {
            piece.bytes.clear();
            piece.index = OnceLock::new();
            self.spare = Some(piece);
        }
    }

    /// Returns the first and the last time in memory, and the size, bytes.
    pub fn extent(&self) -> (u64, u64, u64) {
        let from = self.pieces.front().map_or(self.open.from, |piece| piece.from);
        let to = self.pieces.back().map_or(0, |piece| piece.to);
        let to = if self.open.bytes.is_empty() || to > self.open.to { to } else { self.open.to };
        (from, to, (self.bytes + self.open.bytes.len()) as u64)
    }

    /// Returns the present values, without a copy.
    pub fn capture(&mut self, channels: &[Channel]) -> Captured {
        let (from, to, _) = self.extent();
        if !self.open.bytes.is_empty() {
            // Frequent captures leave short pieces.
            self.open.bytes.shrink_to_fit();
            self.close();
        }
        Captured {
            before: self.before.clone(),
            past: self.past.clone(),
            pieces: self.pieces.iter().cloned().collect(),
            channels: channels.to_vec(),
            from,
            to,
        }
    }
}

impl Past {
    /// Notes a change that is no longer in memory.
    fn note(&mut self, message: &[u8]) {
        match read_change(message) {
            Some((_, Change::Setting { path, value } | Change::Own { path, value, .. })) => {
                self.settings.insert(path, value);
            }
            Some((_, Change::Order { stages })) => self.stages = Some(stages),
            Some((_, Change::Reload { .. } | Change::Load { .. } | Change::Unload { .. })) => {
                self.has_new_code = true;
            }
            _ => {}
        }
    }
}

impl Piece {
    fn each(&self, mut take: impl FnMut(ValueHead, &[u8])) {
        let mut rest = self.bytes.as_slice();
        while let Some((head, behind)) = rest.split_first_chunk::<HEAD_SIZE>() {
            let head = ValueHead::from_bytes(head);
            let (bytes, behind) = behind.split_at_checked(head.length as usize).unwrap_or((behind, &[]));
            take(head, bytes);
            rest = behind;
        }
    }

    /// Returns the offsets of a property's values.
    fn offsets(&self, id: u32) -> &[u32] {
        let index = self.index.get_or_init(|| {
            let (mut index, mut offset) = (SortedMap::<u32, Vec<u32>>::new(), 0);
            self.each(|head, bytes| {
                // A piece is not longer than that.
                index.entry(head.id).or_default().push(offset as u32);
                offset += HEAD_SIZE + bytes.len();
            });
            index
        });
        index.get(&id).map_or(&[], Vec::as_slice)
    }

    /// Returns the value that begins at a place.
    fn at(&self, offset: u32) -> Option<(ValueHead, &[u8])> {
        let (head, behind) = self.bytes.get(offset as usize..)?.split_first_chunk::<HEAD_SIZE>()?;
        let head = ValueHead::from_bytes(head);
        Some((head, behind.get(..head.length as usize)?))
    }
}

impl Captured {
    /// Returns the channel of the property at a path, the last one of several.
    pub fn channel(&self, path: &str) -> Option<&Channel> {
        self.channels.iter().rev().find(|channel| channel.path == path)
    }

    /// Returns the requested history of the property at a path, if it is kept.
    pub fn history(&self, request: &HistoryRequest, take: &mut TakeValue<'_>) -> Option<History> {
        let own = self.channel(&request.path)?;
        // A module that was loaded anew writes the same property, as long as it has the same interface.
        let descriptor = own.descriptor;
        let is_own =
            |channel: &Channel| channel.path == request.path && channel.descriptor.hash == descriptor.hash;
        let ids = (0..).zip(&self.channels).filter(|(_, channel)| is_own(channel)).map(|(id, _)| id);
        let mut found: Vec<(ValueHead, &[u8])> = Vec::new();
        for id in ids {
            found.extend(self.before.get(&id).map(|value| (value.head, value.bytes.as_slice())));
            for piece in &self.pieces {
                found.extend(piece.offsets(id).iter().filter_map(|offset| piece.at(*offset)));
            }
        }
        found.retain(|(head, _)| request.has(head.time, head.sequence));
        // A reader that continues at one of them misses none.
        found.sort_by_key(|(head, _)| (head.time, head.sequence, head.id));
        let chosen: Vec<_> =
            request.places(found.len()).filter_map(|index| found.get(index).copied()).collect();
        let left = chosen.iter().position(|(head, bytes)| {
            let stamp = Stamp { sequence: head.sequence, time: head.time, generation: 0 };
            !take(descriptor, StampedValue { bytes: bytes.to_vec(), items: head.items as usize, stamp })
        });
        let left = left.and_then(|index| {
            let (head, _) = chosen.get(index)?;
            Some(Left { count: chosen.len() - index, time: head.time, sequence: head.sequence })
        });
        Some(History { left, count: found.len(), from: self.from, to: self.to })
    }

    /// Visits the earlier values, one per property, then all values in order.
    /// The second part is in the order in which the values came.
    pub fn each(&self, mut take: impl FnMut(bool, ValueHead, &[u8])) {
        self.before.values().for_each(|value| take(true, value.head, &value.bytes));
        self.pieces.iter().for_each(|piece| piece.each(|head, bytes| take(false, head, bytes)));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use slate_blackboard::channel::Budget;
    use slate_blackboard::interface::Descriptor;
    use slate_blackboard::{Access, Board, Store};

    static BYTES: Descriptor =
        Descriptor { name: "bytes", doc: "", ros: "", fields: &[], size: 8, align: 8, hash: 7 };

    /// Channels at `/0` to `/3`.
    fn channels() -> Vec<Channel> {
        let board = Board::new("robot");
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 1, queues: 0, window: 0 } };
        let add = |id: usize| board.add_channel(&format!("p{id}"), "", &BYTES, store, Access::Output);
        (0..4).map(|id| Channel::of(&add(id).unwrap())).collect()
    }

    fn flight(keep: u64, memory: u64) -> Flight {
        let settings = Settings { enabled: true, keep, memory, ..Settings::default() };
        Flight::new(&settings, Box::new(|_| true)).unwrap()
    }

    /// Numbers of the values before and of those in it, by property.
    fn numbers(flight: &mut Flight) -> (SortedMap<u32, u64>, SortedMap<u32, Vec<u64>>) {
        let (mut before, mut after) = (SortedMap::new(), SortedMap::<_, Vec<_>>::new());
        flight.capture(&[]).each(|is_before, head, bytes| {
            assert_eq!(bytes, vec![head.sequence as u8; head.length as usize]);
            if is_before {
                assert_eq!(before.insert(head.id, head.sequence), None);
            } else {
                after.entry(head.id).or_default().push(head.sequence);
            }
        });
        (before, after)
    }

    proptest! {
        /// All values of a property are there from one value on, and so is the one before.
        /// This holds for any sequence of writes.
        #[test]
        fn the_last_values_are_there_and_the_one_before_them(
            values in prop::collection::vec((0_u32..4, 0_usize..3000, 0_u64..50), 1..800),
            keep in 100_u64..5000,
            captures in prop::collection::btree_set(0_usize..800, 0..4),
        ) {
            let memory = 100_000;
            let mut flight = flight(keep, memory);
            let mut written: SortedMap<u32, Vec<(u64, u64)>> = SortedMap::new();
            let mut now = 0;
            for (index, (id, length, later)) in values.into_iter().enumerate() {
                now += later;
                let own = written.entry(id).or_default();
                let sequence = own.len() as u64 + 1;
                own.push((sequence, now));
                let stamp = Stamp { sequence, time: now, generation: 0 };
                flight.value(None, id, 0, stamp, &vec![sequence as u8; length]);
                // An earlier capture does not change the buffer.
                let _held = captures.contains(&index).then(|| flight.capture(&[]));
            }
            prop_assert!(flight.extent().2 <= memory);
            let whole = flight.extent().2 < memory / 2;
            let captured = flight.capture(&channels());
            for (id, own) in &written {
                // Asked twice, as the first one makes the index.
                for (from, to, most) in [(0, u64::MAX, 10_000), (now / 3, now / 2, 7)] {
                    let request = HistoryRequest { path: format!("p{id}"), from, sequence: 0, to, most };
                    let mut all = Vec::new();
                    captured.each(|_, head, bytes| {
                        if head.id == *id && (from..=to).contains(&head.time) {
                            all.push((head.time, head.sequence, bytes.len()));
                        }
                    });
                    prop_assert!(all.len() <= own.len());
                    let mut values = Vec::new();
                    let chosen = captured.history(&request, &mut |_, own| {
                        values.push((own.stamp.time, own.stamp.sequence, own.bytes.len()));
                        values.len() <= 5
                    });
                    let chosen = chosen.unwrap();
                    prop_assert_eq!(chosen.count, all.len());
                    let wanted: Vec<_> = request.places(all.len()).map(|index| all[index]).collect();
                    let first = wanted.get(5);
                    let left = first.map(|(time, sequence, _)| Left {
                        count: wanted.len() - 5,
                        time: *time,
                        sequence: *sequence,
                    });
                    prop_assert_eq!(chosen.left, left);
                    prop_assert_eq!(&values[..], &wanted[..wanted.len().min(6)]);
                    // A reader that continues there gets the rest, also of the same time, and nothing twice.
                    let Some(left) = left else { continue };
                    let rest = HistoryRequest { from: left.time, sequence: left.sequence, ..request };
                    let mut values = Vec::new();
                    captured.history(&rest, &mut |_, own| {
                        values.push((own.stamp.time, own.stamp.sequence, own.bytes.len()));
                        true
                    });
                    if most > all.len() {
                        prop_assert_eq!(&values[..], &wanted[5..]);
                    }
                }
            }
            let (before, after) = numbers(&mut flight);
            for (id, own) in written {
                let kept = after.get(&id).cloned().unwrap_or_default();
                let last = own.len() as u64;
                let first = last + 1 - kept.len() as u64;
                prop_assert_eq!(&kept, &(first..=last).collect::<Vec<_>>());
                prop_assert_eq!(before.get(&id).copied(), (first > 1).then(|| first - 1));
                // With room to spare nothing of the last seconds is missing.
                let missing = own[..first as usize - 1].iter().filter(|(_, time)| time + keep >= now);
                prop_assert!(!whole || missing.count() == 0);
            }
        }
    }
}

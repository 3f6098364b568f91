//! Numbered samples in their order, when some of them are lost on their way.

use slate_sorted::MapEntry;
use slate_sorted::SortedMap;

/// Limit of a source's samples that wait for earlier ones, and of their bytes.
/// Data of others must not fill the memory.
const MAX_WAITING_SAMPLES: usize = 512;
const MAX_WAITING_BYTES: usize = 32 << 20;

/// Maximum number of followed sources.
const MAX_SOURCES: usize = 16;

/// Period between two queries for missing samples, ns.
/// A query right after a link is back may be lost.
pub const QUERY_PERIOD: u64 = 100_000_000;

/// Time without an answer after which missing samples are lost, ns.
const ANSWER_TIMEOUT: u64 = 5_000_000_000;

/// Number of answers without the next sample after which it counts as lost.
/// The origin no longer has it then: a full link drops parts of answers.
const MAX_EMPTY_ANSWERS: u32 = 2;

/// Number before the first one of a source.
/// Numbers of 32 bits wrap around.
const INITIAL_NUMBER: u64 = u32::MAX as u64;

/// Publisher: its session and its number there.
pub type SampleSource = (String, u32);

/// Reordering of publishers' samples by their numbers, each delivered once.
/// It knows which samples are missing.
pub struct SampleOrder<T> {
    sources: SortedMap<SampleSource, SourceOrder<T>>,
    /// Single source: all samples are of one agent.
    /// Another publisher then replaces the previous one, and is followed from its first sample on.
    is_of_agent: bool,
}

struct SourceOrder<T> {
    /// Number of the last delivered sample, and of the last announced one.
    delivered: u64,
    last: u64,
    /// Samples with their bytes.
    waiting: SortedMap<u64, (usize, T)>,
    bytes: usize,
    /// Start of the gap, and time of the query for it, ns.
    missing: Option<u64>,
    queried: Option<u64>,
    /// First number of the pending query, and the number of its useless answers.
    /// An answer is useless if it has not brought the next sample.
    pending: Option<u64>,
    empty_answers: u32,
    /// Time of the last sample, ns.
    received: u64,
}

impl<T> SampleOrder<T> {
    pub fn new(is_of_agent: bool) -> Self {
        Self { sources: SortedMap::new(), is_of_agent }
    }

    /// Takes a sample that arrived at `now`, ns, with its size in bytes.
    /// Calls `deliver` with the samples that are next.
    pub fn take(
        &mut self,
        (source, number): (&SampleSource, u32),
        (bytes, sample): (usize, T),
        now: u64,
        deliver: &mut dyn FnMut(T),
    ) {
        let first = self.first(number);
        let order = self.follow(source, first, now, deliver);
        let number = order.full_number(number);
        if number > order.delivered {
            order.insert(number, bytes, sample);
        }
        order.flush(now, deliver);
        while order.waiting.len() > MAX_WAITING_SAMPLES || order.bytes > MAX_WAITING_BYTES {
            order.skip();
            order.flush(now, deliver);
        }
    }

    /// Records the last number of a source.
    /// A source without samples begins with its next one, unless it replaces another one.
    pub fn announce(&mut self, source: &SampleSource, number: u32, now: u64, deliver: &mut dyn FnMut(T)) {
        if !self.sources.contains_key(source) && (self.sources.is_empty() || !self.is_of_agent) {
            return;
        }
        let order = self.follow(source, INITIAL_NUMBER, now, deliver);
        order.last = order.last.max(order.full_number(number));
        order.flush(now, deliver);
    }

    /// Returns the sources to query at `now`, each with its first missing number.
    pub fn due(&mut self, now: u64) -> Vec<(SampleSource, u32)> {
        let is_due = |order: &SourceOrder<T>| {
            order.missing.is_some()
                && order.pending.is_none()
                && order.queried.is_none_or(|queried| now.saturating_sub(queried) >= QUERY_PERIOD)
        };
        let due = self.sources.iter_mut().filter(|(_, order)| is_due(order));
        due.map(|(source, order)| {
            let first = order.delivered + 1;
            (order.pending, order.queried) = (Some(first), Some(now));
            // The lower half.
            (source.clone(), first as u32)
        })
        .collect()
    }

    /// Returns whether samples are missing.
    pub fn has_missing(&self) -> bool {
        self.sources.values().any(|order| order.missing.is_some())
    }

    /// Ends a query. The origin no longer has samples that several answers lack.
    pub fn end_query(
        &mut self,
        source: &SampleSource,
        is_answered: bool,
        now: u64,
        deliver: &mut dyn FnMut(T),
    ) {
        let Some(order) = self.sources.get_mut(source) else { return };
        let is_empty = order.pending.take().is_some_and(|first| order.delivered < first);
        order.empty_answers = if is_empty { order.empty_answers + u32::from(is_answered) } else { 0 };
        let is_late = order.missing.is_some_and(|since| now.saturating_sub(since) > ANSWER_TIMEOUT);
        if order.empty_answers >= MAX_EMPTY_ANSWERS || is_late {
            order.empty_answers = 0;
            order.skip();
            order.flush(now, deliver);
        }
    }

    /// Returns the number before the first one of a newly followed source.
    fn first(&self, number: u32) -> u64 {
        if self.is_of_agent && !self.sources.is_empty() {
            INITIAL_NUMBER
        } else {
            INITIAL_NUMBER + u64::from(number)
        }
    }

    fn follow(
        &mut self,
        source: &SampleSource,
        delivered: u64,
        now: u64,
        deliver: &mut dyn FnMut(T),
    ) -> &mut SourceOrder<T> {
        if !self.sources.contains_key(source) {
            if self.is_of_agent {
                for (_, mut order) in std::mem::take(&mut self.sources) {
                    std::mem::take(&mut order.waiting).into_values().for_each(|(_, sample)| deliver(sample));
                }
            } else if self.sources.len() >= MAX_SOURCES
                && let Some(oldest) = self.sources.iter().min_by_key(|(_, order)| order.received)
            {
                let oldest = oldest.0.clone();
                self.sources.remove(&oldest);
            }
        }
        let order = self.sources.entry(source.clone()).or_insert_with(|| SourceOrder {
            delivered,
            last: delivered,
            waiting: SortedMap::new(),
            bytes: 0,
            missing: None,
            queried: None,
            pending: None,
            empty_answers: 0,
            received: now,
        });
        order.received = now;
        order
    }
}

impl<T> SourceOrder<T> {
    /// Returns the full number of these 32 bits: the nearest to the last one.
    fn full_number(&self, number: u32) -> u64 {
        // The lower half.
        let distance = i64::from(number.wrapping_sub(self.delivered as u32).cast_signed());
        self.delivered.saturating_add_signed(distance)
    }

    /// Inserts a sample that waits for earlier ones, unless it is known.
    fn insert(&mut self, number: u64, bytes: usize, sample: T) {
        self.last = self.last.max(number);
        let MapEntry::Vacant(entry) = self.waiting.entry(number) else { return };
        entry.insert((bytes, sample));
        self.bytes += bytes;
    }

    /// Counts the samples before the next received one as lost; all if none is left.
    fn skip(&mut self) {
        self.delivered = self.waiting.keys().next().map_or(self.last, |next| next - 1);
    }

    /// Forwards the samples that are next.
    fn flush(&mut self, now: u64, deliver: &mut dyn FnMut(T)) {
        let before = self.delivered;
        while let Some((bytes, sample)) = self.waiting.remove(&(self.delivered + 1)) {
            self.delivered += 1;
            self.bytes -= bytes;
            deliver(sample);
        }
        if self.delivered >= self.last {
            (self.missing, self.queried) = (None, None);
        } else if self.missing.is_none() || self.delivered > before {
            self.missing = Some(now);
        }
    }
}

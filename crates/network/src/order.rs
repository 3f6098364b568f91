//! Numbered samples in their order, when some of them are lost on their way.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Limit of a source's samples that wait for earlier ones, and of their bytes.
/// Data of others must not fill the memory.
const WAITING: usize = 512;
const WAITING_BYTES: usize = 32 << 20;

/// Sources whose samples are followed, at most.
const SOURCES: usize = 16;

/// Period between two queries for missing samples, ns.
/// A query right after a link is back may be lost.
pub const RETRY: u64 = 100_000_000;

/// Time without an answer after which missing samples are lost, ns.
const ANSWER_TIMEOUT: u64 = 5_000_000_000;

/// Number of answers without the next sample after which it counts as lost.
/// The origin no longer has it then: a full link drops parts of answers.
const MAX_EMPTY_ANSWERS: u32 = 2;

/// Number before the first one of a source.
/// Numbers of 32 bits wrap around.
const BEGIN: u64 = u32::MAX as u64;

/// Publisher: its session and its number there.
pub type SampleSource = (String, u32);

/// Reordering of publishers' samples by their numbers, each delivered once.
/// It knows which samples are missing.
pub struct SampleOrder<T> {
    sources: BTreeMap<SampleSource, SourceOrder<T>>,
    /// Single source: all samples are of one agent.
    /// Another publisher then replaces the previous one, and is followed from its first sample on.
    is_of_agent: bool,
}

struct SourceOrder<T> {
    /// Number of the last sample passed on, and of the last one announced.
    passed: u64,
    last: u64,
    /// Samples with their bytes.
    waiting: BTreeMap<u64, (usize, T)>,
    bytes: usize,
    /// Time since samples are missing, and time of the query for them, ns.
    missing: Option<u64>,
    asked: Option<u64>,
    /// First number of the pending query, and the number of its useless answers.
    /// An answer is useless if it has not brought the next sample.
    question: Option<u64>,
    empty_answers: u32,
    /// Time of the last sample, ns.
    heard: u64,
}

impl<T> SampleOrder<T> {
    pub fn new(is_of_agent: bool) -> Self {
        Self { sources: BTreeMap::new(), is_of_agent }
    }

    /// Takes a sample that arrived at `now`, ns, with its size in bytes.
    /// Calls `pass` with those whose turn it is.
    pub fn take(
        &mut self,
        (source, number): (&SampleSource, u32),
        (bytes, sample): (usize, T),
        now: u64,
        pass: &mut dyn FnMut(T),
    ) {
        let first = self.first(number);
        let order = self.follow(source, first, now, pass);
        let number = order.whole(number);
        if number > order.passed {
            order.keep(number, bytes, sample);
        }
        order.flush(now, pass);
        while order.waiting.len() > WAITING || order.bytes > WAITING_BYTES {
            order.skip();
            order.flush(now, pass);
        }
    }

    /// Takes note of the last number of a source.
    /// A source without samples begins with its next one, unless it replaces another one.
    pub fn announce(&mut self, source: &SampleSource, number: u32, now: u64, pass: &mut dyn FnMut(T)) {
        if !self.sources.contains_key(source) && (self.sources.is_empty() || !self.is_of_agent) {
            return;
        }
        let order = self.follow(source, BEGIN, now, pass);
        order.last = order.last.max(order.whole(number));
        order.flush(now, pass);
    }

    /// Returns the sources to query at `now`, each with its first missing number.
    pub fn due(&mut self, now: u64) -> Vec<(SampleSource, u32)> {
        let is_due = |order: &SourceOrder<T>| {
            order.missing.is_some()
                && order.question.is_none()
                && order.asked.is_none_or(|asked| now.saturating_sub(asked) >= RETRY)
        };
        let due = self.sources.iter_mut().filter(|(_, order)| is_due(order));
        due.map(|(source, order)| {
            let first = order.passed + 1;
            (order.question, order.asked) = (Some(first), Some(now));
            // The lower half.
            (source.clone(), first as u32)
        })
        .collect()
    }

    /// Returns whether samples are missing.
    pub fn is_waiting(&self) -> bool {
        self.sources.values().any(|order| order.missing.is_some())
    }

    /// Ends a question. The origin no longer has samples that several answers lack.
    pub fn answered(&mut self, source: &SampleSource, is_answered: bool, now: u64, pass: &mut dyn FnMut(T)) {
        let Some(order) = self.sources.get_mut(source) else { return };
        let is_empty_answers = order.question.take().is_some_and(|first| order.passed < first);
        order.empty_answers = if is_empty_answers { order.empty_answers + u32::from(is_answered) } else { 0 };
        let is_late = order.missing.is_some_and(|since| now.saturating_sub(since) > ANSWER_TIMEOUT);
        if order.empty_answers >= MAX_EMPTY_ANSWERS || is_late {
            order.empty_answers = 0;
            order.skip();
            order.flush(now, pass);
        }
    }

    /// Returns the number before the first one of a newly followed source.
    fn first(&self, number: u32) -> u64 {
        if self.is_of_agent && !self.sources.is_empty() { BEGIN } else { BEGIN + u64::from(number) }
    }

    fn follow(
        &mut self,
        source: &SampleSource,
        passed: u64,
        now: u64,
        pass: &mut dyn FnMut(T),
    ) -> &mut SourceOrder<T> {
        if !self.sources.contains_key(source) {
            if self.is_of_agent {
                for (_, mut order) in std::mem::take(&mut self.sources) {
                    std::mem::take(&mut order.waiting).into_values().for_each(|(_, sample)| pass(sample));
                }
            } else if self.sources.len() >= SOURCES
                && let Some(oldest) = self.sources.iter().min_by_key(|(_, order)| order.heard)
            {
                let oldest = oldest.0.clone();
                self.sources.remove(&oldest);
            }
        }
        let order = self.sources.entry(source.clone()).or_insert_with(|| SourceOrder {
            passed,
            last: passed,
            waiting: BTreeMap::new(),
            bytes: 0,
            missing: None,
            asked: None,
            question: None,
            empty_answers: 0,
            heard: now,
        });
        order.heard = now;
        order
    }
}

impl<T> SourceOrder<T> {
    /// Returns the full number of these 32 bits: the nearest to the last one.
    fn whole(&self, number: u32) -> u64 {
        // The lower half.
        let distance = i64::from(number.wrapping_sub(self.passed as u32).cast_signed());
        self.passed.saturating_add_signed(distance)
    }

    /// Lets a sample wait, unless it does already.
    fn keep(&mut self, number: u64, bytes: usize, sample: T) {
        self.last = self.last.max(number);
        let Entry::Vacant(place) = self.waiting.entry(number) else { return };
        place.insert((bytes, sample));
        self.bytes += bytes;
    }

    /// Counts the samples before the next received one as lost; all if none is left.
    fn skip(&mut self) {
        self.passed = self.waiting.keys().next().map_or(self.last, |next| next - 1);
    }

    /// Forwards the samples that are next.
    fn flush(&mut self, now: u64, pass: &mut dyn FnMut(T)) {
        let before = self.passed;
        while let Some((bytes, sample)) = self.waiting.remove(&(self.passed + 1)) {
            self.passed += 1;
            self.bytes -= bytes;
            pass(sample);
        }
        if self.passed >= self.last {
            (self.missing, self.asked) = (None, None);
        } else if self.missing.is_none() || self.passed > before {
            self.missing = Some(now);
        }
    }
}

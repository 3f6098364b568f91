use std::cell::Cell;
use std::io::{self, Write};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::events::Events;
use super::json::Quoted;
use super::ring::Ring;
use super::span::{Label, Span};

/// Maximum number of labels.
const LABEL_LIMIT: usize = 65_536;
/// Maximum number of tracks.
const TRACK_LIMIT: usize = 4096;

/// Summary of an export: written and missing spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Spans written.
    pub spans: u64,
    /// Spans that were overwritten while they were read.
    pub torn: u64,
    /// Spans of all times that had been overwritten before.
    pub overwritten: u64,
    /// Time from which no span is missing, ns.
    /// Later than requested if older spans were overwritten. The file says so too.
    pub complete_from: u64,
}

/// Reason why a track or label does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// Track with a writer already.
    #[error("the track `{name}` has a writer already")]
    Taken {
        /// Name.
        name: String,
    },
    /// Limit of the number of tracks or labels.
    #[error("no room in the trace for `{name}`: there are {limit}, which is the limit")]
    TooMany {
        /// Name.
        name: String,
        /// Maximum number.
        limit: usize,
    },
}

/// Trace of the recent past: a ring of spans per thread.
///
/// ```
/// use slate_engine::timing::{Span, Trace};
///
/// let trace = Trace::new(1024);
/// let act = trace.label("act")?;
/// let track = trace.track("main loop")?;
/// track.record(Span { label: act, start: 1_000, duration: 250, cycle: 1 });
///
/// // A file that https://ui.perfetto.dev opens.
/// let mut file = Vec::new();
/// assert_eq!(trace.export(0, 2_000, &mut file)?.spans, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Trace {
    capacity: usize,
    lanes: Mutex<Vec<Lane>>,
    labels: Mutex<Vec<Arc<str>>>,
}

/// Ring of a track.
/// A track has several if a writer came before its predecessor was gone.
#[derive(Clone, Debug)]
pub(super) struct Lane {
    pub name: Arc<str>,
    /// Number of the track, from 1.
    pub track: usize,
    pub ring: Arc<Ring>,
}

/// Writer of a track: spans of a thread, or of a role that threads share in turn.
/// A track has one writer.
#[derive(Debug)]
pub struct TraceTrack {
    ring: Arc<Ring>,
    /// Two threads must not write at a time.
    unshared: PhantomData<Cell<()>>,
}

impl Trace {
    /// Returns a trace of `capacity` spans per track, at least one; 40 bytes each.
    pub fn new(capacity: usize) -> Self {
        Self { capacity, lanes: Mutex::default(), labels: Mutex::default() }
    }

    /// Returns the label of that name; the same one each time.
    ///
    /// # Errors
    /// When there are too many.
    pub fn label(&self, name: &str) -> Result<Label, TraceError> {
        let mut labels = lock(&self.labels);
        let index = match labels.iter().position(|label| **label == *name) {
            Some(index) => index,
            None if labels.len() == LABEL_LIMIT => {
                return Err(TraceError::TooMany { name: name.into(), limit: LABEL_LIMIT });
            }
            None => {
                labels.push(name.into());
                labels.len() - 1
            }
        };
        Ok(Label(index as u32))
    }

    /// Returns the writer of that track.
    /// Its spans stay when the writer is dropped, and the next one continues the track.
    ///
    /// # Errors
    /// When it has a writer, or there are too many.
    pub fn track(&self, name: &str) -> Result<TraceTrack, TraceError> {
        self.track_with(name, self.capacity)
    }

    /// Acts as [`track`](Trace::track), for a track of another capacity in spans.
    /// A track that exists already stays unchanged.
    ///
    /// # Errors
    /// As for [`track`](Trace::track).
    pub fn track_with(&self, name: &str, capacity: usize) -> Result<TraceTrack, TraceError> {
        self.lane(name, capacity, false)
    }

    /// Acts as [`track`](Trace::track), also if it has a writer that is about to end.
    /// Both write to it meanwhile.
    ///
    /// # Errors
    /// When there are too many.
    pub fn track_after(&self, name: &str) -> Result<TraceTrack, TraceError> {
        self.lane(name, self.capacity, true)
    }

    fn lane(&self, name: &str, capacity: usize, is_shared: bool) -> Result<TraceTrack, TraceError> {
        let mut lanes = lock(&self.lanes);
        let mut same = lanes.iter().filter(|lane| *lane.name == *name).peekable();
        let first = same.peek().map(|lane| lane.track);
        if let Some(lane) = same.find(|lane| lane.ring.claim_writer()) {
            return Ok(TraceTrack::new(Arc::clone(&lane.ring)));
        }
        if first.is_some() && !is_shared {
            return Err(TraceError::Taken { name: name.into() });
        }
        if lanes.len() == TRACK_LIMIT {
            return Err(TraceError::TooMany { name: name.into(), limit: TRACK_LIMIT });
        }
        let ring = Arc::new(Ring::new(capacity));
        let track = first.unwrap_or(lanes.len() + 1);
        lanes.push(Lane { name: name.into(), track, ring: Arc::clone(&ring) });
        Ok(TraceTrack::new(ring))
    }

    /// Returns the rings from index `first` on.
    /// They stay, so that a ring seen once need not be searched again.
    pub(super) fn lanes_from(&self, first: usize) -> Vec<Lane> {
        lock(&self.lanes).get(first..).map_or(Vec::new(), <[_]>::to_vec)
    }

    /// Writes the spans that overlap `from` to `to` (ns, exclusive) as a trace file.
    /// The format is Chrome's JSON trace events, one track per thread. No writer of a track is disturbed: spans that it
    /// overwrites meanwhile are left out and counted.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn export(&self, from: u64, to: u64, writer: impl Write) -> io::Result<Exported> {
        let mut events = Events::begin(writer)?;
        let mut exported = Exported { complete_from: from, ..Exported::default() };
        let mut labels = Labels::default();
        let mut spans = Vec::new();
        for Lane { name, track, ring } in &self.lanes_from(0) {
            spans.clear();
            let (mut read, mut next, mut complete_from) = (0, 0, from);
            let range = ring.read(0, |number, words| {
                let span = Span::from_words(words);
                if number != next {
                    // Spans are recorded when they end, so what is missing has ended by the end of this one.
                    complete_from = span.end();
                }
                (read, next) = (read + 1, number + 1);
                if span.is_within(from, to) {
                    spans.push(span);
                }
            });
            if next < range.end {
                complete_from = to;
            }
            exported.overwritten += range.start;
            exported.torn += range.end - range.start - read;
            exported.spans += spans.len() as u64;
            events.track(*track, name)?;
            if complete_from > from {
                events.gap(*track, complete_from, None)?;
                exported.complete_from = exported.complete_from.max(complete_from);
            }
            spans.sort_unstable_by_key(Span::order);
            for span in &spans {
                events.span(*track, labels.text(self, span.label), span)?;
            }
        }
        events.end()?;
        Ok(exported)
    }
}

impl TraceTrack {
    fn new(ring: Arc<Ring>) -> Self {
        Self { ring, unshared: PhantomData }
    }

    /// Records a span when it has ended.
    #[inline]
    pub fn record(&self, span: Span) {
        self.ring.write(span.to_words());
    }
}

impl Drop for TraceTrack {
    fn drop(&mut self) {
        self.ring.release();
    }
}

/// Labels as JSON strings.
#[derive(Debug, Default)]
pub(super) struct Labels(Vec<String>);

impl Labels {
    /// Returns the label of a span.
    /// It exists, as it was made before the span was recorded.
    pub fn text(&mut self, trace: &Trace, label: Label) -> &str {
        let index = label.0 as usize;
        if index >= self.0.len() {
            let labels = lock(&trace.labels);
            self.0.extend(labels.iter().skip(self.0.len()).map(|label| Quoted(label).to_string()));
        }
        self.0.get(index).map_or("\"\"", String::as_str)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

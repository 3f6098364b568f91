use std::io::{self, BufWriter, Write};
use std::sync::Arc;

use slate_sorted::SortedMap;

use super::events::Events;
use super::span::Span;
use super::trace::{Labels, Lane, Trace};

/// Summary of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Begin, ns.
    pub from: u64,
    /// End, or present end of a recording in progress, ns.
    pub to: u64,
    /// Tracks with spans, in the order of their first span.
    pub tracks: Vec<RecordedTrack>,
}

/// Summary of a track in a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedTrack {
    /// Name.
    pub name: String,
    /// Number of recorded spans.
    pub spans: u64,
    /// Number of spans overwritten before they could be recorded.
    pub missing: u64,
}

impl Recorded {
    /// Returns the number of recorded spans.
    pub fn spans(&self) -> u64 {
        self.tracks.iter().map(|track| track.spans).sum()
    }

    /// Returns the number of spans overwritten before they could be recorded.
    pub fn missing(&self) -> u64 {
        self.tracks.iter().map(|track| track.missing).sum()
    }
}

/// Recorder of all spans of a trace from its beginning on, whatever its length.
/// It must be drained often enough: before any track has recorded more spans than its ring holds. Missed spans are
/// counted and marked in the file.
///
/// ```
/// use std::sync::Arc;
/// use slate_engine::timing::{Recorder, Span, Trace};
///
/// let trace = Arc::new(Trace::new(8));
/// let (label, track) = (trace.label("act")?, trace.track("main loop")?);
/// let mut recorder = Recorder::begin(&trace, 0, Vec::new())?;
/// for cycle in 0..100 {
///     track.record(Span { label, start: cycle * 10, duration: 5, cycle });
///     if cycle % 8 == 7 {
///         recorder.drain()?;
///     }
/// }
/// let (recorded, file) = recorder.end(1000)?;
/// assert_eq!((recorded.spans(), recorded.missing()), (100, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Recorder<W: Write> {
    trace: Arc<Trace>,
    events: Events<BufWriter<W>>,
    labels: Labels,
    lanes: Vec<RingReader>,
    /// Index in `recorded` by the number of the track.
    track_indices: SortedMap<usize, usize>,
    recorded: Recorded,
}

/// Ring, with the position of the reader.
#[derive(Debug)]
struct RingReader {
    lane: Lane,
    /// Number of the next entry.
    next: u64,
    /// Read and not written yet.
    unwritten: Vec<Span>,
    /// Number of spans missing after the last one read.
    missing: u64,
}

/// Maximum number of spans of a cycle that are sorted; more are written unordered.
const SORTED_SPAN_LIMIT: usize = 1 << 16;

/// Size of a write, bytes.
const WRITE_SIZE: usize = 1 << 18;

impl<W: Write> Recorder<W> {
    /// Begins with the spans recorded from `from` on, which is the present time, ns.
    /// The beginning of the file is written at once, so that an error of the writer shows early.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn begin(trace: &Arc<Trace>, from: u64, writer: W) -> io::Result<Self> {
        let lanes = trace.lanes_from(0).into_iter();
        let lanes = lanes
            .map(|lane| {
                let next = lane.ring.written();
                RingReader::new(lane, next)
            })
            .collect();
        let mut events = Events::begin(BufWriter::with_capacity(WRITE_SIZE, writer))?;
        events.flush()?;
        Ok(Self {
            trace: Arc::clone(trace),
            events,
            labels: Labels::default(),
            lanes,
            track_indices: SortedMap::new(),
            recorded: Recorded { from, to: from, tracks: Vec::new() },
        })
    }

    /// Returns the summary so far; its end is not known yet, and equals its beginning.
    pub fn recorded(&self) -> &Recorded {
        &self.recorded
    }

    /// Writes the spans recorded since the last call.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn drain(&mut self) -> io::Result<()> {
        self.write_new_spans(false)
    }

    /// Ends the recording at `to`, ns, after a last drain.
    /// Spans that began later are left out, so that all tracks end together.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn end(mut self, to: u64) -> io::Result<(Recorded, W)> {
        self.recorded.to = to;
        self.write_new_spans(true)?;
        let writer = self.events.end()?;
        Ok((self.recorded, writer.into_inner().map_err(io::IntoInnerError::into_error)?))
    }

    fn write_new_spans(&mut self, last: bool) -> io::Result<()> {
        let Self { trace, events, labels, lanes, track_indices, recorded } = self;
        lanes.extend(trace.lanes_from(lanes.len()).into_iter().map(|lane| RingReader::new(lane, 0)));
        for reader in lanes {
            let (spans, gaps) = reader.read(if last { recorded.to } else { u64::MAX });
            if spans > 0 || reader.missing > 0 || !gaps.is_empty() {
                let number = reader.lane.track;
                let index = match track_indices.get(&number) {
                    Some(index) => *index,
                    None => {
                        let name = reader.lane.name.to_string();
                        events.track(number, &name)?;
                        recorded.tracks.push(RecordedTrack { name, spans: 0, missing: 0 });
                        track_indices.insert(number, recorded.tracks.len() - 1);
                        recorded.tracks.len() - 1
                    }
                };
                let track = &mut recorded.tracks[index];
                track.spans += spans;
                for (until, missing) in gaps {
                    track.missing += missing;
                    events.gap(number, until, Some(missing))?;
                }
                if last && reader.missing > 0 {
                    track.missing += reader.missing;
                    events.gap(number, recorded.to, Some(reader.missing))?;
                }
            }
            reader.write(last, |track, span| events.span(track, labels.text(trace, span.label), span))?;
        }
        Ok(())
    }
}

impl RingReader {
    fn new(lane: Lane, next: u64) -> Self {
        Self { lane, next, unwritten: Vec::new(), missing: 0 }
    }

    /// Reads new spans that began before `to`, ns.
    /// Returns their number, and the gaps: the time until which spans are missing, and their number.
    fn read(&mut self, to: u64) -> (u64, Vec<(u64, u64)>) {
        let Self { lane, next, unwritten, missing } = self;
        let (before, mut gaps) = (unwritten.len(), Vec::new());
        let range = lane.ring.read(*next, |number, words| {
            let span = Span::from_words(words);
            *missing += number - *next;
            if *missing > 0 {
                // Spans are recorded when they end, so what is missing has ended by the end of this one.
                gaps.push((span.end(), std::mem::take(missing)));
            }
            *next = number + 1;
            if span.start < to {
                unwritten.push(span);
            }
        });
        *missing += range.end - *next;
        *next = range.end;
        ((unwritten.len() - before) as u64, gaps)
    }

    /// Writes the spans in order.
    /// Those of the newest cycle wait: the cycle itself ends after all its spans.
    fn write(&mut self, last: bool, mut write: impl FnMut(usize, &Span) -> io::Result<()>) -> io::Result<()> {
        self.unwritten.sort_unstable_by_key(Span::order);
        let newest = self.unwritten.iter().map(|span| span.cycle).max();
        let newest_cycle = newest.filter(|_| !last && self.unwritten.len() < SORTED_SPAN_LIMIT);
        for span in self.unwritten.iter().filter(|span| Some(span.cycle) != newest_cycle) {
            write(self.lane.track, span)?;
        }
        self.unwritten.retain(|span| Some(span.cycle) == newest_cycle);
        Ok(())
    }
}

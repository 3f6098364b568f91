use std::cell::Cell;
use std::cmp::Reverse;
use std::io::{self, Write};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::json::{Microseconds, Quoted};
use super::ring::Ring;

/// How many labels there may be.
const LABEL_LIMIT: usize = 65_536;
/// How many tracks there may be.
const TRACK_LIMIT: usize = 4096;

/// What a span is called: a module or a stage. Made once, so that recording copies a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label(u32);

/// Something that took some time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// What.
    pub label: Label,
    /// When it began, the agent's time in nanoseconds.
    pub start: u64,
    /// How long it took, nanoseconds.
    pub duration: u64,
    /// The number of the main loop's cycle.
    pub cycle: u64,
}

/// What an export has written, and what it could not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Spans written.
    pub spans: u64,
    /// Spans that were overwritten while they were read.
    pub torn: u64,
    /// Spans of all times that had been overwritten before. The trace may not reach back as far as was asked.
    pub overwritten: u64,
}

/// Why there is no such track or label.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// A track has one writer.
    #[error("the track `{name}` has a writer already")]
    Taken {
        /// Its name.
        name: String,
    },
    /// There are as many as there may be.
    #[error("no room in the trace for `{name}`: there are {limit}, which is the limit")]
    TooMany {
        /// The name.
        name: String,
        /// How many there may be.
        limit: usize,
    },
}

/// What ran when, of the last while: a ring of spans per thread.
///
/// ```
/// use slate_runtime::timing::{Span, Trace};
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
    tracks: Mutex<Vec<Named<Arc<Ring>>>>,
    labels: Mutex<Vec<Arc<str>>>,
}

#[derive(Clone, Debug)]
struct Named<T> {
    name: Arc<str>,
    value: T,
}

/// The spans of one thread, or of a role that one thread after the other has. It has one writer, this.
#[derive(Debug)]
pub struct Track {
    ring: Arc<Ring>,
    /// Two threads must not write at a time.
    unshared: PhantomData<Cell<()>>,
}

impl Trace {
    /// A trace that keeps so many spans per track, at least one; 40 bytes each.
    pub fn new(capacity: usize) -> Self {
        Self { capacity, tracks: Mutex::default(), labels: Mutex::default() }
    }

    /// The label of that name; the same one each time.
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

    /// The track of that name, to write to. Its spans stay when the writer is dropped, and the next one goes on.
    ///
    /// # Errors
    /// When it has a writer, or there are too many.
    pub fn track(&self, name: &str) -> Result<Track, TraceError> {
        let mut tracks = lock(&self.tracks);
        if let Some(track) = tracks.iter().find(|track| *track.name == *name) {
            let taken = || TraceError::Taken { name: name.into() };
            return track.value.take().then(|| Track::new(Arc::clone(&track.value))).ok_or_else(taken);
        }
        if tracks.len() == TRACK_LIMIT {
            return Err(TraceError::TooMany { name: name.into(), limit: TRACK_LIMIT });
        }
        let ring = Arc::new(Ring::new(self.capacity));
        tracks.push(Named { name: name.into(), value: Arc::clone(&ring) });
        Ok(Track::new(ring))
    }

    /// Writes the spans that were under way at any time from `from` to `to` (nanoseconds, without that one itself) as
    /// Chrome's JSON trace events, one track per thread. No writer of a track is disturbed: what it overwrites meanwhile
    /// is left out and counted.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn export(&self, from: u64, to: u64, mut writer: impl Write) -> io::Result<Exported> {
        let tracks = lock(&self.tracks).clone();
        let mut exported = Exported::default();
        writer.write_all(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n")?;
        write!(
            writer,
            "{{\"ph\":\"M\",\"pid\":1,\"tid\":0,\"name\":\"process_name\",\"args\":{{\"name\":\"slate\"}}}}"
        )?;
        let mut spans = Vec::new();
        for (number, Named { name, value: ring }) in (1_u32..).zip(&tracks) {
            spans.clear();
            let (torn, overwritten) = ring.read(|words| {
                let span = Span::from_words(words);
                if span.is_within(from, to) {
                    spans.push(span);
                }
            });
            exported.torn += torn;
            exported.overwritten += overwritten;
            exported.spans += spans.len() as u64;
            // What began first stands first, and around what began with it.
            spans.sort_by_key(|span| (span.start, Reverse(span.duration)));
            write!(
                writer,
                ",\n{{\"ph\":\"M\",\"pid\":1,\"tid\":{number},\"name\":\"thread_name\",\"args\":{{\"name\":{}}}}}",
                Quoted(name)
            )?;
            // Labels are made before they are recorded, so those of the spans are there.
            let labels = lock(&self.labels).clone();
            for span in &spans {
                let label = labels.get(span.label.0 as usize).map_or("", |label| label);
                write!(
                    writer,
                    ",\n{{\"ph\":\"X\",\"pid\":1,\"tid\":{number},\"name\":{},\"ts\":{},\"dur\":{},\
                     \"args\":{{\"cycle\":{}}}}}",
                    Quoted(label),
                    Microseconds(span.start),
                    Microseconds(span.duration),
                    span.cycle
                )?;
            }
        }
        writer.write_all(b"\n]}\n")?;
        writer.flush()?;
        Ok(exported)
    }
}

impl Track {
    fn new(ring: Arc<Ring>) -> Self {
        Self { ring, unshared: PhantomData }
    }

    /// Records a span when it has ended.
    #[inline]
    pub fn record(&self, span: Span) {
        self.ring.write([u64::from(span.label.0), span.start, span.duration, span.cycle]);
    }
}

impl Drop for Track {
    fn drop(&mut self) {
        self.ring.release();
    }
}

impl Span {
    fn from_words([label, start, duration, cycle]: [u64; 4]) -> Self {
        Self { label: Label(label as u32), start, duration, cycle }
    }

    fn is_within(&self, from: u64, to: u64) -> bool {
        let end = self.start.saturating_add(self.duration);
        self.start < to && (end > from || self.start >= from)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

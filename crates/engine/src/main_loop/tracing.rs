//! Trace of the loop and its modules.

use std::io::{self, Write};
use std::sync::{Arc, OnceLock};

use super::{SharedLoop, WatchedModule};
use crate::clock::monotonic;
use crate::timing::{Exported, Label, Recorder, Recording, Span, Switch, Trace, TraceTrack};

/// Spans kept of each module.
const MODULE_SPAN_LIMIT: usize = 4096;
/// Number of spans kept of the loop with its stages, about a dozen a cycle.
const LOOP_SPAN_LIMIT: usize = 16 * MODULE_SPAN_LIMIT;

/// Trace of an agent; off, and then free, until it is started.
pub struct Tracing {
    switch: Arc<Switch>,
    trace: Arc<Trace>,
    /// Track of cycles and stages, written by the holder of the loop's token.
    track: OnceLock<Option<TraceTrack>>,
    pub(super) cycle: Option<Label>,
}

impl Default for Tracing {
    fn default() -> Self {
        let trace = Arc::new(Trace::new(MODULE_SPAN_LIMIT));
        let cycle = trace.label("cycle").ok();
        Self { switch: Arc::default(), trace, track: OnceLock::new(), cycle }
    }
}

impl Tracing {
    #[inline]
    pub(super) fn is_on(&self) -> bool {
        // A reader of true also sees the tracks.
        self.switch.is_on()
    }

    pub(super) fn trace(&self) -> &Trace {
        &self.trace
    }

    /// Lets the steps of modules that came be recorded.
    pub(super) fn add_tracks(&self, watched: &[WatchedModule]) {
        if self.is_on() {
            watched.iter().for_each(|watch| watch.cell.add_track(&self.trace));
        }
    }

    /// Records a span of the loop, for the holder of its token.
    pub(super) fn record(&self, span: Span) {
        if let Some(Some(track)) = self.track.get() {
            track.record(span);
        }
    }
}

/// Trace of an agent's modules and main loop, from `Agent::trace`.
/// It is off at first, and then costs nothing.
///
/// Each module is a track, and so is the main loop, with its cycles and the stages in them. Times are wall-clock
/// nanoseconds since the start of the agent: on the system's clock they are its time, and under a time source they
/// distinguish events at the same virtual time.
///
/// [`record`](AgentTrace::record) writes all that happens from then on, however long. [`start`](AgentTrace::start) keeps
/// the last 4096 ticks of each module (65536 cycles and stages), of which [`export`](AgentTrace::export) writes a part when
/// something has happened.
#[derive(Clone)]
pub struct AgentTrace {
    shared: Arc<SharedLoop>,
}

impl std::fmt::Debug for AgentTrace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AgentTrace").field("on", &self.is_on()).finish_non_exhaustive()
    }
}

impl AgentTrace {
    /// Returns the trace of that loop.
    pub fn new(shared: Arc<SharedLoop>) -> Self {
        Self { shared }
    }

    /// Starts recording; every step is then timed.
    /// Each start is ended by a [`stop`](AgentTrace::stop) of its own.
    pub fn start(&self) {
        self.switch_on(|switch| switch.start());
    }

    /// Ends a [`start`](AgentTrace::start).
    /// Recording continues for other users. The recorded spans can still be exported.
    pub fn stop(&self) {
        self.shared.tracing.switch.stop();
    }

    /// Writes all spans from now on until the [`Recording`] is ended.
    /// A thread of its own writes a file that <https://ui.perfetto.dev> and Chrome's `about:tracing` open. There may be
    /// several at a time. Spans that come faster than the writer takes them are counted as missing, here and in the
    /// file, and the recorded threads never wait.
    ///
    /// ```
    /// # fn work(trace: &slate_engine::main_loop::AgentTrace, run_cycles: impl FnOnce()) -> std::io::Result<()> {
    /// let recording = trace.record(std::fs::File::create("trace.json")?)?;
    /// run_cycles();
    /// let (recorded, _file) = recording.end()?;
    /// println!("{} spans, and {} are missing", recorded.spans(), recorded.missing());
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// When the beginning of the file can't be written, or there is no thread left.
    pub fn record<W: Write + Send + 'static>(&self, writer: W) -> io::Result<Recording<W>> {
        let tracing = &self.shared.tracing;
        let lease = self.switch_on(|switch| switch.lease());
        let recorder = Recorder::begin(&tracing.trace, self.now(), writer)?;
        Recording::begin(recorder, lease, Arc::clone(&self.shared.clock))
    }

    fn switch_on<R>(&self, switch_on: impl FnOnce(&Arc<Switch>) -> R) -> R {
        let tracing = &self.shared.tracing;
        tracing.track.get_or_init(|| tracing.trace.track_with("main loop", LOOP_SPAN_LIMIT).ok());
        self.shared.watched().iter().for_each(|watch| watch.cell.add_track(&tracing.trace));
        let result = switch_on(&tracing.switch);
        // Modules that came meanwhile.
        tracing.add_tracks(&self.shared.watched());
        result
    }

    /// Returns true while it records.
    pub fn is_on(&self) -> bool {
        self.shared.tracing.is_on()
    }

    /// Returns the present time in the time base of spans, ns.
    pub fn now(&self) -> u64 {
        self.shared.clock.at(monotonic())
    }

    /// Writes the recorded spans that overlap `from` to `to`, ns.
    /// The file is like that of [`record`](AgentTrace::record). It disturbs no recorded thread.
    /// [`Exported::complete_from`] says whether it goes back as far as was requested.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn export(&self, from: u64, to: u64, writer: impl Write) -> io::Result<Exported> {
        self.shared.tracing.trace.export(from, to, writer)
    }
}

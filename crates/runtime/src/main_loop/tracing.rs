//! A trace of what the loop and its modules did when.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use super::{Shared, Watch};
use crate::clock::monotonic;
use crate::timing::{Exported, Label, Span, Trace, Track};

/// Spans kept of each module, and of the loop with its stages.
const SPANS: usize = 4096;

/// The trace of an agent; off, and then free, until somebody starts it.
pub(crate) struct Tracing {
    on: AtomicBool,
    trace: Trace,
    /// The spans of cycles and stages. Written by who has the loop's token.
    track: OnceLock<Track>,
    pub(super) cycle: Option<Label>,
}

impl Default for Tracing {
    fn default() -> Self {
        let trace = Trace::new(SPANS);
        let cycle = trace.label("cycle").ok();
        Self { on: AtomicBool::new(false), trace, track: OnceLock::new(), cycle }
    }
}

impl Tracing {
    #[inline]
    pub(super) fn is_on(&self) -> bool {
        // Whoever sees it also sees the tracks.
        self.on.load(Ordering::Acquire)
    }

    pub(super) fn trace(&self) -> &Trace {
        &self.trace
    }

    /// Lets the steps of modules that came be recorded.
    pub(super) fn add_tracks(&self, watched: &[Watch]) {
        if self.is_on() {
            watched.iter().for_each(|watch| watch.seat.add_track(&self.trace));
        }
    }

    /// Records what the loop did; whoever has its token does.
    pub(super) fn record(&self, span: Span) {
        if let Some(track) = self.track.get() {
            track.record(span);
        }
    }
}

/// What the modules of an agent and its main loop did when, from [`Agent::trace`](crate::Agent::trace). It is off at
/// first, and then costs nothing.
///
/// Each module is a track, and so is the main loop, with its cycles and the stages in them; of each the last 4096 spans are
/// kept. Times are wall-clock nanoseconds since the start of the agent: on the system's clock they are its time, and under
/// a time source they tell apart what happens at the same virtual time.
#[derive(Clone)]
pub struct AgentTrace {
    shared: Arc<Shared>,
}

impl std::fmt::Debug for AgentTrace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AgentTrace").field("on", &self.is_on()).finish_non_exhaustive()
    }
}

impl AgentTrace {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }

    /// Begins to record. Every step is then timed.
    pub fn start(&self) {
        let tracing = &self.shared.tracing;
        if tracing.track.get().is_none()
            && let Ok(track) = tracing.trace.track("main loop")
        {
            // Who was faster has made the same.
            let _ = tracing.track.set(track);
        }
        self.shared.watched().iter().for_each(|watch| watch.seat.add_track(&tracing.trace));
        tracing.on.store(true, Ordering::Release);
        // Modules that came meanwhile.
        tracing.add_tracks(&self.shared.watched());
    }

    /// Ends recording; what was recorded can still be exported.
    pub fn stop(&self) {
        self.shared.tracing.on.store(false, Ordering::Release);
    }

    /// Whether it records.
    pub fn is_on(&self) -> bool {
        self.shared.tracing.is_on()
    }

    /// The present time as spans have it, nanoseconds.
    pub fn now(&self) -> u64 {
        self.shared.clock.at(monotonic())
    }

    /// Writes what was under way at any time from `from` to `to` (nanoseconds) as a file that <https://ui.perfetto.dev> and
    /// Chrome's `about:tracing` open. It disturbs nobody who is recorded.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn export(&self, from: u64, to: u64, writer: impl Write) -> io::Result<Exported> {
        self.shared.tracing.trace.export(from, to, writer)
    }
}

//! Measurements of the loop and its stages, and the properties that show them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::LoopState;
use crate::synchronization::{Emitter, Synchronization};
use crate::timing::{Histogram, Label, LiveHistogram, TimingHistogram, Trace};
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{Descriptor, Interface, View};
use slate_blackboard::{Access, Board};
use slate_composition::{LOOP_STORE, stage_histogram};

/// Measurements of the loop.
#[derive(Debug, Default)]
pub(super) struct LoopGauges {
    pub cycles: AtomicU64,
    pub overruns: AtomicU64,
    pub refused_times: AtomicU64,
    pub last: AtomicU64,
    pub histogram: LiveHistogram,
}

impl LoopGauges {
    fn state(&self) -> LoopState {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        LoopState {
            cycles: load(&self.cycles),
            overruns: load(&self.overruns),
            refused_times: load(&self.refused_times),
            last: load(&self.last),
            longest: self.histogram.max(),
        }
    }
}

/// Measurements of a stage, and its events.
pub(super) struct StageGauge {
    pub name: Arc<str>,
    pub histogram: LiveHistogram,
    pub publication: HistogramPublisher,
    pub start: Option<Emitter>,
    pub end: Option<Emitter>,
    /// Name in the trace.
    pub label: Option<Label>,
}

impl StageGauge {
    pub fn new(name: &str, synchronization: &Synchronization, trace: &Trace) -> Self {
        let emitter = |end| synchronization.emitter(&format!("/stage/{name}/{end}"), "main loop").ok();
        Self {
            name: name.into(),
            histogram: LiveHistogram::default(),
            publication: HistogramPublisher::new(None),
            start: emitter("start"),
            end: emitter("end"),
            label: trace.label(name).ok(),
        }
    }

    fn emitters(&self) -> impl Iterator<Item = &Emitter> {
        self.start.iter().chain(&self.end)
    }

    /// Publishes the stage as one of the loop's.
    /// Its property is on the board, and waits for all events of the loop include its own.
    pub fn add_to(&self, board: &Board) {
        self.emitters().for_each(Emitter::register);
        let mut published = self.publication.locked();
        if published.0.is_none() {
            let doc = format!("Duration of the stage {}.", self.name);
            *published = (add(board, &stage_histogram(&self.name), &doc, TimingHistogram::DESCRIPTOR), 0);
        }
    }

    /// Hides a stage that is not the loop's for now; its measurements stay.
    pub fn remove_from(&self, board: &Board) {
        self.emitters().for_each(Emitter::unregister);
        if self.publication.locked().0.take().is_some() {
            // Its readers keep it.
            let _ = board.remove(&stage_histogram(&self.name));
        }
    }
}

/// Adds a property of the loop and returns its writer.
/// No module can be named `loop`, so the path is free.
fn add(board: &Board, path: &str, doc: &str, descriptor: &'static Descriptor) -> Option<Writer> {
    let property = board.add_channel(path, doc, descriptor, LOOP_STORE, Access::Output).ok()?;
    property.channel()?.writer().ok()
}

/// Property that shows a histogram.
#[derive(Debug)]
pub struct HistogramPublisher(Mutex<(Option<Writer>, u64)>);

impl HistogramPublisher {
    /// Shows histograms through that writer, if there is one.
    pub fn new(writer: Option<Writer>) -> Self {
        Self(Mutex::new((writer, 0)))
    }

    fn locked(&self) -> MutexGuard<'_, (Option<Writer>, u64)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows the histogram if it has changed.
    pub fn publish(&self, histogram: &LiveHistogram, copy: &mut Histogram, now: u64) {
        let mut writer = self.locked();
        let (Some(writer), published) = &mut *writer else { return };
        let count = histogram.count();
        if std::mem::replace(published, count) == count {
            return;
        }
        histogram.copy_to(copy);
        // Only a recorder in lockstep may hold a writer up; the next summary comes soon.
        let _ = writer.write(View::of(&mut copy.summary()).bytes(), 0, now);
    }
}

/// Publisher of the measurements.
pub(super) struct LoopPublisher {
    state: Option<Writer>,
    histogram: HistogramPublisher,
    copy: Histogram,
    /// Time of the last publication, ns of the agent's time.
    published: u64,
}

impl LoopPublisher {
    pub fn new(board: &Board) -> Self {
        let histogram = add(board, "loop/histogram", "Duration of a cycle.", TimingHistogram::DESCRIPTOR);
        Self {
            state: add(board, "loop/state", "State of the main loop.", LoopState::DESCRIPTOR),
            histogram: HistogramPublisher::new(histogram),
            copy: Histogram::default(),
            published: 0,
        }
    }
}

/// Timing is shown this often, of the agent's time and of the wall clock's.
pub(super) const PUBLICATION_PERIOD: Duration = Duration::from_millis(100);

/// Returns true if the timing was last shown an interval ago or more.
fn is_due(published: u64, now: u64) -> bool {
    now.saturating_sub(published) >= PUBLICATION_PERIOD.as_nanos() as u64
}

/// Measurements and events of the loop.
pub(super) struct LoopMeasures {
    pub gauges: LoopGauges,
    publisher: Mutex<LoopPublisher>,
    cycle_start: Option<Emitter>,
    cycle_end: Option<Emitter>,
}

impl LoopMeasures {
    pub fn new(board: &Board, synchronization: &Synchronization) -> Self {
        let emitter = |name| synchronization.emitter(name, "main loop").ok();
        Self {
            gauges: LoopGauges::default(),
            publisher: Mutex::new(LoopPublisher::new(board)),
            cycle_start: emitter("/cycle/start"),
            cycle_end: emitter("/cycle/end"),
        }
    }

    /// Emits the begin of a cycle, if it was requested.
    pub fn emit_start(&self) {
        if let Some(start) = self.cycle_start.as_ref().filter(|start| start.is_requested()) {
            start.emit();
        }
    }

    /// Emits the end of a cycle, if it was requested.
    pub fn emit_end(&self) {
        if let Some(end) = self.cycle_end.as_ref().filter(|end| end.is_requested()) {
            end.emit();
        }
    }

    fn publisher(&self) -> MutexGuard<'_, LoopPublisher> {
        self.publisher.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns true if the measurements are due for publication.
    pub fn are_due(&self, now: u64) -> bool {
        is_due(self.publisher().published, now)
    }

    /// Publishes the measurements of the loop, its stages and its modules.
    /// From any thread.
    pub fn publish<'s>(
        &self,
        now: u64,
        stages: impl Iterator<Item = &'s Arc<StageGauge>>,
        modules: impl Iterator<Item = (&'s HistogramPublisher, &'s LiveHistogram)>,
    ) {
        let mut publisher = self.publisher();
        let LoopPublisher { state, histogram, copy, published } = &mut *publisher;
        *published = now;
        let mut value = self.gauges.state();
        if let Some(state) = state {
            // As for the histograms.
            let _ = state.write(View::of(&mut value).bytes(), 0, now);
        }
        histogram.publish(&self.gauges.histogram, copy, now);
        for gauge in stages {
            gauge.publication.publish(&gauge.histogram, copy, now);
        }
        for (publication, measured) in modules {
            publication.publish(measured, copy, now);
        }
    }
}

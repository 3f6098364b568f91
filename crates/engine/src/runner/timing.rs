use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;
use slate_composition::own::ModuleTiming;
use slate_module::Frame;

use super::{Health, count};

/// Period of writing `/module/timing`, ns.
const TIMING_PERIOD: u64 = 100_000_000;

/// Timing of a module's steps.
#[repr(C)]
pub struct StepTiming {
    measured: Measured,
    /// Deadline of a step, ns.
    deadline: Option<u64>,
    /// Writes `/module/timing`.
    writer: Box<Writer>,
    /// Writer of `/module/histogram`, until the publisher takes it.
    histogram: Option<Box<Writer>>,
}

/// Measurements since the last write of `/module/timing`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Measured {
    written: u64,
    period: u64,
    longest: u64,
    jitter: u64,
}

impl StepTiming {
    /// Measures steps with a deadline, ns.
    /// Results are written to `/module/timing` and `/module/histogram`.
    pub fn new(deadline: Option<u64>, writer: Writer, histogram: Writer) -> Self {
        let (writer, histogram) = (Box::new(writer), Some(Box::new(histogram)));
        Self { measured: Measured::default(), deadline, writer, histogram }
    }

    /// Returns true if every step is timed.
    pub fn has_deadline(&self) -> bool {
        self.deadline.is_some()
    }

    /// Takes the writer of `/module/histogram`, for the publisher.
    pub fn take_histogram(&mut self) -> Option<Writer> {
        self.histogram.take().map(|writer| *writer)
    }

    /// Adds the duration of a step, wall-clock ns.
    /// It has the weight `stands_for` in the histogram.
    pub(super) fn measure(&mut self, health: &Health, duration: u64, stands_for: u32) {
        if stands_for > 0 {
            health.histogram.record(duration, stands_for);
        }
        self.measured.longest = self.measured.longest.max(duration);
        if self.deadline.is_some_and(|deadline| duration > deadline) {
            count(&health.misses);
        }
    }

    /// Counts a step.
    /// True if it is time to [show](StepTiming::show) the timing.
    #[inline]
    pub(super) fn count(&mut self, frame: &Frame) -> bool {
        let measured = &mut self.measured;
        let period = frame.elapsed;
        if frame.number > 2 {
            measured.jitter = measured.jitter.max(period.abs_diff(measured.period));
        }
        measured.period = period;
        frame.now - measured.written >= TIMING_PERIOD || frame.number == 1
    }

    /// Writes `/module/timing`.
    pub(super) fn show(&mut self, frame: &Frame, health: &Health) {
        let (measured, now) = (&mut self.measured, frame.now);
        let mut timing = ModuleTiming {
            ticks: frame.number,
            period: measured.period,
            duration: measured.longest,
            jitter: measured.jitter,
            misses: health.misses.load(Ordering::Relaxed),
        };
        *measured = Measured { written: now, period: measured.period, longest: 0, jitter: 0 };
        // Only a recorder in lockstep may hold a writer up; the next timing comes soon.
        let _ = self.writer.write(View::of(&mut timing).bytes(), 0, now);
    }

    /// Returns the measurements.
    pub(super) fn snapshot(&self) -> Measured {
        self.measured.clone()
    }

    /// Resumes from a snapshot.
    pub(super) fn restore(&mut self, measured: &Measured) {
        self.measured = measured.clone();
    }

    /// Returns the writer of `/module/timing`.
    pub(super) fn writer(&mut self) -> &mut Writer {
        &mut self.writer
    }
}

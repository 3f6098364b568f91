//! Timing: [`Histogram`]s of step durations, and a [`Trace`] of spans.
//!
//! Both cost the measured thread some nanoseconds and no allocation. They measure wall-clock time, so they are not part
//! of the reproducible results of a run.

mod events;
mod histogram;
mod json;
mod live;
mod recorder;
mod recording;
mod ring;
mod span;
mod switch;
mod trace;

pub use histogram::Histogram;
pub use live::LiveHistogram;
pub use recorder::{Recorded, RecordedTrack, Recorder};
pub use recording::Recording;
pub use slate_composition::own::TimingHistogram;
pub use span::{Label, Span};
pub use switch::Switch;
pub use trace::{Exported, Trace, TraceError, TraceTrack};

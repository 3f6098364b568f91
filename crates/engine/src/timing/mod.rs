//! Where the time goes: [`Histogram`]s of how long steps take, and a [`Trace`] of what ran when.
//!
//! Both cost the measured thread some nanoseconds and no allocation. What is measured is wall-clock time, so it stays
//! outside of what a run can repeat.

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

//! Recorder of an agent.
//! A [`Recorder`] writes whole runs, or the last seconds before a trigger, into MCAP files.
//!
//! Each write of a recorded property is in the file, in order. In lockstep the run waits for the file; in real time what
//! a slow disk cannot take is left out, and counted in the file.

mod recorder;

pub use recorder::{
    CHANGE_TOPIC, CONFIGURATION, DROPPED_TOPIC, RecordError, RecordState, Recorded, Recorder, TOPICS,
    UnmatchedPattern, unmatched_patterns,
};

/// Parts of the recorder that capture the values of a run.
/// A replay uses them for the run that it makes again.
pub mod capture {
    pub use crate::recorder::{Channel, Drain, Hub, Sink, read_change, repeats, selects, thins};
}

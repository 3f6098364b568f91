//! Recorder of an agent.
//! A [`Recorder`] writes whole runs, or the last seconds before a trigger, into MCAP files.
//!
//! Each write of a recorded property is in the file, in order. In lockstep the run waits for the file; in real time what
//! a slow disk cannot take is left out, and counted in the file.

mod recorder;

pub use recorder::{
    CHANGE_TOPIC, CONFIGURATION, Channel, DROPPED_TOPIC, Drain, Hub, RecordError, RecordState, Recorded,
    Recorder, Sink, TOPICS, UnmatchedPattern, read_change, repeats, selects, thins, unmatched_patterns,
};

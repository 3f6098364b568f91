//! Properties of the agent itself, which can be linked like outputs.

use slate_blackboard::Store;
use slate_blackboard::channel::Budget;
use slate_blackboard::interface::{Descriptor, Interface};

use crate::own::LoopState;
use crate::own::TimingHistogram;
use crate::own::{LogCounts, LogLine};

/// Capacity of the loop's properties.
pub const LOOP_STORE: Store =
    Store { capacity: 0, depth: 1, budget: Budget { latest: 16, queues: 4, window: 16 } };

/// Returns the path of the durations of a stage of the main loop.
pub fn stage_histogram(stage: &str) -> String {
    format!("loop/{stage}/histogram")
}

/// Capacity of the log's properties.
const LOG_STORE: Store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 8, window: 16 } };

/// Number of log lines that are kept.
const LOG_DEPTH: usize = 256;

/// A property of the main loop or of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Host {
    /// The state of the main loop.
    Loop,
    /// Histogram of the cycle times.
    LoopHistogram,
    /// The last lines of the log.
    LogTail,
    /// Counts of log lines.
    LogCounts,
}

impl Host {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Loop, Self::LoopHistogram, Self::LogTail, Self::LogCounts];

    /// Returns the path of the property.
    pub fn path(self) -> &'static str {
        match self {
            Self::Loop => "loop/state",
            Self::LoopHistogram => "loop/histogram",
            Self::LogTail => "log/tail",
            Self::LogCounts => "log/counts",
        }
    }

    /// Returns the interface of the property.
    pub fn descriptor(self) -> &'static Descriptor {
        match self {
            Self::Loop => LoopState::DESCRIPTOR,
            Self::LoopHistogram => TimingHistogram::DESCRIPTOR,
            Self::LogTail => LogLine::DESCRIPTOR,
            Self::LogCounts => LogCounts::DESCRIPTOR,
        }
    }

    /// Returns the capacity of the property.
    pub fn store(self) -> Store {
        match self {
            Self::Loop | Self::LoopHistogram => LOOP_STORE,
            Self::LogTail => Store { depth: LOG_DEPTH, ..LOG_STORE },
            Self::LogCounts => LOG_STORE,
        }
    }

    /// Returns the property at the beginning of a path, and the rest as the field.
    pub fn of(path: &str) -> Option<(Self, &str)> {
        Self::ALL.into_iter().find_map(|host| {
            let rest = path.strip_prefix(host.path())?;
            if rest.is_empty() { Some((host, rest)) } else { Some((host, rest.strip_prefix('/')?)) }
        })
    }
}

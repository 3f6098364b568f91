//! What the agent says of itself, beside its modules: it can be linked like any output.

use slate_blackboard::interface::{Descriptor, Interface};

use crate::log::{LogCounts, LogLine};
use crate::main_loop::LoopState;
use crate::timing::TimingHistogram;

/// A property of the main loop or of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::agent) enum Host {
    Loop,
    LoopHistogram,
    LogTail,
    LogCounts,
}

impl Host {
    pub const ALL: [Self; 4] = [Self::Loop, Self::LoopHistogram, Self::LogTail, Self::LogCounts];

    /// Where it is.
    pub fn path(self) -> &'static str {
        match self {
            Self::Loop => "loop/state",
            Self::LoopHistogram => "loop/histogram",
            Self::LogTail => "log/tail",
            Self::LogCounts => "log/counts",
        }
    }

    pub fn descriptor(self) -> &'static Descriptor {
        match self {
            Self::Loop => LoopState::DESCRIPTOR,
            Self::LoopHistogram => TimingHistogram::DESCRIPTOR,
            Self::LogTail => LogLine::DESCRIPTOR,
            Self::LogCounts => LogCounts::DESCRIPTOR,
        }
    }

    /// That of a path, and the field that the path leads to.
    pub fn of(path: &str) -> Option<(Self, &str)> {
        Self::ALL.into_iter().find_map(|host| {
            let rest = path.strip_prefix(host.path())?;
            if rest.is_empty() { Some((host, rest)) } else { Some((host, rest.strip_prefix('/')?)) }
        })
    }
}

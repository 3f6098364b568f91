//! The interfaces of what an agent says of itself: of its modules, its loop and its log.

use slate_module::{Text, interface};

/// The name of a port, as `/module/state` shows it.
pub type PortName = Text<56>;

/// How a module is: `/module/state`, written when it changes.
#[interface]
pub struct ModuleState {
    /// Ticks made until then.
    pub ticks: u64,
    /// Panics caught until then.
    pub panics: u64,
    /// How it is.
    pub condition: ModuleCondition,
    /// The port that it waits for while it is `WAITING`: a required input without a value, or a service.
    pub waiting_for: PortName,
}

/// The condition of a module, as others see it.
#[interface]
pub enum ModuleCondition {
    /// Not enabled.
    Inactive,
    /// As intended.
    Working,
    /// With less than it wants.
    Degraded,
    /// It could not do its work in its last tick.
    Failed,
    /// Its tick has not returned in time.
    Late,
    /// It panicked too often, or could not be made anew.
    Faulted,
    /// Its plugin is not loaded.
    Unloaded,
    /// A required input has no value yet, or a service that it needs is not provided.
    Waiting,
}

impl ModuleCondition {
    /// Returns whether the outputs are those of the module.
    #[inline]
    pub fn is_working(self) -> bool {
        matches!(self, Self::WORKING | Self::DEGRADED)
    }
}

/// How long a module's ticks take: `/module/timing`, ten times a second of the agent's time. Measured on the wall clock,
/// so no part of what a run can repeat.
#[interface]
pub struct ModuleTiming {
    /// Ticks made.
    pub ticks: u64,
    /// From the last tick but one to the last, of the agent's time.
    #[unit("ns")]
    pub period: u64,
    /// The longest of the last ticks.
    #[unit("ns")]
    pub duration: u64,
    /// The greatest difference of neighbouring periods in the last ticks, of the agent's time.
    #[unit("ns")]
    pub jitter: u64,
    /// Ticks that took longer than the deadline.
    pub misses: u64,
}

/// Durations of something, as a property shows them of a histogram.
#[interface]
#[derive(PartialEq)]
pub struct TimingHistogram {
    /// How often.
    pub count: u64,
    /// On average.
    #[unit("ns")]
    pub mean: u64,
    /// Half of the times at most so long.
    #[unit("ns")]
    pub p50: u64,
    /// 90 of 100 times at most so long.
    #[unit("ns")]
    pub p90: u64,
    /// 99 of 100 times at most so long.
    #[unit("ns")]
    pub p99: u64,
    /// 999 of 1000 times at most so long.
    #[unit("ns")]
    pub p999: u64,
    /// Never longer.
    #[unit("ns")]
    pub max: u64,
}

/// How the main loop does: `/loop/state`. Durations are those of cycles that were timed, on the wall clock.
#[interface]
pub struct LoopState {
    /// Cycles begun.
    pub cycles: u64,
    /// How often cycles were left out, because one before them took too long.
    pub overruns: u64,
    /// Times of the time source that were refused, as they went back.
    pub refused_times: u64,
    /// The last cycle, without the wait for the next.
    #[unit("ns")]
    pub last: u64,
    /// The longest cycle.
    #[unit("ns")]
    pub longest: u64,
}

/// A line of the log: `/log/tail`, which keeps the last 256.
#[interface]
pub struct LogLine {
    /// The agent's time.
    #[unit("ns")]
    pub time: u64,
    /// How many lines of the same module were dropped right before this one.
    pub dropped: u64,
    /// How important.
    pub level: LogLevel,
    /// Which module, or `agent`.
    pub module: Text<64>,
    /// What happened, with its fields.
    pub text: Text<512>,
}

/// How important a line of the log is.
#[interface]
pub enum LogLevel {
    /// Something is broken.
    Error,
    /// Something is wrong but the robot goes on.
    Warn,
    /// What a user wants to know.
    Info,
    /// What a developer wants to know.
    Debug,
    /// Everything.
    Trace,
}

/// What became of the lines of the log: `/log/counts`.
#[interface]
#[derive(PartialEq)]
pub struct LogCounts {
    /// Lines that the targets got.
    pub written: u64,
    /// Lines dropped because the targets were too slow.
    pub dropped: u64,
    /// Lines summed up as repetitions.
    pub suppressed: u64,
}

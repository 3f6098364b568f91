//! Interfaces of an agent's own properties: states of modules, the loop and the log.

use slate_module::{Text, interface};

/// The name of a port, as `/module/state` shows it.
pub type PortName = Text<56>;

/// The condition of a module: `/module/state`, written when it changes.
#[interface]
pub struct ModuleState {
    /// Ticks made until then.
    pub ticks: u64,
    /// Panics caught until then.
    pub panics: u64,
    /// The condition.
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
    /// Its last tick failed.
    Failed,
    /// Its tick has not returned in time.
    Late,
    /// It panicked too often, or could not be created again.
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

/// Durations of a module's ticks: `/module/timing`, ten times a second of the agent's time. Measured on the wall clock,
/// so they differ from run to run.
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

/// Summary of a histogram of durations.
#[interface]
#[derive(PartialEq)]
pub struct TimingHistogram {
    /// Number of durations.
    pub count: u64,
    /// Mean.
    #[unit("ns")]
    pub mean: u64,
    /// Median.
    #[unit("ns")]
    pub p50: u64,
    /// 90th percentile.
    #[unit("ns")]
    pub p90: u64,
    /// 99th percentile.
    #[unit("ns")]
    pub p99: u64,
    /// 99.9th percentile.
    #[unit("ns")]
    pub p999: u64,
    /// Maximum.
    #[unit("ns")]
    pub max: u64,
}

/// The state of the main loop: `/loop/state`. Durations are those of cycles that were timed, on the wall clock.
#[interface]
pub struct LoopState {
    /// Cycles begun.
    pub cycles: u64,
    /// Cycles skipped because an earlier one took too long.
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
    /// Lines of the same module dropped right before this one.
    pub dropped: u64,
    /// Level.
    pub level: LogLevel,
    /// The module, or `agent`.
    pub module: Text<64>,
    /// The message, with its fields.
    pub text: Text<512>,
}

/// The level of a line of the log.
#[interface]
pub enum LogLevel {
    /// A failure.
    Error,
    /// A problem; the robot continues.
    Warn,
    /// Information for users.
    Info,
    /// Information for developers.
    Debug,
    /// All details.
    Trace,
}

/// Counts of log lines: `/log/counts`.
#[interface]
#[derive(PartialEq)]
pub struct LogCounts {
    /// Lines written to the targets.
    pub written: u64,
    /// Lines dropped because the targets were too slow.
    pub dropped: u64,
    /// Lines counted as repetitions.
    pub suppressed: u64,
}

//! Interfaces of an agent's own properties: module state, main loop and log.

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
    /// Port that a module in the state `WAITING` waits for.
    /// It is a required input without a value, or a service.
    pub waiting_for: PortName,
}

/// The condition of a module, as others see it.
#[interface]
pub enum ModuleCondition {
    /// Not enabled.
    Inactive,
    /// Normal operation.
    Working,
    /// Operation with less than the module needs.
    Degraded,
    /// Failure of the last tick.
    Failed,
    /// Tick that has not returned in time.
    Late,
    /// Too many panics, or failed re-creation.
    Faulted,
    /// Plugin not loaded.
    Unloaded,
    /// Required input without a value, or missing service.
    Waiting,
}

impl ModuleCondition {
    /// Returns whether the outputs are those of the module.
    #[inline]
    pub fn is_working(self) -> bool {
        matches!(self, Self::WORKING | Self::DEGRADED)
    }
}

/// Tick durations of a module: `/module/timing`, published at 10 Hz of agent time.
/// Measured on the wall clock, so they differ from run to run.
#[interface]
pub struct ModuleTiming {
    /// Ticks made.
    pub ticks: u64,
    /// Time between the last two ticks, in agent time.
    #[unit("ns")]
    pub period: u64,
    /// The longest of the last ticks.
    #[unit("ns")]
    pub duration: u64,
    /// Largest difference of successive periods in the last ticks, in agent time.
    #[unit("ns")]
    pub jitter: u64,
    /// Ticks that took longer than the deadline.
    pub misses: u64,
}

/// State of an isolated module's process, as the property `/module/process`.
/// Written when the process begins and ends, and once a second of the agent's time. It is not part of the reproducible
/// results of a run.
#[interface]
pub struct ModuleProcess {
    /// Memory that it has in use.
    #[unit("B")]
    pub memory: u64,
    /// Process id; 0 while no process exists.
    pub id: u32,
    /// Number of restarts.
    pub restarts: u32,
    /// End of the last process that failed: by itself, or killed as it did not return.
    /// Empty before the first.
    pub last_end: Text<124>,
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

/// State of the main loop: `/loop/state`.
/// Durations are those of timed cycles, on the wall clock.
#[interface]
pub struct LoopState {
    /// Cycles begun.
    pub cycles: u64,
    /// Cycles skipped because an earlier one took too long.
    pub overruns: u64,
    /// Times of the time source that were rejected because they went backwards.
    pub refused_times: u64,
    /// Duration of the last cycle, without the wait for the next.
    #[unit("ns")]
    pub last: u64,
    /// Longest duration of a cycle.
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

use slate_module::{Text, interface};

/// State of a mission.
#[interface]
pub enum MissionState {
    /// In progress.
    Running,
    /// Succeeded.
    Succeeded,
    /// Failed.
    Failed,
}

/// Outcome of a mission.
#[interface]
pub enum MissionOutcome {
    /// No outcome yet, or another one, given by the reason.
    Other,
    /// The goal was reached, and held where that is the mission.
    GoalReached,
    /// The goal was reached, and left for too long.
    GoalLeft,
    /// The gap to another robot was kept.
    GapKept,
    /// The gap was too small or too large for too long.
    GapLeft,
    /// A collision was caused, whatever else was achieved.
    Collided,
    /// The time was up before.
    TimedOut,
}

/// Verdict on a mission.
#[interface(ros = "diagnostic_msgs/msg/DiagnosticStatus")]
pub struct Verdict {
    /// State of the mission.
    pub state: MissionState,
    /// Outcome of a mission that has ended.
    pub outcome: MissionOutcome,
    /// Reason, such as `goal reached`.
    pub reason: Text<64>,
}

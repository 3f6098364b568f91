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

/// Verdict on a mission.
#[interface(ros = "diagnostic_msgs/msg/DiagnosticStatus")]
pub struct Verdict {
    /// State of the mission.
    pub state: MissionState,
    /// Reason, such as `goal reached`.
    pub reason: Text<64>,
}

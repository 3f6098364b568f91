use slate_module::{Text, interface};

/// How a mission stands.
#[interface]
pub enum MissionState {
    /// Not decided.
    Running,
    /// It did what it should.
    Succeeded,
    /// It can't succeed any more.
    Failed,
}

/// The judgement of a mission.
#[interface(ros = "diagnostic_msgs/msg/DiagnosticStatus")]
pub struct Verdict {
    /// How it stands.
    pub state: MissionState,
    /// Not used.
    pub reserved: [u8; 3],
    /// What happened, such as `goal reached` or `time is up`.
    pub reason: Text<64>,
}

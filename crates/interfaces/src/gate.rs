use slate_module::{Optional, Priority, interface};

/// Mode of a gate.
#[interface]
pub enum GateMode {
    /// No command passes until the gate is armed.
    Disarmed,
    /// Commands pass.
    Armed,
    /// No command passes until the stop is reset and the gate is armed.
    Stopped,
}

/// Priority of a lease's holder.
#[interface]
pub enum LeasePriority {
    /// No lease.
    None,
    /// Planned action.
    Plan,
    /// Teleoperation.
    Teleoperation,
    /// Reflex.
    Reflex,
}

impl From<Priority> for LeasePriority {
    fn from(priority: Priority) -> Self {
        match priority {
            Priority::Plan => Self::PLAN,
            Priority::Teleoperation => Self::TELEOPERATION,
            Priority::Reflex => Self::REFLEX,
        }
    }
}

/// Reason of a refused command, as a value on the blackboard.
#[interface]
pub enum RefusalReason {
    /// No refusal yet.
    None,
    /// A number is infinite or not a number.
    NotFinite,
    /// Another size than that of the actuator's interface.
    WrongSize,
    /// Another commander held the lease.
    Leased,
    /// Stop of the gate or the agent.
    Stopped,
    /// Disarmed gate.
    Disarmed,
}

/// State of a gate.
#[interface]
#[derive(PartialEq)]
pub struct GateState {
    /// Number of commands passed unchanged.
    pub passed: u64,
    /// Number of commands passed with a limited value.
    pub limited: u64,
    /// Number of refused commands.
    pub refused: u64,
    /// Number of commands whose time to live ended.
    pub expired: u64,
    /// Age of the passed command; none for the safe command.
    #[unit("ns")]
    pub age: Optional<u64>,
    /// Holder of the lease, if any.
    pub holder: u32,
    /// Mode of the gate.
    pub mode: GateMode,
    /// Priority of the holder's newest command.
    pub priority: LeasePriority,
    /// Reason of the newest refusal; later success does not clear it.
    pub last_refusal: RefusalReason,
}

use slate_module::{Optional, Priority, interface};

use crate::Reason;

/// Whether a gate passes commands.
#[interface]
pub enum GateMode {
    /// No command passes until the gate is armed.
    Disarmed,
    /// Commands pass.
    Armed,
    /// No command passes until the stop is reset and the gate is armed.
    Stopped,
}

/// How urgent the commands of a lease's holder are.
#[interface]
pub enum LeasePriority {
    /// Nobody holds a lease.
    None,
    /// A planned action.
    Plan,
    /// A person at the controls.
    Teleoperation,
    /// A reflex.
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

/// Why a command was refused, as a value on the blackboard; see [`Reason`].
#[interface]
pub enum RefusalReason {
    /// None was refused yet.
    None,
    /// One of its numbers was infinite or not a number.
    NotFinite,
    /// It had not as many bytes as the actuator's interface.
    WrongSize,
    /// Another commander had the actuator.
    Leased,
    /// The gate, or the whole agent, was stopped.
    Stopped,
    /// The gate was not armed.
    Disarmed,
}

impl From<Reason> for RefusalReason {
    fn from(reason: Reason) -> Self {
        match reason {
            Reason::NotFinite => Self::NOT_FINITE,
            Reason::WrongSize => Self::WRONG_SIZE,
            Reason::Leased { .. } => Self::LEASED,
            Reason::Stopped => Self::STOPPED,
            Reason::Disarmed => Self::DISARMED,
        }
    }
}

/// How a gate stands.
#[interface]
#[derive(PartialEq)]
pub struct GateState {
    /// Commands that took effect unchanged.
    pub passed: u64,
    /// Commands that took effect with a value changed.
    pub limited: u64,
    /// Commands that took no effect.
    pub refused: u64,
    /// Commands whose time to live ended before another one came.
    pub expired: u64,
    /// How old the command is that the actuator gets; nothing when that is the safe command.
    #[unit("ns")]
    pub age: Optional<u64>,
    /// Who holds the lease, if its priority says that somebody does.
    pub holder: u32,
    /// Whether commands pass.
    pub mode: GateMode,
    /// How urgent the holder's last command was.
    pub priority: LeasePriority,
    /// Why the last refused command was refused; later success doesn't clear it.
    pub last_refusal: RefusalReason,
    /// Not used.
    pub reserved: u8,
}

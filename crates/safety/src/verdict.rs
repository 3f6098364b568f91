use slate_module::Priority;

/// Outcome of an offered command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Accepted without a change.
    Passed,
    /// Accepted with at least one value changed.
    /// The value was held at a limit, or slowed down by a rate limit.
    Limited,
    /// Refused; the command takes no effect.
    Refused(Reason),
}

/// Reason for the refusal of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// Number that is infinite or not a number; the safe command takes effect.
    #[error("the command has a number that is not finite")]
    NotFinite,
    /// Wrong number of bytes for the actuator's interface.
    /// The safe command takes effect.
    #[error("the command has the wrong size")]
    WrongSize,
    /// Another commander of the same or a higher priority has the actuator.
    #[error("commander {by} has the actuator with priority {priority:?}")]
    Leased {
        /// Commander that has the actuator.
        by: u32,
        /// Priority of its last command.
        priority: Priority,
    },
    /// Stop of the gate, or of the whole agent.
    #[error("the actuator is stopped")]
    Stopped,
    /// Disarmed gate.
    #[error("the actuator is not armed")]
    Disarmed,
}

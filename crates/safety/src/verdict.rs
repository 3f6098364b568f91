use slate_module::Priority;

/// What became of an offered command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It takes effect as it is.
    Passed,
    /// It takes effect with at least one value changed: held at a limit, or slowed down by a rate limit.
    Limited,
    /// It takes no effect.
    Refused(Reason),
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// One of its numbers is infinite or not a number; the safe command takes effect.
    #[error("the command has a number that is not finite")]
    NotFinite,
    /// It has not as many bytes as the actuator's interface; the safe command takes effect.
    #[error("the command has the wrong size")]
    WrongSize,
    /// Another commander of the same or a higher priority has the actuator.
    #[error("commander {by} has the actuator with priority {priority:?}")]
    Leased {
        /// Who has it.
        by: u32,
        /// How urgent its last command was.
        priority: Priority,
    },
    /// The gate, or the whole agent, is stopped.
    #[error("the actuator is stopped")]
    Stopped,
    /// The gate is not armed.
    #[error("the actuator is not armed")]
    Disarmed,
}

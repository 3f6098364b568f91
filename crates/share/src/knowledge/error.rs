/// Error of an invalid message, none of which was applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("refused at byte {at} of {length}: {expected} should be there")]
pub struct MessageError {
    /// Position of the error, bytes from the beginning.
    pub at: usize,
    /// Length of the message, bytes.
    pub length: usize,
    /// Expected content.
    pub expected: &'static str,
}

/// Reason why a statement was refused; nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Key longer than [`Limits::key`](super::Limits::key).
    #[error("the key has {length} bytes; it may have {limit}")]
    Key {
        /// Length of the key, bytes.
        length: usize,
        /// Largest length of a key, bytes.
        limit: usize,
    },
    /// Value longer than [`Limits::value`](super::Limits::value).
    #[error("the value has {length} bytes; a shared value may have {limit}")]
    Value {
        /// Length of the value, bytes.
        length: usize,
        /// Largest length of a value, bytes.
        limit: usize,
    },
    /// Certainty that is not a number from 0 to 1.
    #[error("the certainty must be from 0 to 1")]
    Certainty,
    /// Limit of this robot's statements reached.
    #[error("this robot states {facts} facts in {bytes} bytes, and may state no more; retract some first")]
    Full {
        /// Facts and retractions of the robot.
        facts: usize,
        /// Memory of the facts and retractions, bytes.
        bytes: usize,
    },
    /// Limit of other robots reached, [`Limits::robots`](super::Limits::robots).
    #[error("facts of {limit} other robots are known, which is the limit; raise `robots` for the whole team")]
    Robots {
        /// Largest number of robots.
        limit: usize,
    },
}

/// Reason why saved bytes can't be restored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Truncated or damaged bytes.
    #[error("the saved knowledge of the team is damaged; delete it, and other robots will send their facts")]
    Damaged,
    /// Bytes of another robot.
    #[error(
        "this was saved by robot {saved}, and this is robot {robot}; start with that robot's file or without one"
    )]
    Robot {
        /// Robot that saved them.
        saved: u32,
        /// Robot that restores them.
        robot: u32,
    },
    /// Bytes saved with other limits, or by another version of Slate.
    #[error("the saved knowledge of the team doesn't fit: {0}")]
    Message(#[from] MessageError),
}

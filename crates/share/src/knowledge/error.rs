/// A message that is none. Nothing of it was taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("refused at byte {at} of {length}: {expected} should be there")]
pub struct MessageError {
    /// Where, bytes from the beginning.
    pub at: usize,
    /// How long the message is, bytes.
    pub length: usize,
    /// What should be there.
    pub expected: &'static str,
}

/// Why a statement can't be made. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The key is longer than [`Limits::key`](super::Limits::key).
    #[error("the key has {length} bytes; it may have {limit}")]
    Key {
        /// What it has, bytes.
        length: usize,
        /// What it may have, bytes.
        limit: usize,
    },
    /// The value is longer than [`Limits::value`](super::Limits::value).
    #[error("the value has {length} bytes; a shared value may have {limit}")]
    Value {
        /// What it has, bytes.
        length: usize,
        /// What it may have, bytes.
        limit: usize,
    },
    /// The certainty is not a number from 0 to 1.
    #[error("the certainty must be from 0 to 1")]
    Certainty,
    /// The robot states as much as it may.
    #[error("this robot states {facts} facts in {bytes} bytes, and may state no more; retract some first")]
    Full {
        /// Its facts and retractions.
        facts: usize,
        /// The memory of them, bytes.
        bytes: usize,
    },
    /// The team has [`Limits::robots`](super::Limits::robots) other robots.
    #[error("facts of {limit} other robots are known, which is the limit; raise `robots` for the whole team")]
    Robots {
        /// How many there may be.
        limit: usize,
    },
}

/// Why saved bytes can't be restored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// They are cut or damaged.
    #[error(
        "what was saved of the team's knowledge is damaged; delete it, and other robots will tell what they know"
    )]
    Damaged,
    /// They are another robot's.
    #[error(
        "this was saved by robot {saved}, and this is robot {robot}; start with that robot's file or without one"
    )]
    Robot {
        /// Who saved them.
        saved: u32,
        /// Who restores them.
        robot: u32,
    },
    /// They were saved with other limits, or by another version of Slate.
    #[error("what was saved of the team's knowledge doesn't fit: {0}")]
    Message(#[from] MessageError),
}

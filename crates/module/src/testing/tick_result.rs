use crate::Outcome;

/// Result of a step of a [`Fixture`](super::Fixture).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TickResult {
    /// Outcome of a step that ran.
    Ran(Outcome),
    /// Name of a required input without a value, for which no step ran.
    Waiting(String),
}

impl TickResult {
    /// Returns the outcome if the module ran.
    pub fn outcome(&self) -> Option<Outcome> {
        match self {
            Self::Ran(outcome) => Some(*outcome),
            Self::Waiting(_) => None,
        }
    }

    /// Returns the required input for which the module waits.
    pub fn waiting_for(&self) -> Option<&str> {
        match self {
            Self::Ran(_) => None,
            Self::Waiting(port) => Some(port),
        }
    }
}

impl PartialEq<Outcome> for TickResult {
    fn eq(&self, other: &Outcome) -> bool {
        self.outcome() == Some(*other)
    }
}

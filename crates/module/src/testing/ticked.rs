use crate::Outcome;

/// What came of a step of a [`Fixture`](super::Fixture).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ticked {
    /// The module ran.
    Ran(Outcome),
    /// The module did not run: the required input of this name has no value yet.
    Waiting(String),
}

impl Ticked {
    /// The outcome if the module ran.
    pub fn outcome(&self) -> Option<Outcome> {
        match self {
            Self::Ran(outcome) => Some(*outcome),
            Self::Waiting(_) => None,
        }
    }

    /// The required input that the module waits for.
    pub fn waiting_for(&self) -> Option<&str> {
        match self {
            Self::Ran(_) => None,
            Self::Waiting(port) => Some(port),
        }
    }
}

impl PartialEq<Outcome> for Ticked {
    fn eq(&self, other: &Outcome) -> bool {
        self.outcome() == Some(*other)
    }
}

//! Figures and goals.

use std::fmt;

use serde::Serialize;

/// Figures of one data set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// Name of the data set.
    pub name: String,
    /// What was measured, in order.
    pub figures: Vec<Figure>,
    /// What else is to be known of them, such as which trials failed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A figure that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// What was measured, with its unit.
    pub name: String,
    /// The value.
    pub value: f64,
    /// What is to be reached, if anything.
    pub goal: Option<FigureGoal>,
}

/// What a figure is to reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FigureGoal {
    /// At most that.
    AtMost(f64),
    /// At least that.
    AtLeast(f64),
}

impl Figure {
    /// A figure without a goal.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value, goal: None }
    }

    /// The figure with what is to be reached.
    #[must_use]
    pub fn with_goal(mut self, goal: FigureGoal) -> Self {
        self.goal = Some(goal);
        self
    }

    /// Whether it has reached its goal; one without is always reached.
    pub fn is_reached(&self) -> bool {
        match self.goal {
            Some(FigureGoal::AtMost(most)) => self.value <= most,
            Some(FigureGoal::AtLeast(least)) => self.value >= least,
            None => true,
        }
    }
}

impl fmt::Display for FigureGoal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(most) => write!(f, "at most {most}"),
            Self::AtLeast(least) => write!(f, "at least {least}"),
        }
    }
}

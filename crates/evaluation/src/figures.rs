//! Figures and goals.

use std::fmt;

use serde::Serialize;

/// Figures of one data set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// Name of the data set.
    pub name: String,
    /// Measured figures, in order.
    pub figures: Vec<Figure>,
    /// Remarks, such as which trials failed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// Figure that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Measured quantity, with its unit.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Goal of the figure, if any.
    pub goal: Option<FigureGoal>,
}

/// Goal of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FigureGoal {
    /// Upper limit.
    AtMost(f64),
    /// Lower limit.
    AtLeast(f64),
}

impl Figure {
    /// Returns a figure without a goal.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value, goal: None }
    }

    /// Returns the figure with a goal.
    #[must_use]
    pub fn with_goal(mut self, goal: FigureGoal) -> Self {
        self.goal = Some(goal);
        self
    }

    /// Returns true if the figure has reached its goal, or has none.
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

/// Returns the value at the nearest rank of a share from 0 to 1.
/// It sorts the values; without any it is NaN. Reports interpolate between two ranks; here a percentile is a value that
/// was measured.
pub(crate) fn percentile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = share * values.len().saturating_sub(1) as f64;
    values.get(at.round() as usize).copied().unwrap_or(f64::NAN)
}

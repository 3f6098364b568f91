//! Parameters of an exploration.

use serde::{Deserialize, Serialize};

/// How the next goal is chosen among the frontiers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalSelection {
    /// The nearest one by path (Yamauchi, 1997, *A frontier-based approach for autonomous exploration*).
    NearestFrontier,
    /// The one with the most information gain per path cost.
    InformationGain,
    /// As [`InformationGain`](Self::InformationGain), seen from the cell around the frontier with the best view
    /// (González-Baños and Latombe, 2002, *Navigation strategies for exploring indoor environments*).
    #[default]
    NextBestView,
}

/// Parameters of an [`Exploration`](crate::Exploration).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExplorationParameters {
    /// How the next goal is chosen.
    pub goal_selection: GoalSelection,
    /// Range of the sensor, m.
    pub sensor_range: f64,
    /// Length below which a frontier is left out, m.
    pub min_frontier_size: f64,
    /// Exponent of the path cost that the gain is divided by; the larger, the more near frontiers are preferred.
    pub path_cost_exponent: f64,
    /// How much better than the current goal another one must be, as a share of its utility.
    pub hysteresis: f64,
    /// Distance of a goal from another on the blacklist below which it counts as the same, m.
    pub blacklist_radius: f64,
}

impl Default for ExplorationParameters {
    fn default() -> Self {
        Self {
            goal_selection: GoalSelection::default(),
            sensor_range: 7.0,
            min_frontier_size: 0.2,
            path_cost_exponent: 2.0,
            hysteresis: 0.2,
            blacklist_radius: 0.3,
        }
    }
}

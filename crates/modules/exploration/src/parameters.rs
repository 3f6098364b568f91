//! Parameters of an exploration.

use serde::{Deserialize, Serialize};

/// Strategy that selects the next goal among the frontiers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalSelection {
    /// Nearest frontier by path length.
    /// Yamauchi, 1997, *A frontier-based approach for autonomous exploration*.
    NearestFrontier,
    /// One with the most information gain per path cost.
    InformationGain,
    /// Best view: [`InformationGain`](Self::InformationGain) from the best cell.
    /// The cell is the one around the frontier with the best view (González-Baños and Latombe, 2002, *Navigation
    /// strategies for exploring indoor environments*).
    #[default]
    NextBestView,
}

/// Parameters of an [`Exploration`](crate::Exploration).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExplorationParameters {
    /// Strategy that selects the next goal.
    pub goal_selection: GoalSelection,
    /// Range of the sensor, m.
    pub sensor_range: f64,
    /// Length below which a frontier is left out, m.
    pub min_frontier_size: f64,
    /// Exponent of the path cost that divides the gain.
    /// The larger, the more near frontiers are preferred.
    pub path_cost_exponent: f64,
    /// Hysteresis: utility advantage required to change the goal, as a share.
    pub hysteresis: f64,
    /// Distance below which a goal counts as one on the blacklist, m.
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

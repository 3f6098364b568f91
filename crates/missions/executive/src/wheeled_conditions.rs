//! Conditions of a robot on wheels with sonars.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Position, SonarScan};
use slate_plugin::prelude::*;

use crate::conditions::ConditionValues;

/// Percepts that the conditions come from.
#[ports]
pub struct ObservedConditions {
    range: Observed<SonarScan>,
    position: Observed<Position>,
    orientation: Observed<Orientation>,
}

/// Parameters of [`WheeledConditions`].
#[params]
pub struct WheeledConditionsParams {
    #[param(default = 0.6, range = 0.0..=10.0, unit = "m", doc = "range below which an obstacle is near")]
    obstacle_distance: f64,
    #[param(default = 0.9, range = 0.0..=10.0, unit = "m", doc = "range above which an obstacle is no longer near (hysteresis)")]
    free_distance: f64,
    #[param(default = 3, range = 1..=100, doc = "scans in a row that must agree")]
    scans: u32,
}

/// State of [`WheeledConditions`].
#[derive(Default, Serialize, Deserialize)]
pub struct WheeledConditionsState {
    /// Newest report.
    reported: Option<(bool, bool)>,
    is_obstacle: bool,
    /// Scans in a row that say otherwise.
    otherwise: u32,
    is_placed: (bool, bool),
}

/// Reports `obstacle`, true near an obstacle, and `localized`.
/// `localized` is true while position and heading are known.
pub struct WheeledConditions;

impl Analyze for WheeledConditions {
    const NAME: &'static str = "wheeled_conditions";
    const DOC: &'static str = "Reports the conditions `obstacle` and `localized` of missions.";
    type Observed = ObservedConditions;
    type Params = WheeledConditionsParams;
    type State = WheeledConditionsState;
    type Value = ConditionValues;

    fn process(
        state: &mut WheeledConditionsState,
        observed: &ObservedConditions,
        params: &WheeledConditionsParams,
        _: &Tick,
    ) -> Option<ConditionValues> {
        state.is_placed.0 |= observed.position.get().is_some();
        state.is_placed.1 |= observed.orientation.get().is_some();
        if let Some(scan) = observed.range.updated() {
            let limit = if state.is_obstacle { params.free_distance } else { params.obstacle_distance };
            let is_near = scan.echoes.iter().any(|echo| echo.heard.get() && echo.range < limit);
            state.otherwise = if is_near == state.is_obstacle { 0 } else { state.otherwise + 1 };
            if state.otherwise >= params.scans {
                (state.is_obstacle, state.otherwise) = (is_near, 0);
            }
        }
        let report = (state.is_obstacle, state.is_placed == (true, true));
        let is_new = state.reported.replace(report) != Some(report);
        is_new.then(|| ConditionValues::new(&[("obstacle", report.0), ("localized", report.1)]))
    }
}

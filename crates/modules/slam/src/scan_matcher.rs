//! Matching of a scan with a map.

use nalgebra::Matrix3;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::correlative::{SearchWindow, search};
use crate::max_grids::MaxGrids;
use crate::parameters::MatchingParameters;
use crate::refine::{PosePrior, Refined, refine};
use crate::surface_map::SurfaceMap;

/// Levels of the search beside a prediction: squares of up to 8 cells.
const LEVELS: usize = 4;
/// Part of its score that a pose at the border of the search loses.
const PENALTY: f64 = 0.3;

/// Matches a scan with a map near a predicted pose in the map's frame.
/// A correlative search is followed by a refinement with the prediction as a prior.
pub(crate) fn match_scan(
    map: &SurfaceMap,
    points: &[[f64; 2]],
    predicted: Pose2,
    prior: Matrix3<f64>,
    parameters: &MatchingParameters,
) -> Refined {
    let window = SearchWindow {
        distance: parameters.search_distance,
        angle: parameters.search_angle,
        penalty: PENALTY,
    };
    let farthest = points.iter().map(|[x, y]| math::hypot(*x, *y)).fold(0.0, math::max);
    let reach = farthest + parameters.search_distance + 1.0;
    let low = map.place([predicted.x - reach, predicted.y - reach]);
    let high = map.place([predicted.x + reach, predicted.y + reach]);
    let grids = MaxGrids::new(map, Some([low, high]), LEVELS);
    let found = search(&grids, map.resolution(), points, predicted, window, 0.0);
    let guess = found.map_or(predicted, |found| found.pose);
    let prior = Some(PosePrior { mean: predicted, information: prior });
    refine(map, points, guess, parameters.correspondence_distance, prior)
}

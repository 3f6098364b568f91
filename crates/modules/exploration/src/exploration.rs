//! Choice of the next goal.

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::Point2;
use slate_module::math;
use slate_planning::{CostField, CostGrid, GridCell};

use crate::frontier::{Frontier, FrontierDetector};
use crate::information_gain::InformationGain;
use crate::parameters::{ExplorationParameters, GoalSelection};
use crate::unknown_counts::UnknownCounts;

/// Cells around a frontier from which a next best view may be, on each side.
const VIEW_CELLS: u32 = 10;
/// Distance of a frontier from the current goal below which it is that goal's, m.
const KEEP_DISTANCE: f64 = 1.0;
/// Search radius for a passable cell of a robot in an impassable one, m.
const ESCAPE_DISTANCE: f64 = 1.0;

/// Goal of an exploring robot.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplorationGoal {
    /// Cell that the robot drives to.
    pub cell: GridCell,
    /// Middle of the cell in the map frame, m.
    pub position: Point2,
    /// Area that it would see there, m².
    pub information_gain: f64,
    /// Cost of the path there, m.
    pub path_cost: f64,
    /// Gain by cost.
    pub utility: f64,
    /// Frontier that the goal looks at.
    pub frontier: Frontier,
}

/// Chooses goals until no frontier is left that can be reached.
///
/// A saved one has its parameters, the blacklist and the current goal; the rest follows from the next map.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "SavedExploration", into = "SavedExploration")]
pub struct Exploration {
    parameters: ExplorationParameters,
    detector: FrontierDetector,
    information_gain: InformationGain,
    costs: CostField,
    unknown: UnknownCounts,
    /// Blacklisted goals in the map frame.
    /// Cells change when a map grows.
    blacklist: Vec<Point2>,
    current: Option<Point2>,
}

/// Cell from which a frontier may be seen.
#[derive(Clone, Copy, Debug)]
struct ViewCandidate {
    /// Number of the frontier.
    frontier: usize,
    cell: GridCell,
    position: Point2,
    path_cost: f64,
    /// Utility that it can't exceed.
    bound: f64,
}

/// Saved state of an [`Exploration`].
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SavedExploration {
    parameters: ExplorationParameters,
    blacklist: Vec<[f64; 2]>,
    current: Option<[f64; 2]>,
}

impl From<Exploration> for SavedExploration {
    fn from(exploration: Exploration) -> Self {
        let saved = |point: &Point2| [point.x, point.y];
        Self {
            parameters: exploration.parameters,
            blacklist: exploration.blacklist.iter().map(saved).collect(),
            current: exploration.current.as_ref().map(saved),
        }
    }
}

impl From<SavedExploration> for Exploration {
    fn from(saved: SavedExploration) -> Self {
        let point = |[x, y]: [f64; 2]| Point2 { x, y };
        Self {
            blacklist: saved.blacklist.into_iter().map(point).collect(),
            current: saved.current.map(point),
            ..Self::new(saved.parameters)
        }
    }
}

impl Exploration {
    /// Returns an exploration.
    pub fn new(parameters: ExplorationParameters) -> Self {
        Self {
            information_gain: InformationGain::new(parameters.sensor_range),
            parameters,
            detector: FrontierDetector::default(),
            costs: CostField::default(),
            unknown: UnknownCounts::default(),
            blacklist: Vec::new(),
            current: None,
        }
    }

    /// Returns the best goal of a robot in a cell.
    /// `None` if no reachable frontier is left.
    ///
    /// `costs` has the cells of the map: where its middle may be, and at what cost. A robot in an impassable cell, such as
    /// one too near a wall, starts at the nearest passable one; without one within a meter it reaches nothing.
    pub fn next_goal(
        &mut self,
        map: &OccupancyMap,
        costs: &CostGrid,
        robot: GridCell,
    ) -> Option<ExplorationGoal> {
        self.detector.update(map);
        // One search has the costs of all goals.
        let resolution = map.geometry.resolution;
        let escape = (ESCAPE_DISTANCE / resolution).ceil() as u32;
        self.costs.compute(costs, costs.nearest_passable(robot, escape).unwrap_or(robot));
        self.unknown.count(map);
        let min_cells = (self.parameters.min_frontier_size / resolution).ceil() as usize;
        let frontiers = self.detector.frontiers(min_cells);
        let candidates = self.candidates(map, costs, &frontiers);
        let best = self.best(map, &frontiers, candidates.iter().copied(), 0.0);
        let chosen = best.map(|best| self.keep_or_change(map, &frontiers, &candidates, best));
        self.current = chosen.as_ref().map(|goal| goal.position);
        chosen
    }

    /// Returns the current frontier's best goal, if nearly as good as the best.
    fn keep_or_change(
        &mut self,
        map: &OccupancyMap,
        frontiers: &[Frontier],
        candidates: &[ViewCandidate],
        best: ExplorationGoal,
    ) -> ExplorationGoal {
        let Some(current) = self.current else { return best };
        let is_current = |frontier: &Frontier| {
            frontier.cells.iter().any(|cell| distance(middle(&map.geometry, *cell), current) < KEEP_DISTANCE)
        };
        let are_current: Vec<bool> = frontiers.iter().map(is_current).collect();
        let own = candidates.iter().copied().filter(|candidate| are_current[candidate.frontier]);
        let least = best.utility / (1.0 + self.parameters.hysteresis);
        self.best(map, frontiers, own, least).unwrap_or(best)
    }

    /// Returns cells that may see a frontier, the most promising first.
    /// Cells on the blacklist are left out.
    fn candidates(&self, map: &OccupancyMap, costs: &CostGrid, frontiers: &[Frontier]) -> Vec<ViewCandidate> {
        let resolution = map.geometry.resolution;
        let side = (self.parameters.sensor_range / resolution).ceil() as usize + 1;
        let mut candidates = Vec::new();
        for (number, frontier) in frontiers.iter().enumerate() {
            let cells = match self.parameters.goal_selection {
                GoalSelection::NextBestView => self.views(costs, frontier),
                _ => self.nearest_reachable(costs, frontier).into_iter().collect(),
            };
            for cell in cells {
                let position = middle(&map.geometry, cell);
                let radius = self.parameters.blacklist_radius;
                if self.blacklist.iter().any(|other| distance(*other, position) < radius) {
                    continue;
                }
                let path_cost = self.costs.cost(costs, cell) * resolution;
                // No more than all that is near, whatever hides it.
                let most = f64::from(self.unknown.around(cell, side)) * resolution * resolution;
                let bound = self.utility(most, path_cost + resolution);
                candidates.push(ViewCandidate { frontier: number, cell, position, path_cost, bound });
            }
        }
        // Stable, so that equal ones stay in their order.
        candidates.sort_by(|a, b| b.bound.total_cmp(&a.bound));
        candidates
    }

    /// Returns the goal of the highest utility among candidates.
    /// The utility is at least `least`; the most promising candidates come first.
    fn best(
        &mut self,
        map: &OccupancyMap,
        frontiers: &[Frontier],
        candidates: impl Iterator<Item = ViewCandidate>,
        least: f64,
    ) -> Option<ExplorationGoal> {
        let mut best: Option<(ViewCandidate, f64, f64)> = None;
        for candidate in candidates {
            let ViewCandidate { cell, path_cost, bound, .. } = candidate;
            if bound < least || best.is_some_and(|(_, _, utility)| bound <= utility) {
                break;
            }
            let information_gain = self.information_gain.area(map, cell);
            let utility = self.utility(information_gain, path_cost + map.geometry.resolution);
            // Without a gain, a wall is between the cell and the frontier.
            let is_better = best.is_none_or(|(_, _, best)| utility > best);
            if information_gain > 0.0 && utility >= least && is_better {
                best = Some((candidate, information_gain, utility));
            }
        }
        best.map(|(ViewCandidate { frontier, cell, position, path_cost, .. }, information_gain, utility)| {
            let frontier = frontiers[frontier].clone();
            ExplorationGoal { cell, position, information_gain, path_cost, utility, frontier }
        })
    }

    /// Leaves out goals near one that the robot could not reach.
    pub fn blacklist(&mut self, goal: &ExplorationGoal) {
        self.blacklist_position(goal.position);
    }

    /// Leaves out goals near a position, m.
    pub fn blacklist_position(&mut self, position: Point2) {
        self.blacklist.push(position);
        self.current = None;
    }

    /// Returns the number of positions on the blacklist.
    pub fn blacklisted(&self) -> usize {
        self.blacklist.len()
    }

    /// Replaces the parameters.
    pub fn set_parameters(&mut self, parameters: ExplorationParameters) {
        if self.parameters != parameters {
            self.information_gain = InformationGain::new(parameters.sensor_range);
            self.parameters = parameters;
        }
    }

    /// Forgets which goals could not be reached.
    pub fn clear_blacklist(&mut self) {
        self.blacklist.clear();
    }

    /// Returns the frontiers of the map of the last choice.
    pub fn frontiers(&self, min_cells: usize) -> Vec<Frontier> {
        self.detector.frontiers(min_cells)
    }

    fn utility(&self, information_gain: f64, path_cost: f64) -> f64 {
        match self.parameters.goal_selection {
            GoalSelection::NearestFrontier => 1.0 / path_cost,
            _ => information_gain / math::pow(path_cost, self.parameters.path_cost_exponent),
        }
    }

    /// Returns the reachable cell nearest to the frontier's middle.
    /// It is one of its own or of those around it.
    fn nearest_reachable(&self, costs: &CostGrid, frontier: &Frontier) -> Option<GridCell> {
        let middle = frontier.middle()?;
        let own = frontier.cells.iter().copied().chain(middle.around(VIEW_CELLS));
        own.filter(|cell| self.costs.cost(costs, *cell) < f64::INFINITY)
            .min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle)))
    }

    /// Cells around the frontier from which it may be seen, thinned.
    fn views(&self, costs: &CostGrid, frontier: &Frontier) -> Vec<GridCell> {
        let Some(middle) = frontier.middle() else { return Vec::new() };
        let thinned = middle
            .around(VIEW_CELLS)
            .filter(|cell| cell.column.is_multiple_of(4) && cell.row.is_multiple_of(4));
        let mut cells: Vec<GridCell> =
            thinned.filter(|cell| self.costs.cost(costs, *cell) < f64::INFINITY).collect();
        cells.extend(self.nearest_reachable(costs, frontier));
        cells
    }
}

fn middle(geometry: &Geometry, cell: GridCell) -> Point2 {
    geometry.center(cell.column as usize, cell.row as usize)
}

fn distance(a: Point2, b: Point2) -> f64 {
    math::hypot(a.x - b.x, a.y - b.y)
}

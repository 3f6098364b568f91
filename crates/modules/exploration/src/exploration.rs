//! Choice of the next goal.

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::Point2;
use slate_module::math;
use slate_planning::{CostField, CostGrid, GridCell};

use crate::frontier::{Frontier, FrontierDetector};
use crate::information_gain::InformationGain;
use crate::parameters::{ExplorationParameters, GoalSelection};

/// Cells around a frontier from which a next best view may be, on each side.
const VIEW_CELLS: i64 = 10;
/// Distance of a frontier from the current goal below which it is that goal's, m.
const KEEP_DISTANCE: f64 = 1.0;
/// Distance within which a robot in an impassable cell looks for a passable one, m.
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
    /// What it goes to see.
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
    /// In the map frame, as cells change when a map grows.
    blacklist: Vec<Point2>,
    current: Option<Point2>,
}

/// What is saved of an [`Exploration`].
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
    /// Begins one.
    pub fn new(parameters: ExplorationParameters) -> Self {
        Self {
            information_gain: InformationGain::new(parameters.sensor_range),
            parameters,
            detector: FrontierDetector::default(),
            costs: CostField::default(),
            blacklist: Vec::new(),
            current: None,
        }
    }

    /// Returns the best goal of a robot in a cell; `None` if no frontier is left that it can reach.
    ///
    /// `costs` has the cells of the map: where its middle may be, and at what cost. A robot in an impassable cell, such as
    /// one too near a wall, starts at the nearest passable one; without one within a metre it reaches nothing.
    pub fn next_goal(
        &mut self,
        map: &OccupancyMap,
        costs: &CostGrid,
        robot: GridCell,
    ) -> Option<ExplorationGoal> {
        self.detector.update(map);
        // One search has the costs of all goals.
        self.costs.compute(costs, nearest_passable(costs, robot, map.geometry.resolution));
        let resolution = map.geometry.resolution;
        let min_cells = (self.parameters.min_frontier_size / resolution).ceil() as usize;
        let mut goals: Vec<ExplorationGoal> = Vec::new();
        for frontier in self.detector.frontiers(min_cells) {
            goals.extend(self.goal(map, costs, frontier));
        }
        let chosen = self.keep_or_change(&map.geometry, goals);
        self.current = chosen.as_ref().map(|goal| goal.position);
        chosen
    }

    /// Returns the best goal, or the one of the current frontier if that is nearly as good.
    fn keep_or_change(&self, geometry: &Geometry, goals: Vec<ExplorationGoal>) -> Option<ExplorationGoal> {
        let better = |a: &&ExplorationGoal, b: &&ExplorationGoal| a.utility.total_cmp(&b.utility);
        let best = goals.iter().max_by(better)?;
        let kept = goals.iter().filter(|goal| self.is_current(goal, geometry)).max_by(better);
        let is_kept =
            |kept: &&ExplorationGoal| best.utility <= kept.utility * (1.0 + self.parameters.hysteresis);
        Some(kept.filter(is_kept).unwrap_or(best).clone())
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

    /// Goes on with other parameters.
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

    fn is_current(&self, goal: &ExplorationGoal, geometry: &Geometry) -> bool {
        self.current.is_some_and(|current| {
            goal.frontier.cells.iter().any(|cell| distance(middle(geometry, *cell), current) < KEEP_DISTANCE)
        })
    }

    /// Returns the goal that shows what is behind a frontier; `None` if it can't be reached or seen, or is on the
    /// blacklist.
    fn goal(&mut self, map: &OccupancyMap, costs: &CostGrid, frontier: Frontier) -> Option<ExplorationGoal> {
        let resolution = map.geometry.resolution;
        let cells = match self.parameters.goal_selection {
            GoalSelection::NextBestView => self.views(costs, &frontier),
            _ => self.nearest_reachable(costs, &frontier).into_iter().collect(),
        };
        let radius = self.parameters.blacklist_radius;
        let mut best: Option<ExplorationGoal> = None;
        for cell in cells {
            let position = middle(&map.geometry, cell);
            if self.blacklist.iter().any(|other| distance(*other, position) < radius) {
                continue;
            }
            let path_cost = self.costs.cost(costs, cell) * resolution;
            let information_gain = self.information_gain.area(map, cell);
            // A wall is between the cell and the frontier.
            if information_gain == 0.0 {
                continue;
            }
            let utility = self.utility(information_gain, path_cost + resolution);
            if best.as_ref().is_none_or(|best| utility > best.utility) {
                best = Some(ExplorationGoal {
                    cell,
                    position,
                    information_gain,
                    path_cost,
                    utility,
                    frontier: Frontier::default(),
                });
            }
        }
        best.map(|goal| ExplorationGoal { frontier, ..goal })
    }

    fn utility(&self, information_gain: f64, path_cost: f64) -> f64 {
        match self.parameters.goal_selection {
            GoalSelection::NearestFrontier => 1.0 / path_cost,
            _ => information_gain / math::pow(path_cost, self.parameters.path_cost_exponent),
        }
    }

    /// The cell that can be reached and is nearest to the frontier's middle, of its own or of those around it.
    fn nearest_reachable(&self, costs: &CostGrid, frontier: &Frontier) -> Option<GridCell> {
        let middle = frontier.middle()?;
        let own = frontier.cells.iter().copied().chain(around(middle, VIEW_CELLS));
        own.filter(|cell| self.costs.cost(costs, *cell) < f64::INFINITY)
            .min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle)))
    }

    /// Cells around the frontier from which it may be seen, thinned.
    fn views(&self, costs: &CostGrid, frontier: &Frontier) -> Vec<GridCell> {
        let Some(middle) = frontier.middle() else { return Vec::new() };
        let thinned = around(middle, VIEW_CELLS)
            .filter(|cell| cell.column.is_multiple_of(4) && cell.row.is_multiple_of(4));
        let mut cells: Vec<GridCell> =
            thinned.filter(|cell| self.costs.cost(costs, *cell) < f64::INFINITY).collect();
        cells.extend(self.nearest_reachable(costs, frontier));
        cells
    }
}

/// The cell itself, or the nearest passable one around it.
fn nearest_passable(costs: &CostGrid, cell: GridCell, resolution: f64) -> GridCell {
    if costs.is_passable(cell) {
        return cell;
    }
    let side = (ESCAPE_DISTANCE / resolution).ceil() as i64;
    let passable = around(cell, side).filter(|near| costs.is_passable(*near));
    passable.min_by(|a, b| a.distance(cell).total_cmp(&b.distance(cell))).unwrap_or(cell)
}

fn middle(geometry: &Geometry, cell: GridCell) -> Point2 {
    geometry.center(cell.column as usize, cell.row as usize)
}

fn distance(a: Point2, b: Point2) -> f64 {
    math::hypot(a.x - b.x, a.y - b.y)
}

/// Cells of a square around one.
fn around(middle: GridCell, side: i64) -> impl Iterator<Item = GridCell> {
    let at = |from: u32, by: i64| u32::try_from(i64::from(from) + by).ok();
    (-side..=side).flat_map(move |rows| {
        (-side..=side).filter_map(move |columns| {
            Some(GridCell::new(at(middle.column, columns)?, at(middle.row, rows)?))
        })
    })
}

//! Hybrid A*.

mod nodes;
mod parameters;

use std::fmt;

use slate_avoidance::Footprint;
use slate_interfaces::Pose2;
use slate_module::{InvalidParameter, math};

use crate::cost_field::CostField;
use crate::cost_grid::{CostGrid, GridCell, GridSizeError, INSCRIBED};
use crate::footprint_grid::{FootprintCover, FootprintGrid};
use crate::steering_path::{PathPenalties, SteeringPath, SteeringPosition, drive};
use crate::{dubins, reeds_shepp};
use nodes::{HybridNode, HybridNodes, NodeArrival, key};
pub use parameters::{DriveModel, HybridAStarParameters};

/// Largest ratio of an 8-connected path to a straight line: 1 / cos(pi / 8).
const LONGEST_DETOUR: f64 = 1.082_392_200_292_394;

/// Pose of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenPose {
    /// Pose of the robot's origin.
    pub pose: Pose2,
    /// True if the robot arrives in reverse.
    pub is_reverse: bool,
}

/// Reason why no path was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HybridSearchError {
    /// Obstacle under the footprint at the start.
    StartOccupied,
    /// Obstacle under the footprint at the goal.
    GoalOccupied,
    /// Unreachable goal.
    NoPath,
    /// Number of states after which the search gave up; raise `max_iterations`.
    GaveUp(u32),
    /// Grid too large to search.
    Size(GridSizeError),
}

impl fmt::Display for HybridSearchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StartOccupied => f.write_str("an obstacle is under the footprint at the start"),
            Self::GoalOccupied => f.write_str("an obstacle is under the footprint at the goal"),
            Self::NoPath => f.write_str("the robot can't get to the goal"),
            Self::GaveUp(states) => write!(f, "no path after {states} states: raise `max_iterations`"),
            Self::Size(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for HybridSearchError {}

/// Hybrid A*: finds paths of a car-like robot with its footprint.
/// Dolgov, Thrun, Montemerlo and Diebel, 2008, *Practical search techniques in path planning for autonomous driving*,
/// sections 2 and 3.
///
/// States are poses in cells of the grid and bins of the heading. The heuristic is the larger of the shortest path without
/// obstacles, by Reeds and Shepp or Dubins, and the shortest one among obstacles of a robot that turns on the spot. From
/// some states the shortest path to the goal is tried as a whole; it competes with the other states, so that a cheaper
/// path with more steps is not missed. Steps are not smoothed.
#[derive(Clone, Debug)]
pub struct HybridAStar {
    parameters: HybridAStarParameters,
    footprint: Footprint,
    /// Cover of the footprint, and the resolution that it is for.
    cover: Option<(f64, FootprintCover)>,
    nodes: HybridNodes,
    field: CostField,
    path: Vec<DrivenPose>,
    cost: f64,
    iterations: u32,
}

/// Context of a search.
struct HybridSearch<'a> {
    grid: &'a FootprintGrid,
    cover: &'a FootprintCover,
    costs: CostGrid,
    field: &'a CostField,
    goal: Pose2,
    parameters: &'a HybridAStarParameters,
    penalties: PathPenalties,
    /// m.
    step: f64,
}

impl HybridAStar {
    /// Returns a planner for a robot.
    ///
    /// # Errors
    /// A parameter that is out of its range.
    pub fn new(parameters: HybridAStarParameters, footprint: Footprint) -> Result<Self, InvalidParameter> {
        parameters.check()?;
        Ok(Self {
            parameters,
            footprint,
            cover: None,
            nodes: HybridNodes::default(),
            field: CostField::default(),
            path: Vec::new(),
            cost: 0.0,
            iterations: 0,
        })
    }

    /// Searches a path from a start to a goal; its poses are half a cell apart at most.
    ///
    /// # Errors
    /// No path exists, or none was found.
    pub fn search(
        &mut self,
        grid: &FootprintGrid,
        start: Pose2,
        goal: Pose2,
    ) -> Result<&[DrivenPose], HybridSearchError> {
        let resolution = grid.geometry().resolution;
        if self.cover.as_ref().is_none_or(|(fitted, _)| *fitted != resolution) {
            self.cover = Some((resolution, FootprintCover::new(&self.footprint, resolution)));
        }
        let Some((_, cover)) = &self.cover else { return Err(HybridSearchError::NoPath) };
        if !start.is_known() || !cover.is_free(grid, &start) {
            return Err(HybridSearchError::StartOccupied);
        }
        if !goal.is_known() || !cover.is_free(grid, &goal) {
            return Err(HybridSearchError::GoalOccupied);
        }
        let costs = inscribed(grid, cover.inscribed_radius).map_err(HybridSearchError::Size)?;
        if let Some((column, row)) = grid.geometry().cell(goal.x, goal.y) {
            self.field.compute(&costs, GridCell::new(column as u32, row as u32));
        }
        let search = HybridSearch {
            grid,
            cover,
            costs,
            field: &self.field,
            goal,
            parameters: &self.parameters,
            penalties: self.parameters.penalties(),
            step: self.parameters.step_length(resolution),
        };
        let found = search.run(&mut self.nodes, start, &mut self.iterations)?;
        self.cost = self.nodes.node(found).cost;
        search.trace(&self.nodes, found, &mut self.path);
        Ok(&self.path)
    }

    /// Returns the cost of the newest path: its length with its penalties, m.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Returns the number of states that the newest search has expanded.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }
}

/// Cells in which the robot's origin can be, whatever its heading.
fn inscribed(grid: &FootprintGrid, inscribed_radius: f64) -> Result<CostGrid, GridSizeError> {
    let geometry = grid.geometry();
    // Reduced, as points of a cell and of an obstacle's cell may be nearer than the cells' middles.
    let least = math::max(inscribed_radius / geometry.resolution - std::f64::consts::SQRT_2, 0.0);
    let size = |cells: usize| u32::try_from(cells).unwrap_or(u32::MAX);
    CostGrid::new(size(geometry.width), size(geometry.height), |cell| {
        let distance = grid.cell_distance(geometry.index(cell.column as usize, cell.row as usize));
        if distance <= least { INSCRIBED } else { 0 }
    })
}

impl HybridSearch<'_> {
    /// Returns the state at the goal.
    fn run(
        &self,
        nodes: &mut HybridNodes,
        start: Pose2,
        iterations: &mut u32,
    ) -> Result<u32, HybridSearchError> {
        nodes.clear();
        *iterations = 0;
        let begin = HybridNode {
            pose: start,
            cost: 0.0,
            predecessor: 0,
            arrival: NodeArrival::Start,
            is_closed: false,
        };
        if let Some(key) = self.key(&start) {
            nodes.offer(key, begin, self.heuristic(&start));
        }
        let mut until_expansion = 0.0;
        while let Some(index) = nodes.pop() {
            let node = *nodes.node(index);
            if matches!(node.arrival, NodeArrival::Goal { .. }) {
                return Ok(index);
            }
            *iterations += 1;
            if *iterations > self.parameters.max_iterations {
                return Err(HybridSearchError::GaveUp(self.parameters.max_iterations));
            }
            if until_expansion <= 0.0 {
                self.expand_analytically(nodes, index, &node);
                let cells = self.heuristic(&node.pose) / self.grid.geometry().resolution;
                until_expansion = cells / self.parameters.analytic_expansion_ratio;
            }
            until_expansion -= 1.0;
            self.expand(nodes, index, &node);
        }
        Err(HybridSearchError::NoPath)
    }

    /// Adds the states that one step leads to.
    fn expand(&self, nodes: &mut HybridNodes, index: u32, node: &HybridNode) {
        for is_reverse in [false, true] {
            if is_reverse && self.parameters.drive_model == DriveModel::Dubins {
                continue;
            }
            for steering in [SteeringPosition::Straight, SteeringPosition::Left, SteeringPosition::Right] {
                let length = if is_reverse { -self.step } else { self.step };
                let radius = self.parameters.minimum_turning_radius;
                let pose = drive(&node.pose, steering, length, radius);
                let Some(key) = self.key(&pose).filter(|key| !nodes.is_closed(*key)) else { continue };
                let halfway = drive(&node.pose, steering, 0.5 * length, radius);
                if !self.cover.is_free(self.grid, &pose) || !self.cover.is_free(self.grid, &halfway) {
                    continue;
                }
                let path = SteeringPath::new(&[(steering, length / radius)], radius);
                let cost = node.cost + path.cost(&self.penalties) + self.change(node, is_reverse);
                let arrival = NodeArrival::Step { steering, is_reverse };
                let heuristic = self.heuristic(&pose);
                if heuristic < f64::INFINITY {
                    let next = HybridNode { pose, cost, predecessor: index, arrival, is_closed: false };
                    nodes.offer(key, next, cost + heuristic);
                }
            }
        }
    }

    /// Adds the goal, if the shortest path to it is free.
    fn expand_analytically(&self, nodes: &mut HybridNodes, index: u32, node: &HybridNode) {
        let path = self.direct(&node.pose);
        let spacing = 0.5 * self.grid.geometry().resolution;
        if !path.poses(node.pose, spacing).all(|(pose, _)| self.cover.is_free(self.grid, &pose)) {
            return;
        }
        let first = path.segments().next().map(|segment| segment.length < 0.0);
        let change = first.map_or(0.0, |is_reverse| self.change(node, is_reverse));
        let cost = node.cost + path.cost(&self.penalties) + change;
        let is_reverse = path.segments().last().is_some_and(|segment| segment.length < 0.0);
        let arrival = NodeArrival::Goal { is_reverse };
        let goal = HybridNode { pose: self.goal, cost, predecessor: index, arrival, is_closed: false };
        nodes.offer_goal(goal, &path);
    }

    /// Returns the cost of a change of direction.
    fn change(&self, node: &HybridNode, is_reverse: bool) -> f64 {
        let is_change = node.arrival.is_reverse().is_some_and(|was| was != is_reverse);
        if is_change { self.penalties.change } else { 0.0 }
    }

    /// Returns the cheapest path to the goal without obstacles.
    fn direct(&self, pose: &Pose2) -> SteeringPath {
        let radius = self.parameters.minimum_turning_radius;
        match self.parameters.drive_model {
            DriveModel::Dubins => dubins::best(pose, &self.goal, radius, &self.penalties),
            DriveModel::ReedsShepp => reeds_shepp::best(pose, &self.goal, radius, &self.penalties),
        }
    }

    /// Returns a lower bound of the cost from a pose to the goal, m.
    /// Infinite if walls are between.
    fn heuristic(&self, pose: &Pose2) -> f64 {
        let geometry = self.grid.geometry();
        let Some((column, row)) = geometry.cell(pose.x, pose.y) else { return f64::INFINITY };
        let steps = self.field.cost(&self.costs, GridCell::new(column as u32, row as u32));
        // A path may begin and end anywhere in its cells.
        let around = (steps / LONGEST_DETOUR - std::f64::consts::SQRT_2) * geometry.resolution;
        math::max(around, self.direct(pose).cost(&self.penalties))
    }

    fn key(&self, pose: &Pose2) -> Option<u64> {
        key(self.grid.geometry(), self.parameters.angle_quantization_bins, pose)
    }

    /// Writes the poses from the start to a state.
    fn trace(&self, nodes: &HybridNodes, found: u32, path: &mut Vec<DrivenPose>) {
        path.clear();
        let spacing = 0.5 * self.grid.geometry().resolution;
        let radius = self.parameters.minimum_turning_radius;
        let mut index = found;
        // From the goal, each part backwards.
        loop {
            let node = nodes.node(index);
            let part = match node.arrival {
                NodeArrival::Start => break,
                NodeArrival::Goal { .. } => nodes.goal_path(),
                NodeArrival::Step { steering, is_reverse } => {
                    let length = if is_reverse { -self.step } else { self.step };
                    SteeringPath::new(&[(steering, length / radius)], radius)
                }
            };
            let begin = path.len();
            let poses = part.poses(nodes.node(node.predecessor).pose, spacing);
            path.extend(poses.map(|(pose, is_reverse)| DrivenPose { pose, is_reverse }));
            path[begin..].reverse();
            index = node.predecessor;
        }
        let is_reverse = path.last().is_some_and(|next| next.is_reverse);
        path.push(DrivenPose { pose: nodes.node(index).pose, is_reverse });
        path.reverse();
    }
}

//! Buildings in which a robot finds its pose.

use slate_grid::{DistanceTransform, Geometry, RayCaster};
use slate_interfaces::Pose2;
use slate_localization::{LikelihoodField, SensorModel};
use slate_module::Random;
use slate_module::math;
use slate_planning::{CostGrid, GridCell, LETHAL, ThetaStar};

use crate::DataError;

/// Least distance of the robot's middle to the middle of a wall's cell, m.
/// A Pioneer's radius of 0.27 m and a margin.
const CLEARANCE: f64 = 0.4;

/// Map, with the data for a robot to drive in it.
pub struct Building {
    pub name: String,
    pub geometry: Geometry,
    pub caster: RayCaster,
    /// Free cells of the building's map.
    /// Cells that a robot can't see are not free.
    pub is_free: Vec<bool>,
    /// Cells where the robot's middle can be.
    is_drivable: Vec<bool>,
    drivable: Vec<u32>,
    costs: CostGrid,
}

impl Building {
    /// Creates a building from its walls.
    /// The robot drives in the largest room, or rooms with doors.
    pub fn new(name: String, geometry: Geometry, walls: &[bool]) -> Result<Self, DataError> {
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(geometry.width, geometry.height, |cell| walls[cell]);
        let least = CLEARANCE / geometry.resolution;
        let is_clear: Vec<bool> = squares.iter().map(|square| *square as f64 > least * least).collect();
        let is_drivable = largest_region(&geometry, &is_clear);
        let is_free = connected(&geometry, walls, &is_drivable);
        let at = |cell: GridCell| geometry.index(cell.column as usize, cell.row as usize);
        let cost = |cell| if is_drivable[at(cell)] { 0 } else { LETHAL };
        let costs = CostGrid::new(geometry.width as u32, geometry.height as u32, cost)
            .map_err(|error| DataError::new(name.as_ref(), error.to_string()))?;
        let drivable = (0..geometry.cells()).filter(|cell| is_drivable[*cell]).map(|cell| cell as u32);
        Ok(Self {
            caster: RayCaster::new(geometry, |cell| walls[cell]),
            drivable: drivable.collect(),
            name,
            geometry,
            is_free,
            is_drivable,
            costs,
        })
    }

    /// Computes the likelihood field of the map.
    pub fn field(&self, model: SensorModel) -> Option<LikelihoodField> {
        let is_occupied = |cell: usize| {
            let (column, row) = (cell % self.geometry.width, cell / self.geometry.width);
            let middle = self.geometry.center(column, row);
            self.caster.is_occupied(middle.x, middle.y)
        };
        LikelihoodField::new(self.geometry, is_occupied, |cell| self.is_free[cell], model).ok()
    }

    /// Returns the area where the robot's middle can be, m².
    pub fn drivable_area(&self) -> f64 {
        self.drivable.len() as f64 * self.geometry.resolution * self.geometry.resolution
    }

    /// Returns whether the robot's middle can be at a point.
    pub fn is_drivable(&self, x: f64, y: f64) -> bool {
        let cell = self.geometry.cell(x, y);
        cell.is_some_and(|(column, row)| self.is_drivable[self.geometry.index(column, row)])
    }

    /// Returns a random pose of the robot.
    pub fn random_pose(&self, random: &mut Random) -> Pose2 {
        let at = (random.unit() * self.drivable.len() as f64) as usize;
        let cell = self.drivable.get(at).copied().unwrap_or(0) as usize;
        let middle = self.geometry.center(cell % self.geometry.width, cell / self.geometry.width);
        let theta = random.uniform(-std::f64::consts::PI, std::f64::consts::PI);
        Pose2 { x: middle.x, y: middle.y, theta }
    }

    /// Returns a route to random places, whose length is at least that, m.
    pub fn route(&self, from: [f64; 2], length: f64, random: &mut Random) -> Vec<[f64; 2]> {
        let mut planner = ThetaStar::default();
        let mut route = vec![from];
        let mut left = length;
        while left > 0.0 {
            let last = route.last().copied().unwrap_or_default();
            let to = self.random_pose(random);
            let cell = |x, y| {
                let (column, row) = self.geometry.cell(x, y).unwrap_or_default();
                GridCell::new(column as u32, row as u32)
            };
            let Some(path) = planner.search(&self.costs, cell(last[0], last[1]), cell(to.x, to.y)) else {
                break;
            };
            for cell in path.cells().iter().skip(1) {
                let middle = self.geometry.center(cell.column as usize, cell.row as usize);
                let last = route.last().copied().unwrap_or_default();
                left -= math::hypot(middle.x - last[0], middle.y - last[1]);
                route.push([middle.x, middle.y]);
            }
        }
        route
    }
}

/// Returns the largest connected region of cells.
fn largest_region(geometry: &Geometry, is_member: &[bool]) -> Vec<bool> {
    let mut seen = vec![false; is_member.len()];
    let mut best: Vec<usize> = Vec::new();
    for first in 0..is_member.len() {
        if is_member[first] && !seen[first] {
            let mut found = vec![first];
            seen[first] = true;
            spread(geometry, &mut found, |cell| is_member[cell] && !std::mem::replace(&mut seen[cell], true));
            if found.len() > best.len() {
                best = found;
            }
        }
    }
    let mut region = vec![false; is_member.len()];
    best.into_iter().for_each(|cell| region[cell] = true);
    region
}

/// Cells without a wall that are connected to some.
fn connected(geometry: &Geometry, walls: &[bool], from: &[bool]) -> Vec<bool> {
    let mut seen = from.to_vec();
    let mut found: Vec<usize> = (0..from.len()).filter(|cell| from[*cell]).collect();
    spread(geometry, &mut found, |cell| !walls[cell] && !std::mem::replace(&mut seen[cell], true));
    seen
}

/// Adds cells that are neighbors of those found, and taken.
fn spread(geometry: &Geometry, found: &mut Vec<usize>, mut take: impl FnMut(usize) -> bool) {
    let mut next = 0;
    while let Some(&cell) = found.get(next) {
        next += 1;
        let (column, row) = (cell % geometry.width, cell / geometry.width);
        let sides = [
            (column > 0).then(|| cell - 1),
            (column + 1 < geometry.width).then(|| cell + 1),
            (row > 0).then(|| cell - geometry.width),
            (row + 1 < geometry.height).then(|| cell + geometry.width),
        ];
        for side in sides.into_iter().flatten() {
            if take(side) {
                found.push(side);
            }
        }
    }
}

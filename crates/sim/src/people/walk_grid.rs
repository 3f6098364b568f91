use slate_grid::{Geometry, LineCells};
use slate_module::math::max;

use crate::error::DescriptionError;
use crate::geometry::{Point, Polygon};
use crate::world::{Body, Bounds, World};

/// Smallest size of a cell, m.
const LEAST_CELL: f64 = 0.1;
/// Largest number of cells; larger worlds have larger cells.
const MOST_CELLS: f64 = 1_000_000.0;
/// Clearance beyond a person's radius, m.
const CLEARANCE: f64 = 0.05;

/// State of a cell for a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum WalkCell {
    /// Free for the middle of a person.
    Free,
    /// Nearer to a body than a person's radius.
    Near,
    /// Occupied by a body.
    Body,
}

/// Grid of free space for walking people.
#[derive(Debug)]
pub(super) struct WalkGrid {
    geometry: Geometry,
    cells: Vec<WalkCell>,
}

impl WalkGrid {
    /// Creates the grid of a world for people of a radius, m.
    pub fn new(world: &World, radius: f64) -> Result<Self, DescriptionError> {
        let Bounds { minimum: [west, south], maximum: [east, north] } = world.bounds;
        let size = [east - west, north - south];
        // Rounding up must not lead beyond the most.
        let least = (size[0] * size[1] / (0.9 * MOST_CELLS)).sqrt();
        let geometry = Geometry::new([west, south], size, max(LEAST_CELL, least), MOST_CELLS as usize)
            .ok_or_else(|| {
                let message = format!("a world of {} m x {} m can't be walked in", size[0], size[1]);
                DescriptionError::new("world.people", message)
            })?;
        let mut grid = Self { geometry, cells: vec![WalkCell::Free; geometry.cells()] };
        for body in world.bodies.iter().filter_map(Body::polygon) {
            grid.block(&body, radius + CLEARANCE);
        }
        Ok(grid)
    }

    /// Marks the cells near a body as occupied or near.
    fn block(&mut self, body: &Polygon, reach: f64) {
        let extent = body.extent();
        let (left, low) = self.geometry.place(extent.minimum.x - reach, extent.minimum.y - reach);
        let (right, high) = self.geometry.place(extent.maximum.x + reach, extent.maximum.y + reach);
        // A float that is too low for a number becomes 0.
        let (left, low) = (left as usize, low as usize);
        let right = (right as usize).min(self.geometry.width - 1);
        let high = (high as usize).min(self.geometry.height - 1);
        // Half a diagonal: no line slips through a wall between the middles of cells.
        let touch = 0.75 * self.geometry.resolution;
        for row in low..=high {
            for column in left..=right {
                let cell = self.geometry.index(column, row);
                let middle = self.center(cell);
                let distance = match body.contains(middle) {
                    true => 0.0,
                    false => body.nearest(middle).minus(middle).norm(),
                };
                let found = match distance {
                    distance if distance < touch => WalkCell::Body,
                    distance if distance < reach => WalkCell::Near,
                    _ => WalkCell::Free,
                };
                self.cells[cell] = self.cells[cell].max(found);
            }
        }
    }

    /// Returns the number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.geometry.width
    }

    /// Returns the middle of a cell.
    pub fn center(&self, cell: usize) -> Point {
        let middle = self.geometry.center(cell % self.geometry.width, cell / self.geometry.width);
        Point::new(middle.x, middle.y)
    }

    /// Returns the cell at a point of the grid.
    pub fn cell(&self, point: Point) -> Option<usize> {
        self.geometry.cell(point.x, point.y).map(|(column, row)| self.geometry.index(column, row))
    }

    /// Returns the cell at a point if a person can be there.
    pub fn free_cell(&self, point: Point) -> Option<usize> {
        self.cell(point).filter(|cell| self.is_free(*cell))
    }

    /// Returns whether the middle of a person can be in a cell.
    pub fn is_free(&self, cell: usize) -> bool {
        self.cells[cell] == WalkCell::Free
    }

    /// Returns whether a person can walk straight from one point to another.
    pub fn is_straight(&self, from: Point, to: Point) -> bool {
        self.all_along(from, to, WalkCell::Free)
    }

    /// Returns whether no body is between two points.
    pub fn is_in_sight(&self, from: Point, to: Point) -> bool {
        self.all_along(from, to, WalkCell::Near)
    }

    /// Returns whether no cell on a line is worse than `worst`.
    fn all_along(&self, from: Point, to: Point, worst: WalkCell) -> bool {
        let place = |point: Point| self.geometry.place(point.x, point.y);
        LineCells::new(place(from), place(to)).all(|(column, row)| {
            let cell = usize::try_from(column).ok().zip(usize::try_from(row).ok());
            cell.is_some_and(|(column, row)| {
                let is_inside = column < self.geometry.width && row < self.geometry.height;
                is_inside && self.cells[self.geometry.index(column, row)] <= worst
            })
        })
    }

    /// Returns the neighbor of a cell on one of nine sides.
    /// The fifth side is the cell itself.
    pub fn beside(&self, cell: usize, side: u8) -> Option<usize> {
        let Geometry { width, height, .. } = self.geometry;
        let (right, up) = (usize::from(side % 3), usize::from(side / 3));
        let column = (cell % width + right).checked_sub(1).filter(|column| *column < width)?;
        let row = (cell / width + up).checked_sub(1).filter(|row| *row < height)?;
        Some(row * width + column)
    }

    /// Returns the free cells that are connected with one, as a mask.
    pub fn reachable(&self, from: usize) -> Vec<bool> {
        let mut reached = vec![false; self.cells.len()];
        self.flood(from, &mut reached);
        reached
    }

    /// Returns the largest connected area of free cells, as a mask.
    pub fn largest_area(&self) -> Vec<bool> {
        let mut reached = vec![false; self.cells.len()];
        let mut largest = (0, 0);
        for cell in 0..self.cells.len() {
            if self.is_free(cell) && !reached[cell] {
                let size = self.flood(cell, &mut reached);
                if size > largest.0 {
                    largest = (size, cell);
                }
            }
        }
        match largest {
            (0, _) => reached,
            (_, cell) => self.reachable(cell),
        }
    }

    /// Marks the free cells connected with one; returns their number.
    fn flood(&self, from: usize, reached: &mut [bool]) -> usize {
        let mut open = vec![from];
        let mut size = 0;
        reached[from] = true;
        while let Some(cell) = open.pop() {
            size += 1;
            for side in [1, 3, 5, 7] {
                if let Some(next) =
                    self.beside(cell, side).filter(|next| self.is_free(*next) && !reached[*next])
                {
                    reached[next] = true;
                    open.push(next);
                }
            }
        }
        size
    }
}

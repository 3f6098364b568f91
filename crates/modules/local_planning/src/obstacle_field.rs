//! Distances to obstacles around a robot.

use slate_grid::{DistanceTransform, Geometry};

use crate::error::LocalPlanningError;

/// Distance where no obstacle is near, m.
pub(crate) const MAX_DISTANCE: f32 = 1e3;
/// Largest number of cells.
const MOST_CELLS: usize = 1 << 20;

/// Distance field of a square window around a robot, from points on obstacles.
///
/// Distances are those between middles of cells, exact up to the resolution. The frame is that of the points: the
/// robot's own, that of the odometry, or a map's.
#[derive(Clone, Debug)]
pub struct ObstacleField {
    resolution: f64,
    /// Cells along each side.
    side: usize,
    /// Middle of the window, at a corner of cells.
    center: [f64; 2],
    is_occupied: Vec<bool>,
    /// Distance of each cell to the nearest obstacle, m.
    distances: Vec<f32>,
    transform: DistanceTransform,
}

impl ObstacleField {
    /// Returns a window of side `size`, m, without obstacles.
    ///
    /// # Errors
    /// The window has no cell, or more than a million.
    pub fn new(size: f64, resolution: f64) -> Result<Self, LocalPlanningError> {
        LocalPlanningError::unless_positive(&[("size", size), ("resolution", resolution)])?;
        let geometry = Geometry::new([0.0, 0.0], [size, size], resolution, MOST_CELLS);
        let side = geometry.map_or(0, |geometry| geometry.width);
        LocalPlanningError::unless(side > 0, "size", "1 to 1000 cells of `resolution`")?;
        Ok(Self {
            resolution,
            side,
            center: [0.0, 0.0],
            is_occupied: vec![false; side * side],
            distances: vec![MAX_DISTANCE; side * side],
            transform: DistanceTransform::default(),
        })
    }

    /// Centers the window on a point, and fills it from points on obstacles.
    /// Points outside of it, or invalid ones, are left out. A window around an invalid point is empty, and no planner
    /// plans in it.
    pub fn update(&mut self, center: [f64; 2], obstacles: impl Iterator<Item = [f64; 2]>) {
        // Cells stay where they are while the window moves, so that distances do not flicker.
        self.center = center.map(|part| (part / self.resolution).round() * self.resolution);
        if !self.center.iter().all(|part| part.is_finite()) {
            self.center = [f64::NAN; 2];
        }
        self.is_occupied.fill(false);
        let half = 0.5 * self.side as f64;
        let mut is_empty = true;
        for [x, y] in obstacles {
            let column = (x - self.center[0]) / self.resolution + half;
            let row = (y - self.center[1]) / self.resolution + half;
            let is_inside =
                column >= 0.0 && row >= 0.0 && column < self.side as f64 && row < self.side as f64;
            if is_inside {
                self.is_occupied[row as usize * self.side + column as usize] = true;
                is_empty = false;
            }
        }
        if is_empty {
            self.distances.fill(MAX_DISTANCE);
            return;
        }
        let occupied = &self.is_occupied;
        let squares = self.transform.squares(self.side, self.side, |cell| occupied[cell]);
        let resolution = self.resolution as f32;
        for (distance, square) in self.distances.iter_mut().zip(squares) {
            *distance = (*square as f32).sqrt() * resolution;
        }
    }

    /// Returns the edge length of a cell, m.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Returns the middle of the window.
    pub fn center(&self) -> [f64; 2] {
        self.center
    }

    /// Returns true if a point is inside of the window.
    /// Points outside are unknown.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        self.lookup().contains_circle([(x - self.center[0]) as f32, (y - self.center[1]) as f32], 0.0)
    }

    /// Returns the distance of a point to the nearest obstacle, m.
    /// It is 1,000 m outside of the window, see [`contains`](Self::contains).
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        let lookup = self.lookup();
        f64::from(lookup.distance((x - self.center[0]) as f32, (y - self.center[1]) as f32))
    }

    /// Cells along each side.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// Returns the cell of a point relative to the middle of the window.
    pub(crate) fn cell_of(&self, x: f32, y: f32) -> Option<usize> {
        let half = 0.5 * self.side as f64;
        let (column, row) = (f64::from(x) / self.resolution + half, f64::from(y) / self.resolution + half);
        let is_inside = column >= 0.0 && row >= 0.0 && column < self.side as f64 && row < self.side as f64;
        is_inside.then_some(row as usize * self.side + column as usize)
    }

    /// Returns the distance of a cell to the nearest obstacle, m.
    pub(crate) fn cell_distance(&self, cell: usize) -> f64 {
        f64::from(self.distances[cell])
    }

    /// Returns the lookup for points relative to the middle of the window.
    pub(crate) fn lookup(&self) -> FieldLookup<'_> {
        FieldLookup {
            distances: &self.distances,
            side: self.side,
            cells: self.side as f32,
            half: 0.5 * self.side as f32,
            inverse: (1.0 / self.resolution) as f32,
            reach: (0.5 * self.side as f64 * self.resolution) as f32,
        }
    }
}

/// View of the field for lookups in a loop.
#[derive(Clone, Copy)]
pub(crate) struct FieldLookup<'a> {
    distances: &'a [f32],
    side: usize,
    cells: f32,
    half: f32,
    inverse: f32,
    /// Distance of the window's edges from its middle, m.
    reach: f32,
}

impl FieldLookup<'_> {
    /// Returns true if a circle is inside of the window.
    /// Cells beyond the window are unknown.
    #[inline(always)]
    pub fn contains_circle(&self, [x, y]: [f32; 2], radius: f32) -> bool {
        let most = self.reach - radius;
        x.abs() < most && y.abs() < most
    }

    #[inline(always)]
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        let column = x * self.inverse + self.half;
        let row = y * self.inverse + self.half;
        if column >= 0.0 && row >= 0.0 && column < self.cells && row < self.cells {
            // Within the side, so the index fits.
            let cell = (row as u32).wrapping_mul(self.side as u32).wrapping_add(column as u32);
            self.distances.get(cell as usize).copied().unwrap_or(MAX_DISTANCE)
        } else {
            MAX_DISTANCE
        }
    }
}

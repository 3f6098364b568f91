//! Geometry of a grid.

use serde::{Deserialize, Serialize};
use slate_interfaces::{OccupancyGrid, Point2, Pose2};
use slate_module::math;

/// Pose, resolution and size of a grid in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Corner of the first cell, and direction of the grid's x axis.
    origin: [f64; 3],
    /// Edge length of a cell, m.
    pub resolution: f64,
    /// Number of cells along x.
    pub width: usize,
    /// Number of cells along y.
    pub height: usize,
}

impl Geometry {
    /// Creates a grid along the axes, of a size in meters.
    /// `None` if it has no cell or more than `most`.
    pub fn new([x, y]: [f64; 2], [width, height]: [f64; 2], resolution: f64, most: usize) -> Option<Self> {
        let cells = |length: f64| (length / resolution - 1e-9).ceil() as usize;
        Self { origin: [x, y, 0.0], resolution, width: cells(width), height: cells(height) }.checked(most)
    }

    /// Creates a grid of a number of cells from the pose of its first cell's corner.
    /// `None` if it has no cell or more than `most`.
    pub fn with_origin(
        origin: Pose2,
        resolution: f64,
        [width, height]: [usize; 2],
        most: usize,
    ) -> Option<Self> {
        let Pose2 { x, y, theta } = origin;
        Self { origin: [x, y, theta], resolution, width, height }.checked(most)
    }

    /// Returns the geometry of a grid.
    /// `None` if its data does not match, or it has more cells than `most`.
    pub fn of(grid: &OccupancyGrid, most: usize) -> Option<Self> {
        let Pose2 { x, y, theta } = grid.origin;
        let found = Self {
            origin: [x, y, theta],
            resolution: grid.resolution,
            width: grid.width as usize,
            height: grid.height as usize,
        };
        found.checked(most).filter(|found| found.cells() == grid.data.len())
    }

    fn checked(self, most: usize) -> Option<Self> {
        let is_somewhere = self.origin.iter().all(|number| number.is_finite());
        let is_fit = self.resolution.is_finite() && self.resolution > 0.0;
        let cells = self.width.checked_mul(self.height)?;
        (is_somewhere && is_fit && (1..=most).contains(&cells)).then_some(self)
    }

    /// Returns the number of cells.
    pub fn cells(&self) -> usize {
        self.width * self.height
    }

    /// Returns the pose of the first cell's corner.
    pub fn origin(&self) -> Pose2 {
        let [x, y, theta] = self.origin;
        Pose2 { x, y, theta }
    }

    /// Converts a point to cells from the corner, inside of the grid or not.
    pub fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let [left, low, theta] = self.origin;
        let (across, up) = (x - left, y - low);
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        ((across * cosine + up * sine) / self.resolution, (up * cosine - across * sine) / self.resolution)
    }

    /// Returns the cell at a point, as column and row.
    pub fn cell(&self, x: f64, y: f64) -> Option<(usize, usize)> {
        let (column, row) = self.place(x, y);
        let is_inside = column >= 0.0 && row >= 0.0 && column < self.width as f64 && row < self.height as f64;
        is_inside.then_some((column as usize, row as usize))
    }

    /// Returns the index of a cell.
    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.width + column
    }

    /// Returns the center of a cell.
    pub fn center(&self, column: usize, row: usize) -> Point2 {
        let [left, low, theta] = self.origin;
        let (across, up) = ((column as f64 + 0.5) * self.resolution, (row as f64 + 0.5) * self.resolution);
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        Point2 { x: left + across * cosine - up * sine, y: low + across * sine + up * cosine }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_center_of_a_cell_is_inside_of_it(
            x in -9.0..9.0_f64, y in -9.0..9.0_f64, theta in -3.0..3.0_f64, column in 0..40_usize, row in 0..30_usize,
        ) {
            let geometry = Geometry { origin: [x, y, theta], resolution: 0.05, width: 40, height: 30 };
            let middle = geometry.center(column, row);
            prop_assert_eq!(geometry.cell(middle.x, middle.y), Some((column, row)));
        }
    }

    #[test]
    fn an_invalid_grid_has_no_geometry() {
        assert!(Geometry::new([0.0, 0.0], [5.0, 5.0], 0.05, 65_536).unwrap().cells() == 10_000);
        assert!(Geometry::new([0.0, 0.0], [0.0, 5.0], 0.05, 65_536).is_none());
        assert!(Geometry::new([f64::NAN, 0.0], [5.0, 5.0], 0.05, 65_536).is_none());
        assert!(Geometry::new([0.0, 0.0], [1e9, 1e9], 1e-3, 65_536).is_none());
        assert!(Geometry::new([0.0, 0.0], [5.0, 5.0], 0.0, 65_536).is_none());
    }
}

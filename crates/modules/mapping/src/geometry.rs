//! Geometry of a grid.

use serde::{Deserialize, Serialize};
use slate_interfaces::{OccupancyGrid, Point2, Pose2};
use slate_module::math;

/// Largest number of cells of a grid.
pub(crate) const MOST: usize = 65_536;

/// Pose, resolution and size of a grid in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Geometry {
    /// Corner of the first cell, and direction of the grid's x axis.
    origin: [f64; 3],
    pub resolution: f64,
    pub width: usize,
    pub height: usize,
}

impl Geometry {
    /// Makes a grid along the axes; `None` if it has no cell or more than [`MOST`].
    pub fn new([x, y]: [f64; 2], [width, height]: [f64; 2], resolution: f64) -> Option<Self> {
        let cells = |length: f64| (length / resolution - 1e-9).ceil() as usize;
        Self { origin: [x, y, 0.0], resolution, width: cells(width), height: cells(height) }.checked()
    }

    /// Returns the geometry of a grid; `None` if its data does not match.
    pub fn of(grid: &OccupancyGrid) -> Option<Self> {
        let Pose2 { x, y, theta } = grid.origin;
        let found = Self {
            origin: [x, y, theta],
            resolution: grid.resolution,
            width: grid.width as usize,
            height: grid.height as usize,
        };
        found.checked().filter(|found| found.cells() == grid.data.len())
    }

    fn checked(self) -> Option<Self> {
        let is_somewhere = self.origin.iter().all(|number| number.is_finite());
        let is_fit = self.resolution.is_finite() && self.resolution > 0.0;
        let cells = self.width.checked_mul(self.height)?;
        (is_somewhere && is_fit && (1..=MOST).contains(&cells)).then_some(self)
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.width * self.height
    }

    /// Pose of the first cell's corner.
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

/// Iterates over the cells that a line segment crosses, as column and row, also outside of a grid (Amanatides and Woo, 1987).
pub(crate) struct LineCells {
    cell: (i64, i64),
    step: (i64, i64),
    /// Fraction of the segment at which it leaves the current column and row.
    next: (f64, f64),
    /// Fraction of the segment that a column and a row take.
    share: (f64, f64),
    left: i64,
}

impl LineCells {
    /// Between two points in cells, which are finite and no farther apart than a grid is large.
    pub fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        let axis = |from: f64, to: f64| {
            let (first, last) = (from.floor(), to.floor());
            let length = to - from;
            let step = if length < 0.0 { -1 } else { 1 };
            let border = if length < 0.0 { first } else { first + 1.0 };
            let (next, share) = match length == 0.0 {
                true => (f64::INFINITY, f64::INFINITY),
                false => ((border - from) / length, (1.0 / length).abs()),
            };
            (first as i64, step, next, share, (last - first).abs() as i64)
        };
        let (column, right, next_column, column_share, columns) = axis(from.0, to.0);
        let (row, up, next_row, row_share, rows) = axis(from.1, to.1);
        Self {
            cell: (column, row),
            step: (right, up),
            next: (next_column, next_row),
            share: (column_share, row_share),
            left: columns + rows + 1,
        }
    }
}

impl Iterator for LineCells {
    type Item = (i64, i64);

    fn next(&mut self) -> Option<(i64, i64)> {
        if self.left == 0 {
            return None;
        }
        self.left -= 1;
        let cell = self.cell;
        if self.next.0 < self.next.1 {
            self.cell.0 += self.step.0;
            self.next.0 += self.share.0;
        } else {
            self.cell.1 += self.step.1;
            self.next.1 += self.share.1;
        }
        Some(cell)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_line_crosses_neighbouring_cells_up_to_its_end(
            ax in -50.0..50.0_f64, ay in -50.0..50.0_f64, bx in -50.0..50.0_f64, by in -50.0..50.0_f64,
        ) {
            let cells: Vec<_> = LineCells::new((ax, ay), (bx, by)).collect();
            let of = |x: f64, y: f64| (x.floor() as i64, y.floor() as i64);
            prop_assert_eq!(cells[0], of(ax, ay));
            prop_assert_eq!(*cells.last().unwrap(), of(bx, by));
            for pair in cells.windows(2) {
                prop_assert_eq!((pair[0].0 - pair[1].0).abs() + (pair[0].1 - pair[1].1).abs(), 1);
            }
        }

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
        assert!(Geometry::new([0.0, 0.0], [5.0, 5.0], 0.05).unwrap().cells() == 10_000);
        assert!(Geometry::new([0.0, 0.0], [0.0, 5.0], 0.05).is_none());
        assert!(Geometry::new([f64::NAN, 0.0], [5.0, 5.0], 0.05).is_none());
        assert!(Geometry::new([0.0, 0.0], [1e9, 1e9], 1e-3).is_none());
        assert!(Geometry::new([0.0, 0.0], [5.0, 5.0], 0.0).is_none());
    }
}

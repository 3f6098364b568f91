//! Histogram grid of sonar echoes.

use slate_interfaces::{Point2, Pose2};
use slate_module::math;

use crate::error::LocalPlanningError;

/// Certainty grid of a square window around the robot, 0 to 1.
/// Occupancy from cones of sonars (Moravec and Elfes, 1985, *High resolution maps from wide angle sonar*), which fades
/// with time.
#[derive(Clone, Debug)]
pub struct CertaintyGrid {
    side: usize,
    resolution: f64,
    /// Cell of the frame at the window's lower left corner, in cells.
    corner: [i64; 2],
    certainty: Vec<f32>,
    shifted: Vec<f32>,
    /// Time after which a certainty has fallen to 1/e, s.
    memory: f64,
}

/// Largest number of cells along a side.
const MOST_CELLS: f64 = 400.0;
/// Certainty that an echo adds at its range.
/// A cone takes the same away before it.
const HIT: f32 = 0.4;
const MISS: f32 = 0.25;

impl CertaintyGrid {
    /// Creates a window of side `size`, m, around the origin.
    /// Certainties fade within `memory` seconds.
    ///
    /// # Errors
    /// A size, a resolution or a time that is not above 0, or more than 400 cells along a side.
    pub fn new(size: f64, resolution: f64, memory: f64) -> Result<Self, LocalPlanningError> {
        LocalPlanningError::unless_positive(&[
            ("size", size),
            ("resolution", resolution),
            ("memory", memory),
        ])?;
        let side = size / resolution;
        LocalPlanningError::unless(
            (2.0..=MOST_CELLS).contains(&side),
            "size",
            "2 to 400 cells of `resolution`",
        )?;
        let side = side as usize;
        let half = (side / 2) as i64;
        Ok(Self {
            side,
            resolution,
            corner: [-half, -half],
            certainty: vec![0.0; side * side],
            shifted: vec![0.0; side * side],
            memory,
        })
    }

    /// Centers the window on a point, and fades certainties for a time, s.
    /// It stays where it is for an invalid pose or time.
    pub fn advance(&mut self, robot: &Pose2, seconds: f64) {
        if !(robot.is_known() && seconds.is_finite()) {
            return;
        }
        let cell = |part: f64| (math::clamp(part / self.resolution, -1e9, 1e9)).floor() as i64;
        let half = (self.side / 2) as i64;
        let corner = [cell(robot.x) - half, cell(robot.y) - half];
        let by = [corner[0] - self.corner[0], corner[1] - self.corner[1]];
        let share = math::exp(-math::max(0.0, seconds) / self.memory) as f32;
        let side = self.side as i64;
        for row in 0..side {
            for column in 0..side {
                let (old_column, old_row) = (column + by[0], row + by[1]);
                let is_inside = (0..side).contains(&old_column) && (0..side).contains(&old_row);
                let old =
                    if is_inside { self.certainty[(old_row * side + old_column) as usize] } else { 0.0 };
                self.shifted[(row * side + column) as usize] = share * old;
            }
        }
        std::mem::swap(&mut self.certainty, &mut self.shifted);
        self.corner = corner;
    }

    /// Inserts the cone of a sonar: free up to `range`, occupied there if `heard`.
    /// `sonar` is its pose, `range` is in m; `heard` is true if it received an echo.
    pub fn insert_cone(&mut self, sonar: &Pose2, field_of_view: f64, range: f64, heard: bool) {
        if !(sonar.is_known() && range >= 0.0 && field_of_view > 0.0) {
            return;
        }
        let (ahead_x, ahead_y) = (math::cos(sonar.theta), math::sin(sonar.theta));
        let widest = math::cos(math::min(0.5 * field_of_view, std::f64::consts::PI));
        let depth = self.resolution;
        for cell in 0..self.certainty.len() {
            let middle = self.middle(cell);
            let (across, up) = (middle.x - sonar.x, middle.y - sonar.y);
            let square = across * across + up * up;
            if square > (range + depth) * (range + depth) {
                continue;
            }
            let distance = square.sqrt();
            let along = across * ahead_x + up * ahead_y;
            if along < widest * distance {
                continue;
            }
            let certainty = &mut self.certainty[cell];
            if distance < range - depth {
                *certainty = crate::single::max(0.0, *certainty - MISS);
            } else if heard {
                // The axis of a cone is more certain than its rim.
                let share = if distance > 0.0 { along / distance } else { 1.0 };
                let rim = (share - widest) / (1.0 - widest);
                *certainty = crate::single::min(1.0, *certainty + HIT * (0.5 + 0.5 * rim as f32));
            }
        }
    }

    /// Returns the edge length of a cell, m.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Returns the middle and the certainty of each cell that is not certainly free.
    pub fn cells(&self) -> impl Iterator<Item = (Point2, f64)> + '_ {
        let occupied = self.certainty.iter().enumerate().filter(|(_, certainty)| **certainty > 0.01);
        occupied.map(|(cell, certainty)| (self.middle(cell), f64::from(*certainty)))
    }

    fn middle(&self, cell: usize) -> Point2 {
        let (column, row) = ((cell % self.side) as i64, (cell / self.side) as i64);
        let middle = |cell: i64| (cell as f64 + 0.5) * self.resolution;
        Point2 { x: middle(self.corner[0] + column), y: middle(self.corner[1] + row) }
    }
}

//! Collisions of a footprint with the obstacles of a grid.

use slate_avoidance::Footprint;
use slate_grid::{DistanceTransform, Geometry};
use slate_interfaces::Pose2;
use slate_module::math;

/// Half of a cell's diagonal, cells.
/// An obstacle may be that much nearer than the middle of its cell, and a point than the middle of its own.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Obstacles of a grid with the distance of each cell to the nearest one.
#[derive(Clone, Debug)]
pub struct FootprintGrid {
    geometry: Geometry,
    /// Distances between middles of cells, cells.
    distances: Vec<f32>,
}

impl FootprintGrid {
    /// Finds the distances to the occupied cells; outside of the grid nothing is free.
    pub fn new(geometry: Geometry, is_occupied: impl Fn(usize) -> bool) -> Self {
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(geometry.width, geometry.height, is_occupied);
        let distances = squares.iter().map(|square| (*square as f64).sqrt() as f32).collect();
        Self { geometry, distances }
    }

    /// Returns the geometry of the cells.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Returns the distance of a point from obstacles and the grid's edge, m.
    /// It is at most the true one, and 0 outside.
    pub(crate) fn clearance(&self, x: f64, y: f64) -> f64 {
        let (column, row) = self.geometry.place(x, y);
        let Some(distance) = self.distance(column, row) else { return 0.0 };
        let to_edge = [column, row, self.geometry.width as f64 - column, self.geometry.height as f64 - row];
        let free = to_edge.into_iter().fold(f64::from(distance) - 2.0 * HALF_DIAGONAL, math::min);
        math::max(free, 0.0) * self.geometry.resolution
    }

    /// Returns whether a point is in a cell of the grid that is not occupied.
    fn is_free(&self, x: f64, y: f64) -> bool {
        let (column, row) = self.geometry.place(x, y);
        self.distance(column, row).is_some_and(|distance| distance > 0.0)
    }

    /// Returns the distance of a cell to the nearest occupied one, cells.
    pub(crate) fn cell_distance(&self, cell: usize) -> f64 {
        self.distances.get(cell).map_or(0.0, |distance| f64::from(*distance))
    }

    fn distance(&self, column: f64, row: f64) -> Option<f32> {
        let is_inside = column >= 0.0
            && row >= 0.0
            && column < self.geometry.width as f64
            && row < self.geometry.height as f64;
        is_inside.then(|| self.distances[row as usize * self.geometry.width + column as usize])
    }
}

/// Footprint as discs and points that cover it.
/// The discs decide quickly that it is free.
#[derive(Clone, Debug)]
pub(crate) struct FootprintCover {
    /// Middles in the robot's frame and radius of the discs, m.
    discs: Vec<[f64; 2]>,
    disc_radius: f64,
    /// Points no farther apart than half a cell, m.
    points: Vec<[f64; 2]>,
    /// Radius of the largest circle around the robot's origin inside of the outline, m.
    pub inscribed_radius: f64,
}

impl FootprintCover {
    /// Covers a footprint for a grid of that resolution, m.
    pub fn new(footprint: &Footprint, resolution: f64) -> Self {
        let corners: Vec<[f64; 2]> = footprint.outline().collect();
        let bound = |at: usize, least: bool| {
            let pick = if least { math::min } else { math::max };
            corners.iter().map(|corner| corner[at]).reduce(pick).unwrap_or(0.0)
        };
        let ([left, right], [low, high]) =
            ([bound(0, true), bound(0, false)], [bound(1, true), bound(1, false)]);
        // Discs along the longer side, each over a part that is about square.
        let (length, width) = (right - left, high - low);
        let (long, short) = if length >= width { (length, width) } else { (width, length) };
        let count = math::max((long / math::max(short, resolution)).ceil(), 1.0);
        let part = long / count;
        let discs = (0..count as usize).map(|k| {
            let along = (k as f64 + 0.5) * part;
            if length >= width {
                [left + along, 0.5 * (low + high)]
            } else {
                [0.5 * (left + right), low + along]
            }
        });
        Self {
            discs: discs.collect(),
            disc_radius: 0.5 * math::hypot(part, short),
            points: points(footprint, [left, right], [low, high], 0.5 * resolution),
            inscribed_radius: math::max(0.0, -footprint.distance(0.0, 0.0)),
        }
    }

    /// Returns whether no occupied cell is under the footprint at a pose.
    pub fn is_free(&self, grid: &FootprintGrid, pose: &Pose2) -> bool {
        if !grid.is_free(pose.x, pose.y) {
            return false;
        }
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let place = |[x, y]: &[f64; 2]| [pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine];
        let is_far = |disc: &[f64; 2]| {
            let [x, y] = place(disc);
            grid.clearance(x, y) > self.disc_radius
        };
        if self.discs.iter().all(is_far) {
            return true;
        }
        self.points.iter().all(|point| {
            let [x, y] = place(point);
            grid.is_free(x, y)
        })
    }
}

/// Points of the outline, then those inside of it: those that hit first come first.
fn points(
    footprint: &Footprint,
    [left, right]: [f64; 2],
    [low, high]: [f64; 2],
    spacing: f64,
) -> Vec<[f64; 2]> {
    let corners: Vec<[f64; 2]> = footprint.outline().collect();
    let mut points = Vec::new();
    for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (across, up) = (to[0] - from[0], to[1] - from[1]);
        let steps = math::max((math::hypot(across, up) / spacing).ceil(), 1.0);
        let share = |step: u32| f64::from(step) / steps;
        points.extend(
            (0..steps as u32).map(|step| [from[0] + across * share(step), from[1] + up * share(step)]),
        );
    }
    // An occupied cell inside of the outline has a point in it.
    let inner = 2.0 * spacing;
    let (columns, rows) = ((right - left) / inner, (high - low) / inner);
    for row in 1..=rows as u32 {
        for column in 1..=columns as u32 {
            let (x, y) = (left + f64::from(column) * inner, low + f64::from(row) * inner);
            if footprint.distance(x, y) < 0.0 {
                points.push([x, y]);
            }
        }
    }
    points
}

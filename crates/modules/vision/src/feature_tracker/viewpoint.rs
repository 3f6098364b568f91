//! Places to look at something from.

use slate_grid::{Geometry, LineCells};
use slate_interfaces::Pose2;
use slate_module::math;

/// Occupancy from which a cell is an obstacle, percent.
const OCCUPIED: i8 = 50;
/// Directions that are tried, and distances as multiples of the wanted one.
const DIRECTIONS: usize = 24;
const DISTANCES: [f64; 3] = [1.0, 1.35, 0.75];
/// Radius of a target, m: cells within belong to it or its wall.
const TARGET: f64 = 0.45;

/// Known free space around a robot.
pub(super) struct FreeSpace<'a> {
    pub geometry: Geometry,
    /// Occupancy of each cell, percent; -1 where it is unknown.
    pub cells: &'a [i8],
    /// Least distance of a place to what is occupied, m.
    pub clearance: f64,
}

impl FreeSpace<'_> {
    fn is_occupied(&self, (column, row): (i64, i64)) -> bool {
        let inside = usize::try_from(column).ok().zip(usize::try_from(row).ok());
        inside
            .filter(|(column, row)| *column < self.geometry.width && *row < self.geometry.height)
            .is_none_or(|(column, row)| self.cells[self.geometry.index(column, row)] >= OCCUPIED)
    }

    /// Returns true if a position is known to be free for the robot.
    fn is_free(&self, [x, y]: [f64; 2]) -> bool {
        let Some((column, row)) = self.geometry.cell(x, y) else { return false };
        let known = self.cells[self.geometry.index(column, row)];
        let reach = (self.clearance / self.geometry.resolution).ceil() as i64;
        let (column, row) = (column as i64, row as i64);
        let square =
            (self.clearance / self.geometry.resolution) * (self.clearance / self.geometry.resolution);
        let is_clear = |dx: i64, dy: i64| {
            (dx * dx + dy * dy) as f64 > square || !self.is_occupied((column + dx, row + dy))
        };
        (0..OCCUPIED).contains(&known)
            && (-reach..=reach).all(|dy| (-reach..=reach).all(|dx| is_clear(dx, dy)))
    }

    /// Returns true if nothing stands between a position and a target.
    fn is_in_sight(&self, from: [f64; 2], target: [f64; 2]) -> bool {
        let distance = math::hypot(target[0] - from[0], target[1] - from[1]);
        let share = math::max(0.0, (distance - TARGET) / distance);
        let end = [0, 1].map(|axis| from[axis] + share * (target[axis] - from[axis]));
        let place = |[x, y]: [f64; 2]| self.geometry.place(x, y);
        LineCells::new(place(from), place(end)).all(|cell| !self.is_occupied(cell))
    }

    /// Returns true if a target is seen from a pose.
    /// The pose was chosen for about that distance.
    pub fn sees(&self, [x, y, _]: [f64; 3], target: [f64; 2], distance: f64) -> bool {
        let away = math::hypot(target[0] - x, target[1] - y);
        away <= 1.6 * distance
            && away >= 0.5 * distance
            && self.is_free([x, y])
            && self.is_in_sight([x, y], target)
    }
}

/// Returns the nearest pose that sees a target from about a distance.
/// Its heading is the one to the target.
pub(super) fn viewpoint(
    around: &FreeSpace<'_>,
    target: [f64; 2],
    robot: &Pose2,
    distance: f64,
) -> Option<[f64; 3]> {
    let mut best: Option<(f64, [f64; 3])> = None;
    for factor in DISTANCES {
        for k in 0..DIRECTIONS {
            let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
            let (c, s) = (math::cos(angle), math::sin(angle));
            let place = [target[0] + factor * distance * c, target[1] + factor * distance * s];
            let way = math::hypot(place[0] - robot.x, place[1] - robot.y);
            let is_nearer = best.is_none_or(|(least, _)| way < least);
            if is_nearer && around.is_free(place) && around.is_in_sight(place, target) {
                best = Some((way, [place[0], place[1], math::atan2(-s, -c)]));
            }
        }
        if best.is_some() {
            break;
        }
    }
    best.map(|(_, place)| place)
}

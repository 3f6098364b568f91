//! Ranges in an occupancy grid.

use slate_module::math;

use crate::{DistanceTransform, Geometry};

/// Casts rays in a grid of occupied cells.
///
/// A ray leaps as far as the distance transform shows cells to be free, and walks from cell to cell near obstacles
/// (Amanatides and Woo, 1987), so that a range is exact: that of the occupied cell's edge.
#[derive(Clone, Debug, PartialEq)]
pub struct RayCaster {
    geometry: Geometry,
    /// Direction of the grid's x axis.
    axis: [f64; 2],
    /// Cells that a ray from each cell may skip without reaching an occupied one.
    /// [`OCCUPIED`] for occupied cells.
    leaps: Vec<u8>,
}

const OCCUPIED: u8 = u8::MAX;
/// Longest leap, cells.
const LONGEST: f64 = 254.0;
/// Leaps from here on are faster than the step to the next cell.
const WORTHWHILE: u8 = 2;

impl RayCaster {
    /// Returns the ray caster of a grid from its occupied cells.
    pub fn new(geometry: Geometry, is_occupied: impl Fn(usize) -> bool) -> Self {
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(geometry.width, geometry.height, &is_occupied);
        let leap = |square: i64| {
            // Between middles: half a diagonal at each end is taken off.
            let free = (square as f64).sqrt() - std::f64::consts::SQRT_2;
            if free < LONGEST { free as u8 } else { LONGEST as u8 }
        };
        let leaps = squares.iter().map(|square| if *square == 0 { OCCUPIED } else { leap(*square) });
        let theta = geometry.origin().theta;
        Self { leaps: leaps.collect(), axis: [math::cos(theta), math::sin(theta)], geometry }
    }

    /// Returns the pose, resolution and size of the grid.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Returns whether the cell at a point is occupied; none is outside of the grid.
    pub fn is_occupied(&self, x: f64, y: f64) -> bool {
        let cell = self.geometry.cell(x, y);
        cell.is_some_and(|(column, row)| self.leaps[self.geometry.index(column, row)] == OCCUPIED)
    }

    /// Returns the range from a point to the first occupied cell in a direction, m.
    /// The direction is a unit vector; infinite if the grid has none before `range_max`.
    pub fn range(&self, [x, y]: [f64; 2], [across, up]: [f64; 2], range_max: f64) -> f64 {
        let (resolution, origin, [cosine, sine]) =
            (self.geometry.resolution, self.geometry.origin(), self.axis);
        let turn = |across: f64, up: f64| [across * cosine + up * sine, up * cosine - across * sine];
        let from = turn(x - origin.x, y - origin.y).map(|part| part / resolution);
        let ray = Ray { from, along: turn(across, up) };
        let size = [self.geometry.width as f64, self.geometry.height as f64];
        match ray.inside(size, range_max / resolution) {
            Some(inside) => resolution * self.walk(&ray, inside),
            None => f64::INFINITY,
        }
    }

    /// Returns the distance to the first occupied cell, cells.
    /// It searches the part of the ray that is inside of the grid.
    fn walk(&self, ray: &Ray, (begin, end): (f64, f64)) -> f64 {
        let mut distance = begin;
        while distance <= end {
            let mut cell = ray.cell(distance, [self.geometry.width, self.geometry.height]);
            // Distances at which the ray leaves the column and the row.
            let mut leaves = [ray.leaves(0, cell[0]), ray.leaves(1, cell[1])];
            loop {
                match self.leaps[self.geometry.index(cell[0], cell[1])] {
                    OCCUPIED => return distance,
                    leap if leap >= WORTHWHILE => {
                        distance += f64::from(leap);
                        break;
                    }
                    _ => {}
                }
                let axis = usize::from(leaves[1] < leaves[0]);
                distance = leaves[axis];
                let size = [self.geometry.width, self.geometry.height][axis];
                let next =
                    if ray.along[axis] > 0.0 { Some(cell[axis] + 1) } else { cell[axis].checked_sub(1) };
                let Some(next) = next.filter(|next| *next < size && distance <= end) else {
                    return f64::INFINITY;
                };
                cell[axis] = next;
                leaves[axis] = ray.leaves(axis, next);
            }
        }
        f64::INFINITY
    }
}

/// Ray in cells.
struct Ray {
    from: [f64; 2],
    along: [f64; 2],
}

impl Ray {
    /// Returns the distances between which the ray is in the grid, up to the longest.
    fn inside(&self, size: [f64; 2], longest: f64) -> Option<(f64, f64)> {
        let (mut begin, mut end) = (0.0, longest);
        for ((from, along), size) in self.from.into_iter().zip(self.along).zip(size) {
            if !from.is_finite() || !along.is_finite() {
                return None;
            }
            if along == 0.0 {
                if !(0.0..size).contains(&from) {
                    return None;
                }
                continue;
            }
            let (one, other) = (-from / along, (size - from) / along);
            let (first, last) = if one < other { (one, other) } else { (other, one) };
            begin = if first > begin { first } else { begin };
            end = if last < end { last } else { end };
        }
        (begin <= end).then_some((begin, end))
    }

    /// Returns the cell at a distance, clamped to the grid.
    /// Rounding does not lead out of it.
    fn cell(&self, distance: f64, size: [usize; 2]) -> [usize; 2] {
        std::array::from_fn(|axis| {
            let place = self.from[axis] + distance * self.along[axis];
            (place as usize).min(size[axis] - 1)
        })
    }

    /// Returns the distance at which the ray leaves a column or row.
    fn leaves(&self, axis: usize, cell: usize) -> f64 {
        let along = self.along[axis];
        let border = if along > 0.0 { cell as f64 + 1.0 } else { cell as f64 };
        if along == 0.0 { f64::INFINITY } else { (border - self.from[axis]) / along }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use super::*;
    use crate::LineCells;
    use proptest::prelude::*;

    /// Returns the range by the cells of a line, one by one.
    fn expected(caster: &RayCaster, [x, y]: [f64; 2], angle: f64, range_max: f64) -> f64 {
        let geometry = caster.geometry();
        let (across, up) = (math::cos(angle), math::sin(angle));
        let (from, to) = (geometry.place(x, y), geometry.place(x + range_max * across, y + range_max * up));
        let hit = LineCells::new(from, to).find(|(column, row)| {
            let cell = usize::try_from(*column).ok().zip(usize::try_from(*row).ok());
            cell.is_some_and(|(column, row)| {
                let is_inside = column < geometry.width && row < geometry.height;
                is_inside && caster.leaps[geometry.index(column, row)] == OCCUPIED
            })
        });
        let Some((column, row)) = hit else { return f64::INFINITY };
        // Point at which the line enters the cell.
        let enters = |cell: i64, from: f64, to: f64| {
            let border = if to > from { cell as f64 } else { cell as f64 + 1.0 };
            let is_beyond = from.floor() as i64 != cell;
            if is_beyond { (border - from) / (to - from) } else { 0.0 }
        };
        range_max * math::max(enters(column, from.0, to.0), enters(row, from.1, to.1))
    }

    proptest! {
        #[test]
        fn a_range_is_that_of_the_first_occupied_cell(
            seeds in prop::collection::vec(prop::bool::weighted(0.02), 40 * 30),
            x in -1.0..5.0_f64, y in -1.0..4.0_f64, angle in -3.2..3.2_f64, range_max in 0.5..8.0_f64,
        ) {
            let geometry = Geometry::new([0.0, 0.0], [4.0, 3.0], 0.1, 10_000).unwrap();
            let caster = RayCaster::new(geometry, |cell| seeds[cell]);
            let found = caster.range([x, y], [math::cos(angle), math::sin(angle)], range_max);
            let wanted = expected(&caster, [x, y], angle, range_max);
            prop_assert!(found == wanted || (found - wanted).abs() < 1e-9, "{found} {wanted}");
        }
    }

    #[test]
    fn a_ray_along_an_axis_ends_at_the_edge_of_a_cell() {
        let geometry = Geometry::new([0.0, 0.0], [4.0, 3.0], 0.1, 10_000).unwrap();
        let caster = RayCaster::new(geometry, |cell| cell == geometry.index(30, 10));
        let from = [0.55, 1.05];
        assert!((caster.range(from, [1.0, 0.0], 9.0) - 2.45).abs() < 1e-9);
        assert!(caster.range(from, [1.0, 0.0], 2.4).is_infinite());
        assert!(caster.range(from, [0.0, 1.0], 9.0).is_infinite());
        assert!(caster.range([f64::NAN, 1.0], [1.0, 0.0], 9.0).is_infinite());
        assert!(caster.is_occupied(3.05, 1.05) && !caster.is_occupied(3.15, 1.05));
        assert!(caster.range([3.05, 1.05], [1.0, 0.0], 9.0) == 0.0);
    }
}

//! Manual strokes over a map.

use serde::{Deserialize, Serialize};
use slate_grid::Geometry;
use slate_interfaces::{MapMark, MapStroke, Point2};
use slate_module::math;

/// Limits: strokes of a map, and points of a stroke.
const MAX_STROKES: usize = 256;
const POINTS: usize = 32;

/// Value of a cell without paint.
pub(crate) const BARE: i8 = -1;

/// Strokes in their order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Painting {
    strokes: Vec<Stroke>,
    /// Painted cells, computed on demand; empty after an undo.
    #[serde(skip)]
    cells: Vec<i8>,
    #[serde(skip)]
    of: Geometry,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Stroke {
    /// Painted value: free, occupied or [`BARE`].
    cell: i8,
    width: f64,
    count: usize,
    points: [(f64, f64); POINTS],
}

impl Painting {
    /// Reserves memory for all strokes on a map, so that none of them allocates.
    pub fn reserve(&mut self, geometry: &Geometry) {
        self.strokes.reserve_exact(MAX_STROKES - self.strokes.len().min(MAX_STROKES));
        self.cells.reserve_exact(geometry.cells() - self.cells.len().min(geometry.cells()));
    }

    /// Adds a stroke.
    ///
    /// # Errors
    /// One of the reasons of [`MapStroke`].
    pub fn add(&mut self, stroke: &MapStroke) -> Result<(), u16> {
        let cell = match stroke.mark {
            MapMark::OCCUPIED => 100,
            MapMark::FREE => 0,
            MapMark::MEASURED => BARE,
            MapMark::UNDO => return self.strokes.pop().map(|_| self.cells.clear()).ok_or(MapStroke::NOTHING),
            _ => return Err(MapStroke::NOWHERE),
        };
        let is_number = |point: &Point2| point.x.is_finite() && point.y.is_finite();
        let is_fit = stroke.width.is_finite() && stroke.width > 0.0;
        if !is_fit || stroke.points.is_empty() || !stroke.points.iter().all(is_number) {
            return Err(MapStroke::NOWHERE);
        }
        if self.strokes.len() >= MAX_STROKES {
            return Err(MapStroke::FULL);
        }
        let mut points = [(0.0, 0.0); POINTS];
        for (place, point) in points.iter_mut().zip(stroke.points.iter()) {
            *place = (point.x, point.y);
        }
        let stroke = Stroke { cell, width: stroke.width, count: stroke.points.len(), points };
        if !self.cells.is_empty() {
            stroke.paint(&self.of, &mut self.cells);
        }
        self.strokes.push(stroke);
        Ok(())
    }

    /// Returns the painted cells of a map; empty without strokes.
    pub fn cells(&mut self, geometry: &Geometry) -> &[i8] {
        if self.strokes.is_empty() {
            return &[];
        }
        if self.cells.is_empty() || self.of != *geometry {
            self.of = *geometry;
            self.cells.clear();
            self.cells.resize(geometry.cells(), BARE);
            for stroke in &self.strokes {
                stroke.paint(geometry, &mut self.cells);
            }
        }
        &self.cells
    }
}

impl Stroke {
    fn paint(&self, geometry: &Geometry, cells: &mut [i8]) {
        // A brush is at least a cell wide.
        let reach = math::max(self.width / 2.0 / geometry.resolution, 0.75);
        let points = &self.points[..self.count.min(POINTS)];
        for (from, to) in points.iter().zip(points.iter().skip(1).chain(points.last())) {
            let (from, to) = (geometry.place(from.0, from.1), geometry.place(to.0, to.1));
            // Cells within reach, clamped to the map.
            let span = |from: f64, to: f64, most: usize| {
                let (low, high) = (math::min(from, to) - reach, math::max(from, to) + reach);
                (low as usize).min(most)..(high as usize).saturating_add(1).min(most)
            };
            for row in span(from.1, to.1, geometry.height) {
                for column in span(from.0, to.0, geometry.width) {
                    if distance((column as f64 + 0.5, row as f64 + 0.5), from, to) <= reach {
                        cells[geometry.index(column, row)] = self.cell;
                    }
                }
            }
        }
    }
}

/// Returns the distance of a point from a line segment.
fn distance((x, y): (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx * dx + dy * dy;
    let share = match length > 0.0 {
        true => math::clamp(((x - from.0) * dx + (y - from.1) * dy) / length, 0.0, 1.0),
        false => 0.0,
    };
    math::hypot(x - from.0 - share * dx, y - from.1 - share * dy)
}

/// Returns a stroke of points.
#[cfg(test)]
pub(crate) fn stroke(mark: MapMark, width: f64, points: &[(f64, f64)]) -> MapStroke {
    let points: Vec<_> = points.iter().map(|(x, y)| Point2 { x: *x, y: *y }).collect();
    MapStroke { width, mark, points: slate_module::Sequence::new(&points) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn later_strokes_override_earlier_ones_and_undo_singly() {
        let geometry = Geometry::new([0.0, 0.0], [1.0, 1.0], 0.1, 1_000).unwrap();
        let mut painting = Painting::default();
        assert!(painting.cells(&geometry).is_empty());
        painting.add(&stroke(MapMark::OCCUPIED, 0.2, &[(0.05, 0.55), (0.95, 0.55)])).unwrap();
        let row = |painting: &mut Painting| painting.cells(&geometry)[50..60].to_vec();
        assert_eq!(row(&mut painting), [100; 10]);
        assert_eq!(painting.cells(&geometry)[0], BARE);
        painting.add(&stroke(MapMark::FREE, 0.1, &[(0.05, 0.55)])).unwrap();
        painting.add(&stroke(MapMark::MEASURED, 0.1, &[(0.95, 0.55)])).unwrap();
        assert_eq!(row(&mut painting), [0, 100, 100, 100, 100, 100, 100, 100, 100, BARE]);
        let undo = stroke(MapMark::UNDO, 0.0, &[]);
        painting.add(&undo).unwrap();
        painting.add(&undo).unwrap();
        assert_eq!(row(&mut painting), [100; 10]);
        painting.add(&undo).unwrap();
        assert!(painting.cells(&geometry).is_empty());
        assert_eq!(painting.add(&undo), Err(MapStroke::NOTHING));
    }

    proptest! {
        #[test]
        fn strokes_painted_singly_or_at_once_reach_the_same_cells(
            strokes in prop::collection::vec(
                (0..3_u8, 0.05..0.6_f64, prop::collection::vec((-1.5..2.5_f64, -1.5..2.5_f64), 1..5)), 1..6,
            ),
        ) {
            let geometry = Geometry::new([0.0, 0.0], [1.0, 1.0], 0.1, 1_000).unwrap();
            let (mut each, mut all) = (Painting::default(), Painting::default());
            for (mark, width, points) in &strokes {
                let stroke = stroke(MapMark(*mark), *width, points);
                each.add(&stroke).unwrap();
                each.cells(&geometry);
                all.add(&stroke).unwrap();
            }
            prop_assert_eq!(each.cells(&geometry), all.cells(&geometry));
            let (mark, width, points) = strokes.last().unwrap();
            let last = [100, 0, BARE][usize::from(*mark)];
            for (cell, painted) in all.cells(&geometry).iter().enumerate() {
                let Point2 { x, y } = geometry.center(cell % 10, cell / 10);
                let near = points.iter().zip(points.iter().skip(1).chain(points.last()));
                let near = near.map(|(from, to)| distance((x, y), *from, *to)).fold(f64::INFINITY, math::min);
                prop_assert!(near > math::max(width / 2.0, 0.075) - 1e-9 || *painted == last);
            }
        }
    }

    #[test]
    fn invalid_and_surplus_strokes_are_refused() {
        let mut painting = Painting::default();
        let mut refused = |width, points: &[(f64, f64)]| {
            painting.add(&stroke(MapMark::FREE, width, points)) == Err(MapStroke::NOWHERE)
        };
        assert!(refused(0.1, &[]) && refused(0.0, &[(1.0, 1.0)]) && refused(f64::NAN, &[(1.0, 1.0)]));
        assert!(refused(0.1, &[(f64::INFINITY, 1.0)]));
        assert_eq!(painting.add(&stroke(MapMark(9), 0.1, &[(1.0, 1.0)])), Err(MapStroke::NOWHERE));
        for _ in 0..MAX_STROKES {
            painting.add(&stroke(MapMark::FREE, 0.1, &[(1.0, 1.0)])).unwrap();
        }
        let one_more = painting.add(&stroke(MapMark::FREE, 0.1, &[(1.0, 1.0)]));
        assert_eq!(one_more, Err(MapStroke::FULL));
    }
}

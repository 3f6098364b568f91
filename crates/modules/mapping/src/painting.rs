//! What a person has painted on a map.

use serde::{Deserialize, Serialize};
use slate_interfaces::{MapMark, MapStroke, Point2};
use slate_module::math;

use crate::geometry::Geometry;

/// How many strokes are kept, and how many points one has.
const MOST: usize = 256;
const POINTS: usize = 32;

/// Nothing is painted there.
pub(crate) const BARE: i8 = -1;

/// The strokes, in their order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Painting {
    strokes: Vec<Stroke>,
    /// What the cells look like by them; without any, nothing.
    #[serde(skip)]
    cells: Vec<i8>,
    #[serde(skip)]
    of: Geometry,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Stroke {
    /// What its cells are: free, occupied, or bare.
    cell: i8,
    width: f64,
    count: usize,
    points: [(f64, f64); POINTS],
}

impl Painting {
    /// Takes a stroke.
    ///
    /// # Errors
    /// The reason why not, one of those of [`MapStroke`].
    pub fn take(&mut self, stroke: &MapStroke) -> Result<(), u16> {
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
        if self.strokes.len() >= MOST {
            return Err(MapStroke::FULL);
        }
        let mut points = [(0.0, 0.0); POINTS];
        for (place, point) in points.iter_mut().zip(stroke.points.iter()) {
            *place = (point.x, point.y);
        }
        // Room for all of them, once.
        self.strokes.reserve_exact(MOST - self.strokes.len());
        self.strokes.push(Stroke { cell, width: stroke.width, count: stroke.points.len(), points });
        self.cells.clear();
        Ok(())
    }

    /// What is painted on the cells of a map; nothing at all when nobody has.
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
        // A brush is never thinner than what it paints on.
        let reach = math::max(self.width / 2.0, 0.75 * geometry.resolution);
        let points = &self.points[..self.count.min(POINTS)];
        let ends = || points.iter().zip(points.iter().skip(1).chain(points.last()));
        for row in 0..geometry.height {
            for column in 0..geometry.width {
                let Point2 { x, y } = geometry.middle(column, row);
                if ends().any(|(from, to)| distance((x, y), *from, *to) <= reach) {
                    cells[geometry.index(column, row)] = self.cell;
                }
            }
        }
    }
}

/// From a place to a straight line between two.
fn distance((x, y): (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx * dx + dy * dy;
    let share = match length > 0.0 {
        true => math::clamp(((x - from.0) * dx + (y - from.1) * dy) / length, 0.0, 1.0),
        false => 0.0,
    };
    math::hypot(x - from.0 - share * dx, y - from.1 - share * dy)
}

/// A stroke of those points.
#[cfg(test)]
pub(crate) fn stroke(mark: MapMark, width: f64, points: &[(f64, f64)]) -> MapStroke {
    let points: Vec<_> = points.iter().map(|(x, y)| Point2 { x: *x, y: *y }).collect();
    MapStroke { width, mark, reserved: [0; 7], points: slate_module::Sequence::new(&points) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use super::*;

    #[test]
    fn later_strokes_go_over_earlier_ones_and_are_taken_back_one_by_one() {
        let geometry = Geometry::new([0.0, 0.0], [1.0, 1.0], 0.1).unwrap();
        let mut painting = Painting::default();
        assert!(painting.cells(&geometry).is_empty());
        painting.take(&stroke(MapMark::OCCUPIED, 0.2, &[(0.05, 0.55), (0.95, 0.55)])).unwrap();
        let row = |painting: &mut Painting| painting.cells(&geometry)[50..60].to_vec();
        assert_eq!(row(&mut painting), [100; 10]);
        assert_eq!(painting.cells(&geometry)[0], BARE);
        painting.take(&stroke(MapMark::FREE, 0.1, &[(0.05, 0.55)])).unwrap();
        painting.take(&stroke(MapMark::MEASURED, 0.1, &[(0.95, 0.55)])).unwrap();
        assert_eq!(row(&mut painting), [0, 100, 100, 100, 100, 100, 100, 100, 100, BARE]);
        let undo = stroke(MapMark::UNDO, 0.0, &[]);
        painting.take(&undo).unwrap();
        painting.take(&undo).unwrap();
        assert_eq!(row(&mut painting), [100; 10]);
        painting.take(&undo).unwrap();
        assert!(painting.cells(&geometry).is_empty());
        assert_eq!(painting.take(&undo), Err(MapStroke::NOTHING));
    }

    #[test]
    fn strokes_that_are_nowhere_or_too_many_are_refused() {
        let mut painting = Painting::default();
        let mut refused = |width, points: &[(f64, f64)]| {
            painting.take(&stroke(MapMark::FREE, width, points)) == Err(MapStroke::NOWHERE)
        };
        assert!(refused(0.1, &[]) && refused(0.0, &[(1.0, 1.0)]) && refused(f64::NAN, &[(1.0, 1.0)]));
        assert!(refused(0.1, &[(f64::INFINITY, 1.0)]));
        assert_eq!(painting.take(&stroke(MapMark(9), 0.1, &[(1.0, 1.0)])), Err(MapStroke::NOWHERE));
        for _ in 0..MOST {
            painting.take(&stroke(MapMark::FREE, 0.1, &[(1.0, 1.0)])).unwrap();
        }
        let one_more = painting.take(&stroke(MapMark::FREE, 0.1, &[(1.0, 1.0)]));
        assert_eq!(one_more, Err(MapStroke::FULL));
    }
}

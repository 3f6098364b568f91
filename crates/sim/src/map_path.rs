//! Short path of a disc in the map of a world.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use slate_grid::{DistanceTransform, Geometry, LineCells};

use crate::geometry::{Point, Polygon, nearest_on};
use crate::wall_map::WorldMap;

/// Returns the length of a short path of a disc, m; `None` without a path.
/// Obstacles are the walls of a map and other bodies.
///
/// A search on the cells (Dijkstra's algorithm), whose path is then pulled tight: each point sees the next one. It is
/// some percent longer than the shortest.
pub fn map_path(map: &WorldMap, bodies: &[Polygon], from: Point, to: Point, radius: f64) -> Option<f64> {
    let grid = DiscGrid::new(map, bodies, radius);
    let ends = [from, to].map(|end| grid.geometry.cell(end.x, end.y));
    let [Some(start), Some(goal)] = ends.map(|end| end.map(|(column, row)| grid.geometry.index(column, row)))
    else {
        return None;
    };
    let cells = grid.search(start, goal)?;
    Some(grid.pulled(&cells, from, to))
}

/// Free space of a disc's center, as grid cells.
struct DiscGrid {
    geometry: Geometry,
    is_free: Vec<bool>,
}

impl DiscGrid {
    fn new(map: &WorldMap, bodies: &[Polygon], radius: f64) -> Self {
        let geometry = *map.caster.geometry();
        let middle = |cell: usize| geometry.center(cell % geometry.width, cell / geometry.width);
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(geometry.width, geometry.height, |cell| {
            let middle = middle(cell);
            map.caster.is_occupied(middle.x, middle.y)
        });
        let least = radius / geometry.resolution;
        let is_clear = |(cell, square): (usize, &i64)| {
            let middle = Point::new(middle(cell).x, middle(cell).y);
            *square as f64 > least * least && bodies.iter().all(|body| !is_near(body, middle, radius))
        };
        let is_free = squares.iter().enumerate().map(is_clear).collect();
        Self { geometry, is_free }
    }

    /// Searches the cells of a path on the 8-connected grid.
    fn search(&self, start: usize, goal: usize) -> Option<Vec<usize>> {
        let mut before = vec![usize::MAX; self.is_free.len()];
        let mut costs = vec![u32::MAX; self.is_free.len()];
        let mut open = BinaryHeap::from([Reverse((0, start))]);
        costs[start] = 0;
        while let Some(Reverse((cost, cell))) = open.pop() {
            if cell == goal {
                let path = std::iter::successors(Some(goal), |cell| {
                    Some(before[*cell]).filter(|before| *before != usize::MAX)
                });
                let mut path: Vec<usize> = path.collect();
                path.reverse();
                return Some(path);
            }
            if cost > costs[cell] {
                continue;
            }
            for (neighbor, length) in self.neighbors(cell) {
                let other = cost + length;
                if (self.is_free[neighbor] || neighbor == goal) && other < costs[neighbor] {
                    (costs[neighbor], before[neighbor]) = (other, cell);
                    open.push(Reverse((other, neighbor)));
                }
            }
        }
        None
    }

    /// Returns the neighbors of a cell, with their distances in 1/1000 cells.
    fn neighbors(&self, cell: usize) -> impl Iterator<Item = (usize, u32)> {
        let Geometry { width, height, .. } = self.geometry;
        let (column, row) = ((cell % width) as i64, (cell / width) as i64);
        (0..9).filter(|side| *side != 4).filter_map(move |side| {
            let (right, up) = (side % 3 - 1, side / 3 - 1);
            let (column, row) = (column + right, row + up);
            let is_inside = (0..width as i64).contains(&column) && (0..height as i64).contains(&row);
            let length = if right != 0 && up != 0 { 1_414 } else { 1_000 };
            is_inside.then(|| (row as usize * width + column as usize, length))
        })
    }

    /// Returns the length of the path after line-of-sight smoothing.
    fn pulled(&self, cells: &[usize], from: Point, to: Point) -> f64 {
        let middle = |cell: usize| {
            let middle = self.geometry.center(cell % self.geometry.width, cell / self.geometry.width);
            Point::new(middle.x, middle.y)
        };
        let point = |at: usize| match at {
            0 => from,
            at if at + 1 >= cells.len() => to,
            at => middle(cells[at]),
        };
        let (mut at, mut length) = (0, 0.0);
        while at + 1 < cells.len() {
            let mut next = at + 1;
            // The farthest point in sight, or nearly: those behind a hidden one may be in sight again.
            for far in (at + 2)..cells.len() {
                if self.is_straight(point(at), point(far)) {
                    next = far;
                }
            }
            length += point(next).minus(point(at)).norm();
            at = next;
        }
        length
    }

    fn is_straight(&self, from: Point, to: Point) -> bool {
        let place = |point: Point| self.geometry.place(point.x, point.y);
        LineCells::new(place(from), place(to)).all(|(column, row)| {
            let cell = usize::try_from(column).ok().zip(usize::try_from(row).ok());
            cell.is_some_and(|(column, row)| {
                let is_inside = column < self.geometry.width && row < self.geometry.height;
                is_inside && self.is_free[self.geometry.index(column, row)]
            })
        })
    }
}

fn is_near(body: &Polygon, point: Point, radius: f64) -> bool {
    body.contains(point) || body.edges().any(|(a, b)| nearest_on(a, b, point).minus(point).norm() < radius)
}

//! Walls of a world from an occupancy grid.

use std::path::Path;
use std::sync::Arc;

use slate_grid::{Geometry, OccupancyMap, RayCaster};
use slate_map_file::read_map;
use slate_module::math::{cos, sin};

use crate::error::DescriptionError;
use crate::geometry::Point;
use crate::scenery::Scenery;
use crate::wall_map::WorldMap;
use crate::world::{Body, Bounds, World};

/// Occupancy threshold of a wall, %.
const WALL: i8 = 50;
/// Largest number of walls of a world.
const MOST_WALLS: usize = 20_000;

impl World {
    /// Reads the world of a `map.yaml`, as ROS has it: occupied cells are walls.
    pub(crate) fn read_map(name: &str) -> Result<Self, DescriptionError> {
        let map =
            read_map(Path::new(name)).map_err(|error| DescriptionError::new(name, error.to_string()))?;
        Self::from_map(name, &map)
    }

    /// Creates the world of an occupancy grid, whose occupied cells are walls.
    ///
    /// # Errors
    /// It has more walls than a world can have.
    pub fn from_map(name: &str, map: &OccupancyMap) -> Result<Self, DescriptionError> {
        let is_wall = |cell: usize| map.cells[cell] >= WALL;
        let walls = rectangles(&map.geometry, is_wall);
        if walls.len() > MOST_WALLS {
            let message = format!(
                "its occupied cells make {} rectangles: expected at most {MOST_WALLS}; make the cells larger, or remove \
                 noise from the map",
                walls.len()
            );
            return Err(DescriptionError::new(name, message));
        }
        let bodies: Vec<Body> =
            walls.iter().enumerate().map(|(number, wall)| wall.body(number, &map.geometry)).collect();
        let map = WorldMap { walls: bodies.len(), caster: RayCaster::new(map.geometry, is_wall) };
        Ok(Self {
            name: name.into(),
            bounds: bounds(map.caster.geometry()),
            bodies,
            scenery: Scenery::default(),
            map: Some(Arc::new(map)),
        })
    }
}

/// Returns the bounding rectangle of a map.
fn bounds(geometry: &Geometry) -> Bounds {
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, up)| {
        let side = |cells: usize, share: usize| (cells * share) as f64 * geometry.resolution;
        corner(geometry, side(geometry.width, right), side(geometry.height, up))
    });
    let least =
        |part: fn(&Point) -> f64| corners.iter().map(part).fold(f64::INFINITY, slate_module::math::min);
    let most =
        |part: fn(&Point) -> f64| corners.iter().map(part).fold(f64::NEG_INFINITY, slate_module::math::max);
    Bounds {
        minimum: [least(|corner| corner.x), least(|corner| corner.y)],
        maximum: [most(|corner| corner.x), most(|corner| corner.y)],
    }
}

/// Returns a point of a map by its offsets from the first cell's corner, m.
/// The offsets are along the map's axes.
fn corner(geometry: &Geometry, right: f64, up: f64) -> Point {
    let origin = geometry.origin();
    let (sine, cosine) = (sin(origin.theta), cos(origin.theta));
    Point::new(origin.x + right * cosine - up * sine, origin.y + right * sine + up * cosine)
}

/// Occupied cells of one wall: half-open ranges of columns and rows.
struct Wall {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Wall {
    fn body(&self, number: usize, geometry: &Geometry) -> Body {
        let middle = |(from, to): (usize, usize)| 0.5 * (from + to) as f64 * geometry.resolution;
        let length = |(from, to): (usize, usize)| (to - from) as f64 * geometry.resolution;
        let center = corner(geometry, middle(self.columns), middle(self.rows));
        let size = [length(self.columns), length(self.rows)];
        let theta = geometry.origin().theta;
        Body { theta, ..Body::rectangle(&format!("wall_{number}"), [center.x, center.y], size) }
    }
}

/// Covers occupied cells with rectangles.
/// Each is first as wide, then as high as possible.
fn rectangles(geometry: &Geometry, is_wall: impl Fn(usize) -> bool) -> Vec<Wall> {
    let mut covered = vec![false; geometry.cells()];
    let mut walls = Vec::new();
    for row in 0..geometry.height {
        for column in 0..geometry.width {
            let is_open = |column: usize, row: usize, covered: &[bool]| {
                let cell = geometry.index(column, row);
                is_wall(cell) && !covered[cell]
            };
            if !is_open(column, row, &covered) {
                continue;
            }
            let right = (column..geometry.width).find(|column| !is_open(*column, row, &covered));
            let right = right.unwrap_or(geometry.width);
            let is_full = |row: usize| (column..right).all(|column| is_open(column, row, &covered));
            let top = (row..geometry.height).find(|row| !is_full(*row)).unwrap_or(geometry.height);
            // A thin line upwards is not cut where it crosses one to the right.
            let is_column = |row: usize| is_open(column, row, &covered);
            let high = (row..geometry.height).find(|row| !is_column(*row)).unwrap_or(geometry.height);
            let (right, top) = if high - row > right - column { (column + 1, high) } else { (right, top) };
            for row in row..top {
                covered[geometry.index(column, row)..geometry.index(right - 1, row) + 1].fill(true);
            }
            walls.push(Wall { columns: (column, right), rows: (row, top) });
        }
    }
    walls
}

//! Grids in the plane: where their cells are ([`Geometry`]), which of them a line crosses ([`LineCells`]), how far each is
//! from the nearest occupied one ([`DistanceTransform`]), how far a ray goes to one ([`RayCaster`]), and what is in them
//! ([`OccupancyMap`]).

mod distance;
mod geometry;
mod line_cells;
mod occupancy_map;
mod ray_caster;

pub use distance::DistanceTransform;
pub use geometry::Geometry;
pub use line_cells::LineCells;
pub use occupancy_map::{OccupancyMap, UNKNOWN_CELL};
pub use ray_caster::RayCaster;

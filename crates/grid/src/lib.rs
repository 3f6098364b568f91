//! Grids in the plane.
//! Geometry of the cells ([`Geometry`]), cells on a line ([`LineCells`]), distance to the nearest occupied cell
//! ([`DistanceTransform`]), range of a ray to one ([`RayCaster`]), and occupancy ([`OccupancyMap`]).

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

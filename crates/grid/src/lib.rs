//! Grids in the plane: where their cells are ([`Geometry`]), which of them a line crosses ([`LineCells`]), and how far
//! each is from the nearest occupied one ([`DistanceTransform`]).

mod distance;
mod geometry;
mod line_cells;

pub use distance::DistanceTransform;
pub use geometry::Geometry;
pub use line_cells::LineCells;

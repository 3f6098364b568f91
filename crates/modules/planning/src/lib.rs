//! Global planning on grids.
//! Cheapest paths of eight neighbors ([`AStar`]) or of any angle ([`ThetaStar`]), one that is repaired while the robot
//! discovers obstacles ([`DStarLite`]), and paths of a car-like robot ([`HybridAStar`]).
//!
//! All but the last search a [`CostGrid`], whose costs are those of Nav2's costmaps; a [`Costmap`] makes one of its layers.
//! Buffers are kept from search to search.
//!
//! ```
//! use slate_planning::{AStar, GridCell, CostGrid, LETHAL};
//!
//! // A wall with a gap at its right end.
//! let grid = CostGrid::new(4, 3, |cell| if cell.row == 1 && cell.column < 3 { LETHAL } else { 0 }).unwrap();
//! let mut planner = AStar::default();
//! let path = planner.search(&grid, GridCell::new(0, 0), GridCell::new(0, 2)).unwrap();
//! assert_eq!(path.cost(), 8.0);
//! assert_eq!(path.cells().len(), 9);
//! ```

mod a_star;
mod bucket_queue;
mod cost_field;
mod cost_grid;
mod costmap;
mod d_star_lite;
mod dubins;
mod footprint_grid;
mod grid_path;
mod hybrid_a_star;
mod indexed_heap;
mod line;
mod neighbors;
mod reeds_shepp;
mod steering_path;
mod theta_star;

pub use a_star::AStar;
pub use cost_field::CostField;
pub use cost_grid::{CostGrid, GridCell, GridSizeError, INSCRIBED, LETHAL, MOST_CELLS, UNKNOWN};
pub use costmap::{Costmap, Inflation};
pub use d_star_lite::DStarLite;
pub use dubins::dubins;
pub use footprint_grid::FootprintGrid;
pub use grid_path::GridPath;
pub use hybrid_a_star::{DriveModel, DrivenPose, HybridAStar, HybridAStarParameters, HybridSearchError};
pub use line::line_cost;
pub use reeds_shepp::reeds_shepp;
pub use slate_module::InvalidParameter;
pub use steering_path::{SteeringPath, SteeringPosition, SteeringSegment};
pub use theta_star::ThetaStar;

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/34-planning.md")]
mod book {}

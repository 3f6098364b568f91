//! Map whose occupied cells are the walls of a world.

use slate_grid::RayCaster;

/// Occupied cells of a map, for the rays of laser scanners. The same walls are also bodies of the world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldMap {
    pub(crate) caster: RayCaster,
    /// The first bodies of the world are its walls: so many.
    pub(crate) walls: usize,
}

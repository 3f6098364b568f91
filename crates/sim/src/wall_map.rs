//! Map whose occupied cells are the walls of a world.

use slate_grid::RayCaster;

/// Occupied cells of a map, for ray casting of laser scanners.
/// The same walls are also bodies of the world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldMap {
    pub(crate) caster: RayCaster,
    /// Number of walls, which are the first bodies of the world.
    pub(crate) walls: usize,
}

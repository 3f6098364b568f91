//! Grids of the submaps that were searched last.

use crate::max_grids::MaxGrids;
use crate::surface_map::SurfaceMap;

/// Levels of the search of loops: squares of up to 64 cells.
const LEVELS: usize = 7;
/// Cells of the grids that are kept, a byte each.
const MOST_CELLS: usize = 1 << 27;

/// Cache of grids for the search of loops, made on use.
/// Those used least recently are dropped when memory is short.
#[derive(Clone, Debug, Default)]
pub(crate) struct SearchGrids {
    /// Submaps with their grids, that used last at the end.
    kept: Vec<(usize, MaxGrids)>,
}

impl SearchGrids {
    /// Returns the grids of a submap, whose map no longer changes.
    pub fn of(&mut self, submap: usize, map: &SurfaceMap) -> &MaxGrids {
        self.within(MOST_CELLS, submap, map)
    }

    fn within(&mut self, most: usize, submap: usize, map: &SurfaceMap) -> &MaxGrids {
        let used = match self.kept.iter().position(|(kept, _)| *kept == submap) {
            Some(at) => self.kept.remove(at),
            None => (submap, MaxGrids::new(map, None, LEVELS)),
        };
        self.kept.push(used);
        let mut cells: usize = self.kept.iter().map(|(_, grids)| grids.cells()).sum();
        while cells > most && self.kept.len() > 1 {
            cells -= self.kept.remove(0).1.cells();
        }
        &self.kept[self.kept.len() - 1].1
    }
}

/// All are equal, as grids follow from the submaps.
impl PartialEq for SearchGrids {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_used_least_recently_leave_first() {
        let mut map = SurfaceMap::new(0.1);
        map.insert([[0.0, 0.0], [1.0, 1.0]].into_iter());
        let cells = MaxGrids::new(&map, None, LEVELS).cells();
        let mut grids = SearchGrids::default();
        for submap in [0, 1, 2, 0, 3, 0, 4] {
            grids.within(3 * cells, submap, &map);
        }
        let kept: Vec<usize> = grids.kept.iter().map(|(submap, _)| *submap).collect();
        assert_eq!(kept, [3, 0, 4]);
        grids.within(1, 5, &map);
        assert_eq!(grids.kept.len(), 1);
    }
}

//! Map of surfaces: cells with the mean of the points in them.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Cells along the side of a tile, a power of two.
const SIDE: i32 = 16;
/// Points from which on a new one moves the mean of its cell no less.
const MOST_HITS: f32 = 64.0;
/// Tiles beyond which a map does not grow: points that are farther away are errors.
const MOST_TILES: i64 = 1 << 22;

/// Surface map: points of scans in cells, each with the mean of its points.
/// Cells are in tiles that copies of the map share until one changes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SurfaceMap {
    /// Edge length of a cell, m.
    resolution: f64,
    /// Column and row of the first tile.
    low: [i32; 2],
    /// Number of tiles along x and y.
    size: [i32; 2],
    tiles: Vec<Option<Tile>>,
}

/// Mean of the points in a cell, m, and their number; no point if that is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SurfaceCell {
    pub x: f32,
    pub y: f32,
    pub hits: f32,
}

#[derive(Clone, Debug, PartialEq)]
struct Tile(Arc<[SurfaceCell; (SIDE * SIDE) as usize]>);

/// Serializes a tile once for each map that shares it.
/// A restored map is equal, and takes more memory.
impl Serialize for Tile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.as_slice().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Tile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let cells = Vec::<SurfaceCell>::deserialize(deserializer)?;
        let cells = cells.try_into().map_err(|_| serde::de::Error::custom("expected 256 cells of a tile"))?;
        Ok(Self(Arc::new(cells)))
    }
}

impl SurfaceMap {
    pub fn new(resolution: f64) -> Self {
        Self { resolution, low: [0; 2], size: [0; 2], tiles: Vec::new() }
    }

    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Returns the column and row of a point.
    pub fn place(&self, [x, y]: [f64; 2]) -> [i32; 2] {
        [(x / self.resolution).floor() as i32, (y / self.resolution).floor() as i32]
    }

    /// Inserts points of the map's frame.
    pub fn insert(&mut self, points: impl Iterator<Item = [f64; 2]>) {
        for point in points {
            let [column, row] = self.place(point);
            let Some(at) = self.grow_to([column.div_euclid(SIDE), row.div_euclid(SIDE)]) else { continue };
            let tile = self.tiles[at]
                .get_or_insert_with(|| Tile(Arc::new(std::array::from_fn(|_| SurfaceCell::default()))));
            let index = (row.rem_euclid(SIDE) * SIDE + column.rem_euclid(SIDE)) as usize;
            let cell = &mut Arc::make_mut(&mut tile.0)[index];
            if cell.hits < MOST_HITS {
                cell.hits += 1.0;
            }
            cell.x += (point[0] as f32 - cell.x) / cell.hits;
            cell.y += (point[1] as f32 - cell.y) / cell.hits;
        }
    }

    /// Returns the index of a tile, after growing the map to hold it.
    /// `None` if it is too far away.
    fn grow_to(&mut self, tile: [i32; 2]) -> Option<usize> {
        if let Some(at) = self.index(tile) {
            return Some(at);
        }
        let is_empty = self.tiles.is_empty();
        let low = [0, 1].map(|axis| if is_empty { tile[axis] } else { self.low[axis].min(tile[axis]) });
        let end = [0, 1].map(|axis| {
            let end = i64::from(self.low[axis]) + i64::from(self.size[axis]);
            if is_empty { i64::from(tile[axis]) + 1 } else { end.max(i64::from(tile[axis]) + 1) }
        });
        let size = [0, 1].map(|axis| end[axis] - i64::from(low[axis]));
        if size[0].saturating_mul(size[1]) > MOST_TILES {
            return None;
        }
        let mut tiles = vec![None; (size[0] * size[1]) as usize];
        for row in 0..self.size[1] {
            for column in 0..self.size[0] {
                let [right, up] = [column + self.low[0] - low[0], row + self.low[1] - low[1]];
                let from = (row * self.size[0] + column) as usize;
                tiles[i64::from(up) as usize * size[0] as usize + right as usize] = self.tiles[from].take();
            }
        }
        *self = Self { resolution: self.resolution, low, size: size.map(|size| size as i32), tiles };
        self.index(tile)
    }

    fn index(&self, [column, row]: [i32; 2]) -> Option<usize> {
        let (right, up) = (column.wrapping_sub(self.low[0]), row.wrapping_sub(self.low[1]));
        let is_inside = right >= 0 && up >= 0 && right < self.size[0] && up < self.size[1];
        is_inside.then(|| up as usize * self.size[0] as usize + right as usize)
    }

    /// Calls `visit` with each cell that has points in a range, ends included.
    /// The range is one of columns and rows.
    #[inline]
    pub fn for_each_near(&self, low: [i32; 2], high: [i32; 2], mut visit: impl FnMut(&SurfaceCell)) {
        let tiles = |axis: usize| low[axis].div_euclid(SIDE)..=high[axis].div_euclid(SIDE);
        for tile_row in tiles(1) {
            for tile_column in tiles(0) {
                let Some(Some(tile)) = self.index([tile_column, tile_row]).map(|at| &self.tiles[at]) else {
                    continue;
                };
                let (left, bottom) = (tile_column * SIDE, tile_row * SIDE);
                let columns = (low[0] - left).max(0) as usize..=(high[0] - left).min(SIDE - 1) as usize;
                for row in (low[1] - bottom).max(0)..=(high[1] - bottom).min(SIDE - 1) {
                    let start = (row * SIDE) as usize;
                    for cell in &tile.0[start + columns.start()..=start + columns.end()] {
                        if cell.hits > 0.0 {
                            visit(cell);
                        }
                    }
                }
            }
        }
    }

    /// Iterates over the cells that have points, with column and row.
    pub fn cells(&self) -> impl Iterator<Item = ([i32; 2], &SurfaceCell)> {
        let place = |at: usize| {
            let at = at as i32;
            [self.low[0] + at % self.size[0], self.low[1] + at / self.size[0]]
        };
        let tiles = self.tiles.iter().enumerate().filter_map(|(at, tile)| Some((at, tile.as_ref()?)));
        tiles.flat_map(move |(at, tile)| {
            let [column, row] = place(at);
            (0..)
                .zip(tile.0.iter())
                .filter(|(_, cell)| cell.hits > 0.0)
                .map(move |(index, cell)| ([column * SIDE + index % SIDE, row * SIDE + index / SIDE], cell))
        })
    }
}

#[cfg(test)]
mod tests {
    use slate_sorted::SortedMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn cells_hold_the_means_of_their_points(
            points in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64).prop_map(|(x, y)| [x, y]), 1..40),
        ) {
            let mut map = SurfaceMap::new(0.5);
            map.insert(points.iter().copied());
            let mut wanted: SortedMap<[i32; 2], Vec<[f64; 2]>> = SortedMap::new();
            points.iter().for_each(|point| wanted.entry(map.place(*point)).or_default().push(*point));
            let found: SortedMap<_, _> = map.cells().collect();
            prop_assert_eq!(found.len(), wanted.len());
            for (place, points) in &wanted {
                let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
                let cell = found[place];
                prop_assert!((f64::from(cell.x) - mean(0)).abs() < 1e-4 && (f64::from(cell.y) - mean(1)).abs() < 1e-4);
                prop_assert_eq!(cell.hits, points.len() as f32);
            }
            let mut near = 0;
            map.for_each_near([-3, -20], [4, 20], |_| near += 1);
            let wanted = wanted.keys().filter(|[column, row]| (-3..=4).contains(column) && (-20..=20).contains(row));
            prop_assert_eq!(near, wanted.count());
        }

        #[test]
        fn copies_share_no_change(points in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 1..20)) {
            let mut map = SurfaceMap::new(0.1);
            map.insert([[0.0, 0.0]].into_iter());
            let before = map.clone();
            let mut copy = map.clone();
            copy.insert(points.iter().map(|(x, y)| [*x, *y]));
            prop_assert_eq!(map, before);
        }
    }
}

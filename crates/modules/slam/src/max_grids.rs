//! Likelihood grid of a map with maxima over growing squares.

use crate::surface_map::SurfaceMap;

/// Likelihood grids of points near surfaces, by level for branch and bound.
/// Level k has the maximum over squares of 2^k cells (Hess, Kohler, Rapp and Andor, 2016, *Real-time loop closure in 2D
/// LIDAR SLAM*, section V-B).
#[derive(Clone, Debug)]
pub(crate) struct MaxGrids {
    /// Column and row of the first cell.
    low: [i32; 2],
    size: [usize; 2],
    /// Likelihoods from 0 to 255 by level.
    /// That of a cell is the maximum over the square of which it is the lower left.
    levels: Vec<Vec<u8>>,
}

/// Reach of the kernel, cells.
const KERNEL_RADIUS: i32 = 3;
/// Likelihood beside a surface by the squared distance in cells.
/// A normal distribution of standard deviation 1.2 cells.
const KERNEL: [u8; 10] = [255, 180, 127, 0, 64, 45, 0, 0, 16, 11];

impl MaxGrids {
    /// Computes the grids of a map within a range of columns and rows.
    /// `levels` is their number, at least 1.
    pub fn new(map: &SurfaceMap, bounds: Option<[[i32; 2]; 2]>, levels: usize) -> Self {
        let mut places: Vec<[i32; 2]> = map.cells().map(|(place, _)| place).collect();
        if let Some([low, high]) = bounds {
            places.retain(|place| (0..2).all(|axis| (low[axis]..=high[axis]).contains(&place[axis])));
        }
        let extreme = |axis: usize| {
            let along = places.iter().map(|place| place[axis]);
            (along.clone().min().unwrap_or(0), along.max().unwrap_or(0))
        };
        // A square at the border reaches out of the grid on one side.
        let margin = 1 << levels.saturating_sub(1);
        let axis = |axis: usize| {
            let (least, most) = extreme(axis);
            (least - KERNEL_RADIUS - margin, (most - least + 2 * KERNEL_RADIUS + margin + 1) as usize)
        };
        let ((left, width), (bottom, height)) = (axis(0), axis(1));
        let mut grids =
            Self { low: [left, bottom], size: [width, height], levels: vec![vec![0; width * height]] };
        places.iter().for_each(|place| grids.stamp(*place));
        for level in 1..levels {
            grids.push_level(1 << (level - 1));
        }
        grids
    }

    fn stamp(&mut self, [column, row]: [i32; 2]) {
        for up in -KERNEL_RADIUS..=KERNEL_RADIUS {
            let y = (row + up - self.low[1]) as usize;
            for right in -KERNEL_RADIUS..=KERNEL_RADIUS {
                let Some(value) = KERNEL.get((right * right + up * up) as usize) else { continue };
                let x = (column + right - self.low[0]) as usize;
                let cell = &mut self.levels[0][y * self.size[0] + x];
                *cell = (*cell).max(*value);
            }
        }
    }

    /// Adds the level whose squares are of twice `half` cells.
    fn push_level(&mut self, half: usize) {
        let [width, height] = self.size;
        let Some(below) = self.levels.last() else { return };
        // Along rows, then along columns.
        let mut wide = below.clone();
        for row in 0..height {
            let (to, from) =
                (&mut wide[row * width..(row + 1) * width], &below[row * width..(row + 1) * width]);
            for (to, from) in to.iter_mut().zip(from.iter().skip(half)) {
                *to = (*to).max(*from);
            }
        }
        let mut level = wide.clone();
        for (to, from) in level.iter_mut().zip(wide.iter().skip(half * width)) {
            *to = (*to).max(*from);
        }
        self.levels.push(level);
    }

    /// Returns the number of cells of all levels.
    pub fn cells(&self) -> usize {
        self.levels.iter().map(Vec::len).sum()
    }

    /// Returns the number of levels.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Returns the sum of likelihoods of cells, moved by columns and rows, at a level.
    pub fn sum(&self, level: usize, cells: &[[i32; 2]], [right, up]: [i32; 2]) -> u32 {
        let [width, height] = self.size;
        let (right, up) = (right.wrapping_sub(self.low[0]), up.wrapping_sub(self.low[1]));
        let grid = &self.levels[level];
        let mut sum = 0;
        for [column, row] in cells {
            let (x, y) = (column.wrapping_add(right) as u32 as usize, row.wrapping_add(up) as u32 as usize);
            if x < width && y < height {
                sum += u32::from(grid[y * width + x]);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_cell_of_a_square_is_likelier_than_the_square(
            points in prop::collection::vec((-2.0..2.0_f64, -2.0..2.0_f64), 1..20), level in 1..4_usize,
            column in -40..40_i32, row in -40..40_i32,
        ) {
            let mut map = SurfaceMap::new(0.1);
            map.insert(points.iter().map(|(x, y)| [*x, *y]));
            let grids = MaxGrids::new(&map, None, 4);
            let side = 1 << level;
            let most = (0..side * side).map(|at| grids.sum(0, &[[column + at % side, row + at / side]], [0, 0])).max();
            prop_assert_eq!(Some(grids.sum(level, &[[column, row]], [0, 0])), most);
        }
    }
}

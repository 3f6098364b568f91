//! Euclidean distance transform of a grid.

/// Buffers of the transform, reused so that it allocates only once.
#[derive(Clone, Debug, Default)]
pub struct DistanceTransform {
    /// Distance along the column.
    up: Vec<i64>,
    /// Squared distances, cells².
    squares: Vec<i64>,
    /// Lower envelope of a row: columns, and where their parts begin.
    nearest: Vec<(i64, i64)>,
}

impl DistanceTransform {
    /// Returns each cell's squared distance to the nearest occupied one, cells².
    /// It is larger than the grid without any.
    ///
    /// Linear in the number of cells (Meijster, Roerdink and Hesselink, 2000, *A general algorithm for computing
    /// distance transforms in linear time*). Own code: the crates for it take images and allocate.
    pub fn squares(&mut self, width: usize, height: usize, is_occupied: impl Fn(usize) -> bool) -> &[i64] {
        let far = (width + height) as i64;
        self.up.clear();
        self.up.resize(width * height, far);
        self.squares.clear();
        self.squares.resize(width * height, 0);
        self.nearest.clear();
        self.nearest.reserve(width);
        for cell in 0..width * height {
            let below = if cell >= width { self.up[cell - width] } else { far };
            self.up[cell] = if is_occupied(cell) { 0 } else { far.min(below + 1) };
        }
        for cell in (0..width * height.saturating_sub(1)).rev() {
            self.up[cell] = self.up[cell].min(self.up[cell + width] + 1);
        }
        for row in 0..height {
            let up = &self.up[row * width..(row + 1) * width];
            let square = |at: i64, column: i64| {
                let up = up[column as usize];
                (at - column) * (at - column) + up * up
            };
            // First cell to which the right one of two columns is nearer.
            let border = |left: i64, right: i64| {
                (square(0, right) - square(0, left)).div_euclid(2 * (right - left)) + 1
            };
            self.nearest.clear();
            for column in 0..width as i64 {
                while let Some(&(last, from)) = self.nearest.last()
                    && square(from, last) > square(from, column)
                {
                    self.nearest.pop();
                }
                let from = self.nearest.last().map_or(0, |&(last, _)| border(last, column));
                if from < width as i64 {
                    self.nearest.push((column, from));
                }
            }
            for column in (0..width as i64).rev() {
                while self.nearest.len() > 1 && self.nearest.last().is_some_and(|&(_, from)| from > column) {
                    self.nearest.pop();
                }
                let own = self.nearest.last().map_or(column, |&(own, _)| own);
                self.squares[row * width + column as usize] = square(column, own);
            }
        }
        &self.squares
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn each_distance_is_that_to_the_nearest_occupied_cell(
            width in 1..14_usize, height in 1..14_usize,
            seeds in prop::collection::vec(prop::bool::weighted(0.1), 14 * 14),
        ) {
            let mut distances = DistanceTransform::default();
            let found = distances.squares(width, height, |cell| seeds[cell]).to_vec();
            let place = |cell: usize| ((cell % width) as i64, (cell / width) as i64);
            let occupied: Vec<_> = (0..width * height).filter(|cell| seeds[*cell]).map(place).collect();
            for (cell, square) in found.into_iter().enumerate() {
                let (column, row) = place(cell);
                let wanted = occupied.iter().map(|(x, y)| (x - column) * (x - column) + (y - row) * (y - row)).min();
                match wanted {
                    Some(wanted) => prop_assert_eq!(square, wanted),
                    None => prop_assert!(square >= ((width + height) * (width + height)) as i64),
                }
            }
        }
    }
}

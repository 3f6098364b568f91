//! Sparse Cholesky factorization of block matrices.

use nalgebra::{Matrix3, Vector3};
use slate_sorted::SortedSet;

/// Sparse Cholesky factorization of a symmetric matrix of 3 x 3 blocks.
/// One block for each pair of poses (George and Liu, 1981, *Computer solution of large sparse positive definite
/// systems*, chapter 5).
///
/// Own code: a pose graph's blocks make it short, and its result depends on no kernel that a library chooses for the
/// processor.
#[derive(Clone, Debug)]
pub(crate) struct BlockCholesky {
    /// Place of each pose in the order of elimination.
    place: Vec<usize>,
    /// Per column, the rows below the diagonal, ascending.
    rows: Vec<Vec<usize>>,
    diagonal: Vec<Matrix3<f64>>,
    /// Per column, a block for each of `rows`.
    below: Vec<Vec<Matrix3<f64>>>,
}

impl BlockCholesky {
    /// Orders the poses by minimum degree, and computes the fill-in.
    /// `pairs` are the pairs of poses with a block.
    pub fn new(poses: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut neighbors = vec![SortedSet::new(); poses];
        for (a, b) in pairs.filter(|(a, b)| a != b) {
            neighbors[a].insert(b);
            neighbors[b].insert(a);
        }
        let mut by_degree: SortedSet<(usize, usize)> =
            neighbors.iter().enumerate().map(|(pose, others)| (others.len(), pose)).collect();
        let (mut place, mut columns) = (vec![0; poses], Vec::with_capacity(poses));
        while let Some((_, pose)) = by_degree.pop_first() {
            place[pose] = columns.len();
            let others = std::mem::take(&mut neighbors[pose]);
            for other in &others {
                by_degree.remove(&(neighbors[*other].len(), *other));
                neighbors[*other].remove(&pose);
                neighbors[*other].extend(others.iter().filter(|another| *another != other));
                by_degree.insert((neighbors[*other].len(), *other));
            }
            columns.push(others);
        }
        let sorted = |others: &SortedSet<usize>| {
            let mut rows: Vec<usize> = others.iter().map(|other| place[*other]).collect();
            rows.sort_unstable();
            rows
        };
        let rows: Vec<Vec<usize>> = columns.iter().map(sorted).collect();
        let below = rows.iter().map(|rows| vec![Matrix3::zeros(); rows.len()]).collect();
        Self { place, diagonal: vec![Matrix3::zeros(); poses], rows, below }
    }

    /// Sets all blocks to zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(Matrix3::zeros());
        self.below.iter_mut().for_each(|column| column.fill(Matrix3::zeros()));
    }

    /// Adds to the block of a pose with itself.
    pub fn add_diagonal(&mut self, pose: usize, block: &Matrix3<f64>) {
        self.diagonal[self.place[pose]] += block;
    }

    /// Adds to the block of two different poses.
    /// Its transpose is added to that of the two exchanged.
    pub fn add_pair(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        let (row, column) = (self.place[row], self.place[column]);
        let (low, high, block) =
            if row > column { (column, row, *block) } else { (row, column, block.transpose()) };
        if let Ok(at) = self.rows[low].binary_search(&high) {
            self.below[low][at] += block;
        }
    }

    /// Scales the diagonal, as Levenberg and Marquardt do.
    pub fn damp(&mut self, factor: f64) {
        for block in &mut self.diagonal {
            for axis in 0..3 {
                block[(axis, axis)] *= 1.0 + factor;
            }
        }
    }

    /// Factorizes the matrix in place; `None` if it is not positive definite.
    pub fn factorize(&mut self) -> Option<()> {
        for column in 0..self.rows.len() {
            let root = root(&self.diagonal[column])?;
            self.diagonal[column] = root;
            let inverse = inverse_lower(&root).transpose();
            let mut blocks = std::mem::take(&mut self.below[column]);
            blocks.iter_mut().for_each(|block| *block *= inverse);
            let rows = std::mem::take(&mut self.rows[column]);
            for (at, row) in rows.iter().enumerate() {
                let transposed = blocks[at].transpose();
                self.diagonal[*row] -= blocks[at] * transposed;
                // Rows of this column below are rows of that one.
                let (target_rows, target) = (&self.rows[*row], &mut self.below[*row]);
                let mut place = 0;
                for (other, block) in rows[at + 1..].iter().zip(&blocks[at + 1..]) {
                    while target_rows[place] != *other {
                        place += 1;
                    }
                    target[place] -= block * transposed;
                }
            }
            self.rows[column] = rows;
            self.below[column] = blocks;
        }
        Some(())
    }

    /// Solves for a right-hand side per pose, in place.
    /// It follows [`factorize`](Self::factorize).
    pub fn solve(&self, sides: &mut [Vector3<f64>]) {
        let mut ordered = vec![Vector3::zeros(); sides.len()];
        for (pose, side) in sides.iter().enumerate() {
            ordered[self.place[pose]] = *side;
        }
        for column in 0..ordered.len() {
            let value = inverse_lower(&self.diagonal[column]) * ordered[column];
            ordered[column] = value;
            for (row, block) in self.rows[column].iter().zip(&self.below[column]) {
                ordered[*row] -= block * value;
            }
        }
        for column in (0..ordered.len()).rev() {
            let mut value = ordered[column];
            for (row, block) in self.rows[column].iter().zip(&self.below[column]) {
                value -= block.transpose() * ordered[*row];
            }
            ordered[column] = inverse_lower(&self.diagonal[column]).transpose() * value;
        }
        for (pose, side) in sides.iter_mut().enumerate() {
            *side = ordered[self.place[pose]];
        }
    }
}

/// Returns the lower Cholesky factor of a block.
fn root(block: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut root = Matrix3::zeros();
    for column in 0..3 {
        for row in column..3 {
            let mut rest = block[(row, column)];
            for before in 0..column {
                rest -= root[(row, before)] * root[(column, before)];
            }
            root[(row, column)] = if row > column {
                rest / root[(column, column)]
            } else if rest > 0.0 {
                rest.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(root)
}

/// Inverse of a lower triangular block.
fn inverse_lower(lower: &Matrix3<f64>) -> Matrix3<f64> {
    let (a, b, c) = (1.0 / lower[(0, 0)], 1.0 / lower[(1, 1)], 1.0 / lower[(2, 2)]);
    let first = -lower[(1, 0)] * a * b;
    let third = -lower[(2, 1)] * b * c;
    let second = -(lower[(2, 0)] * a + lower[(2, 1)] * first) * c;
    Matrix3::new(a, 0.0, 0.0, first, b, 0.0, second, third, c)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn solutions_solve_their_systems(
            poses in 1..12_usize,
            pairs in prop::collection::vec((0..12_usize, 0..12_usize, prop::collection::vec(-1.0..1.0_f64, 9)), 0..30),
            side in prop::collection::vec(-5.0..5.0_f64, 36),
        ) {
            let pairs: Vec<_> = pairs.into_iter().filter(|(a, b, _)| a != b && *a < poses && *b < poses).collect();
            let mut matrix = BlockCholesky::new(poses, pairs.iter().map(|(a, b, _)| (*a, *b)));
            let mut dense = vec![vec![Matrix3::zeros(); poses]; poses];
            for (a, b, block) in &pairs {
                let block = Matrix3::from_row_slice(block);
                matrix.add_pair(*a, *b, &block);
                dense[*a][*b] += block;
                dense[*b][*a] += block.transpose();
            }
            // Dominant, so positive definite.
            let large = Matrix3::identity() * 200.0;
            for (pose, row) in dense.iter_mut().enumerate() {
                matrix.add_diagonal(pose, &large);
                row[pose] += large;
            }
            let sides: Vec<_> = side.chunks_exact(3).take(poses).map(Vector3::from_column_slice).collect();
            let mut found = sides.clone();
            matrix.factorize().unwrap();
            matrix.solve(&mut found);
            for (row, side) in sides.iter().enumerate() {
                let product = (0..poses).map(|column| dense[row][column] * found[column]).sum::<Vector3<f64>>();
                prop_assert!((product - side).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn indefinite_matrix_is_refused() {
        let mut matrix = BlockCholesky::new(2, [(0, 1)].into_iter());
        matrix.add_diagonal(0, &Matrix3::identity());
        matrix.add_diagonal(1, &Matrix3::identity());
        matrix.add_pair(0, 1, &(Matrix3::identity() * 2.0));
        assert!(matrix.factorize().is_none());
    }
}

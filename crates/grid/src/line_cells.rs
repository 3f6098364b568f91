//! Cells along a line.

/// Iterator over the cells that a line segment crosses.
/// Items are column and row, also outside of a grid (Amanatides and Woo, 1987).
pub struct LineCells {
    cell: (i64, i64),
    step: (i64, i64),
    /// Fraction of the segment at which it leaves the current column and row.
    next: (f64, f64),
    /// Fraction of the segment per column and per row.
    share: (f64, f64),
    left: i64,
}

impl LineCells {
    /// Returns the line between two points, in cells.
    /// They must be finite and no farther apart than a grid is large.
    pub fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        let axis = |from: f64, to: f64| {
            let (first, last) = (from.floor(), to.floor());
            let length = to - from;
            let step = if length < 0.0 { -1 } else { 1 };
            let border = if length < 0.0 { first } else { first + 1.0 };
            let (next, share) = match length == 0.0 {
                true => (f64::INFINITY, f64::INFINITY),
                false => ((border - from) / length, (1.0 / length).abs()),
            };
            (first as i64, step, next, share, (last - first).abs() as i64)
        };
        let (column, right, next_column, column_share, columns) = axis(from.0, to.0);
        let (row, up, next_row, row_share, rows) = axis(from.1, to.1);
        Self {
            cell: (column, row),
            step: (right, up),
            next: (next_column, next_row),
            share: (column_share, row_share),
            left: columns + rows + 1,
        }
    }
}

impl Iterator for LineCells {
    type Item = (i64, i64);

    fn next(&mut self) -> Option<(i64, i64)> {
        if self.left == 0 {
            return None;
        }
        self.left -= 1;
        let cell = self.cell;
        if self.left == 0 {
            // Behind the end a cell may have no number any more.
        } else if self.next.0 < self.next.1 {
            self.cell.0 += self.step.0;
            self.next.0 += self.share.0;
        } else {
            self.cell.1 += self.step.1;
            self.next.1 += self.share.1;
        }
        Some(cell)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_line_crosses_neighboring_cells_up_to_its_end(
            ax in -50.0..50.0_f64, ay in -50.0..50.0_f64, bx in -50.0..50.0_f64, by in -50.0..50.0_f64,
        ) {
            let cells: Vec<_> = LineCells::new((ax, ay), (bx, by)).collect();
            let of = |x: f64, y: f64| (x.floor() as i64, y.floor() as i64);
            prop_assert_eq!(cells[0], of(ax, ay));
            prop_assert_eq!(*cells.last().unwrap(), of(bx, by));
            for pair in cells.windows(2) {
                prop_assert_eq!((pair[0].0 - pair[1].0).abs() + (pair[0].1 - pair[1].1).abs(), 1);
            }
        }
    }
}

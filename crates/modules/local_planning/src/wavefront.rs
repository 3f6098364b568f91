//! Wavefronts on a grid.

/// Wavefront: steps from a set of cells to each cell of a grid.
/// Four neighbors, round obstacles (NF1: Latombe, 1991, *Robot Motion Planning*, section 7.2).
#[derive(Clone, Debug, Default)]
pub(crate) struct GridWavefront {
    /// Steps to each cell; [`u32::MAX`] where no step leads.
    steps: Vec<u32>,
    front: Vec<u32>,
}

impl GridWavefront {
    /// Resets the wave on a square grid.
    pub fn clear(&mut self, side: usize) {
        self.steps.clear();
        self.steps.resize(side * side, u32::MAX);
        self.front.clear();
    }

    /// Adds a cell from which the wave starts.
    pub fn seed(&mut self, cell: usize) {
        if self.steps[cell] != 0 {
            self.steps[cell] = 0;
            self.front.push(cell as u32);
        }
    }

    /// Runs the wave through all cells that are free.
    pub fn run(&mut self, side: usize, is_free: impl Fn(usize) -> bool) {
        let mut at = 0;
        while let Some(cell) = self.front.get(at).map(|cell| *cell as usize) {
            at += 1;
            let steps = self.steps[cell] + 1;
            let (column, row) = (cell % side, cell / side);
            let mut visit = |next: usize| {
                if self.steps[next] == u32::MAX && is_free(next) {
                    self.steps[next] = steps;
                    self.front.push(next as u32);
                }
            };
            if column > 0 {
                visit(cell - 1);
            }
            if column + 1 < side {
                visit(cell + 1);
            }
            if row > 0 {
                visit(cell - side);
            }
            if row + 1 < side {
                visit(cell + side);
            }
        }
    }

    /// Returns the steps to a cell, if any lead there.
    pub fn steps(&self, cell: usize) -> Option<u32> {
        self.steps.get(cell).copied().filter(|steps| *steps != u32::MAX)
    }
}

//! Costs of cells.

/// Cost from which the robot's middle can't be in a cell: an obstacle is within its inscribed circle.
pub const INSCRIBED: u8 = 253;
/// Cost of an obstacle's cell.
pub const LETHAL: u8 = 254;
/// Cost of a cell that nobody has seen.
pub const UNKNOWN: u8 = 255;

/// A cell of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct GridCell {
    /// From the left, along x.
    pub column: u32,
    /// From below, along y.
    pub row: u32,
}

impl GridCell {
    /// The cell there.
    pub const fn new(column: u32, row: u32) -> Self {
        Self { column, row }
    }
}

/// Costs of a grid's cells as searches read them, 0 to [`UNKNOWN`].
///
/// A step to a cell costs its length in cells, times 1 + [`cost_factor`](Self::with_cost_factor) x cost / 252. Cells from [`INSCRIBED`] on are
/// impassable, and so is what lies outside; unknown cells are, too, unless they are [allowed](Self::allow_unknown).
#[derive(Clone, Debug, Default)]
pub struct CostGrid {
    width: u32,
    height: u32,
    /// With a border of impassable cells, so that no search looks for the edge.
    costs: Vec<u8>,
    factors: StepFactors,
}

/// Factor on the length of a step to a cell, by cost; infinite where it is impassable.
#[derive(Clone, Debug)]
struct StepFactors([f64; 256]);

impl Default for StepFactors {
    fn default() -> Self {
        let mut factors = [1.0; 256];
        factors[usize::from(INSCRIBED)..].fill(f64::INFINITY);
        Self(factors)
    }
}

impl CostGrid {
    /// Makes a grid of that many cells along x and y from the cost of each.
    pub fn new(width: u32, height: u32, mut cost: impl FnMut(GridCell) -> u8) -> Self {
        let mut grid = Self { width, height, costs: Vec::new(), factors: StepFactors::default() };
        grid.costs.resize(grid.stride() as usize * (height as usize + 2), LETHAL);
        for row in 0..height {
            for column in 0..width {
                let cell = GridCell::new(column, row);
                let index = grid.index(cell);
                grid.costs[index as usize] = cost(cell);
            }
        }
        grid
    }

    /// Sets how much dearer a step to a cell of cost 252 is than to one of cost 0; a search with 0 finds the shortest path.
    #[must_use]
    pub fn with_cost_factor(mut self, cost_factor: f64) -> Self {
        for cost in 0..INSCRIBED {
            self.factors.0[usize::from(cost)] = 1.0 + cost_factor * f64::from(cost) / 252.0;
        }
        self
    }

    /// Lets searches cross unknown cells, as cells of that cost.
    #[must_use]
    pub fn allow_unknown(mut self, cost: u8) -> Self {
        self.factors.0[usize::from(UNKNOWN)] = self.factors.0[usize::from(cost)];
        self
    }

    /// Number of cells along x.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of cells along y.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the cost of a cell; [`LETHAL`] outside of the grid.
    pub fn cost(&self, cell: GridCell) -> u8 {
        if self.contains(cell) { self.costs[self.index(cell) as usize] } else { LETHAL }
    }

    /// Sets the cost of a cell; one outside of the grid is left out.
    pub fn set(&mut self, cell: GridCell, cost: u8) {
        if self.contains(cell) {
            let index = self.index(cell);
            self.costs[index as usize] = cost;
        }
    }

    /// Returns whether the robot's middle may be in a cell.
    pub fn is_passable(&self, cell: GridCell) -> bool {
        self.contains(cell) && self.is_open(self.index(cell))
    }

    fn contains(&self, cell: GridCell) -> bool {
        cell.column < self.width && cell.row < self.height
    }

    /// Cells between two rows, with the border.
    pub(crate) fn stride(&self) -> u32 {
        self.width + 2
    }

    /// Number of cells with the border.
    pub(crate) fn cells(&self) -> usize {
        self.costs.len()
    }

    /// Index of a cell of the grid in `costs`.
    pub(crate) fn index(&self, cell: GridCell) -> u32 {
        (cell.row + 1) * self.stride() + cell.column + 1
    }

    pub(crate) fn cell(&self, index: u32) -> GridCell {
        GridCell::new(index % self.stride() - 1, index / self.stride() - 1)
    }

    pub(crate) fn is_open(&self, index: u32) -> bool {
        self.factor(index) < f64::INFINITY
    }

    /// Factor on the length of a step to the cell.
    pub(crate) fn factor(&self, index: u32) -> f64 {
        self.factors.0[usize::from(self.costs[index as usize])]
    }

    /// The largest factor on the length of a step.
    pub(crate) fn largest_factor(&self) -> f64 {
        self.factors
            .0
            .iter()
            .filter(|factor| factor.is_finite())
            .fold(1.0, |largest, factor| slate_module::math::max(largest, *factor))
    }
}

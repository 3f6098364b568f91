//! Costs of cells.

use std::fmt;

use slate_module::math;

/// Cost from which the robot's middle can't be in a cell.
/// An obstacle is then within its inscribed circle.
pub const INSCRIBED: u8 = 253;
/// Cost of an obstacle's cell.
pub const LETHAL: u8 = 254;
/// Cost of an unknown cell.
pub const UNKNOWN: u8 = 255;

/// Cell of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct GridCell {
    /// Column from the left, along x.
    pub column: u32,
    /// Row from below, along y.
    pub row: u32,
}

impl GridCell {
    /// Returns the cell there.
    pub const fn new(column: u32, row: u32) -> Self {
        Self { column, row }
    }

    /// Returns the distance between the middles of two cells, cells.
    pub fn distance(self, other: Self) -> f64 {
        let columns = f64::from(self.column) - f64::from(other.column);
        let rows = f64::from(self.row) - f64::from(other.row);
        (columns * columns + rows * rows).sqrt()
    }

    /// Returns the cells up to `reach` columns and rows away, row by row from below.
    pub fn around(self, reach: u32) -> impl Iterator<Item = Self> {
        let range = move |middle: u32| middle.saturating_sub(reach)..=middle.saturating_add(reach);
        range(self.row).flat_map(move |row| range(self.column).map(move |column| Self::new(column, row)))
    }
}

/// Largest number of cells of a grid, with its border.
pub const MOST_CELLS: u64 = 1 << 26;

/// Memory of a search per cell, bytes.
const SEARCH_BYTES: u128 = 29;

/// Grid that has no cell, or too many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridSizeError {
    /// Number of cells along x.
    pub width: u32,
    /// Number of cells along y.
    pub height: u32,
}

impl fmt::Display for GridSizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let megabytes = u128::from(self.width) * u128::from(self.height) * SEARCH_BYTES / 1_000_000;
        write!(
            f,
            "a grid of {} x {} cells, which takes {megabytes} MB to search: expected 1 to {MOST_CELLS} cells",
            self.width, self.height
        )
    }
}

impl std::error::Error for GridSizeError {}

/// Costs of a grid's cells as searches read them, 0 to [`UNKNOWN`].
///
/// A step to a cell costs its length in cells, times 1 + [`cost_factor`](Self::with_cost_factor) x cost / 252. Cells
/// from [`INSCRIBED`] on are impassable, and so is what lies outside; unknown cells are, too, unless they are
/// [allowed](Self::allow_unknown).
#[derive(Clone, Debug)]
pub struct CostGrid {
    width: u32,
    height: u32,
    /// Costs with a border of impassable cells.
    /// No search thus checks for the edge.
    costs: Vec<u8>,
    /// Factor on the length of a step to a cell, by cost.
    /// Infinite for an impassable cell.
    factors: [f64; 256],
    cost_factor: f64,
    unknown_cost: u8,
}

impl CostGrid {
    /// Creates a grid of `width` by `height` cells from the cost of each.
    /// Width is along x, height along y.
    ///
    /// # Errors
    /// It has no cell, or more than [`MOST_CELLS`].
    pub fn new(width: u32, height: u32, mut cost: impl FnMut(GridCell) -> u8) -> Result<Self, GridSizeError> {
        let cells = (u64::from(width) + 2).saturating_mul(u64::from(height) + 2);
        if width == 0 || height == 0 || cells > MOST_CELLS {
            return Err(GridSizeError { width, height });
        }
        let mut costs = vec![LETHAL; cells as usize];
        let rows = costs.chunks_exact_mut(width as usize + 2).skip(1).take(height as usize);
        for (row, cells) in (0..).zip(rows) {
            for (column, cell) in (0..width).zip(&mut cells[1..]) {
                *cell = cost(GridCell::new(column, row));
            }
        }
        let grid =
            Self { width, height, costs, factors: [1.0; 256], cost_factor: 0.0, unknown_cost: UNKNOWN };
        Ok(grid.with_factors())
    }

    /// Sets the relative extra cost of a step to a cell of cost 252.
    /// The step to a cell of cost 0 is the reference. Clamped to 0 to 1,000; with 0 a search finds the shortest path.
    #[must_use]
    pub fn with_cost_factor(mut self, cost_factor: f64) -> Self {
        self.cost_factor = math::clamp(cost_factor, 0.0, 1_000.0);
        self.with_factors()
    }

    /// Allows searches through unknown cells, at that cost.
    #[must_use]
    pub fn allow_unknown(mut self, cost: u8) -> Self {
        self.unknown_cost = cost;
        self.with_factors()
    }

    fn with_factors(mut self) -> Self {
        for cost in 0..=u8::MAX {
            let counted = if cost == UNKNOWN { self.unknown_cost } else { cost };
            self.factors[usize::from(cost)] = match counted {
                INSCRIBED.. => f64::INFINITY,
                _ => 1.0 + self.cost_factor * f64::from(counted) / 252.0,
            };
        }
        self
    }

    /// Returns the number of cells along x.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the number of cells along y.
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

    /// Returns the cell itself, or else the nearest passable one.
    /// It is at most `reach` columns and rows away.
    pub fn nearest_passable(&self, cell: GridCell, reach: u32) -> Option<GridCell> {
        if self.is_passable(cell) {
            return Some(cell);
        }
        let passable = cell.around(reach).filter(|near| self.is_passable(*near));
        passable.min_by(|a, b| a.distance(cell).total_cmp(&b.distance(cell)))
    }

    fn contains(&self, cell: GridCell) -> bool {
        cell.column < self.width && cell.row < self.height
    }

    /// Cells between two rows, with the border.
    pub(crate) fn stride(&self) -> u32 {
        self.width + 2
    }

    /// Returns the number of cells with the border.
    pub(crate) fn cells(&self) -> usize {
        self.costs.len()
    }

    /// Returns the index of a cell of the grid in `costs`.
    pub(crate) fn index(&self, cell: GridCell) -> u32 {
        (cell.row + 1) * self.stride() + cell.column + 1
    }

    pub(crate) fn cell(&self, index: u32) -> GridCell {
        GridCell::new(index % self.stride() - 1, index / self.stride() - 1)
    }

    pub(crate) fn is_open(&self, index: u32) -> bool {
        self.factor(index) < f64::INFINITY
    }

    /// Returns the factor on the length of a step to the cell.
    pub(crate) fn factor(&self, index: u32) -> f64 {
        self.factors[usize::from(self.costs[index as usize])]
    }

    /// Returns the largest factor on the length of a step.
    pub(crate) fn largest_factor(&self) -> f64 {
        self.factors
            .iter()
            .filter(|factor| factor.is_finite())
            .fold(1.0, |largest, factor| math::max(largest, *factor))
    }
}

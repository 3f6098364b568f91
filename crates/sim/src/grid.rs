//! Uniform grid for neighbor queries.

use serde::{Deserialize, Serialize};
use slate_module::math::{max, min};

use crate::geometry::{Extent, Point};

/// Number of items up to which a linear search is faster.
const LINEAR_SEARCH_LIMIT: usize = 12;

/// Grid whose cells list the items that they contain.
///
/// Items outside of the grid belong to the cells at its border.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Grid {
    minimum: Point,
    #[serde(rename = "cells_per_metre")]
    cells_per_meter: f64,
    columns: u32,
    rows: u32,
    /// Index of each cell's first item, followed by the number of all items.
    starts: Vec<u32>,
    items: Vec<u32>,
    /// Cells that each item covers.
    spans: Vec<Span>,
}

/// Rectangle of cells, with both limits inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Span {
    columns: (u32, u32),
    rows: (u32, u32),
}

impl Grid {
    /// Replaces the items, in existing memory.
    pub fn fill(&mut self, extents: impl ExactSizeIterator<Item = Extent> + Clone) {
        self.lay_out(extents.clone());
        let mut spans = std::mem::take(&mut self.spans);
        spans.clear();
        spans.extend(extents.map(|extent| self.span(&extent)));
        self.spans = spans;
        let cells = self.columns as usize * self.rows as usize;
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for span in &self.spans {
            each_cell(*span, self.columns, |cell| self.starts[cell + 1] += 1);
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.items.clear();
        self.items.resize(self.starts[cells] as usize, 0);
        // Each cell is filled from its end, so that its start is right when it is full.
        for cell in (1..=cells).rev() {
            self.starts[cell] = self.starts[cell - 1];
        }
        for (item, span) in self.spans.iter().enumerate() {
            each_cell(*span, self.columns, |cell| {
                self.items[self.starts[cell + 1] as usize] = item as u32;
                self.starts[cell + 1] += 1;
            });
        }
    }

    /// Chooses the cells: about one per item, over the extent of all.
    fn lay_out(&mut self, extents: impl ExactSizeIterator<Item = Extent>) {
        let count = extents.len();
        let infinite = Point::new(f64::INFINITY, f64::INFINITY);
        let empty = Extent { minimum: infinite, maximum: Point::default().minus(infinite) };
        let all = extents.fold(empty, |all, extent| all.with(&extent));
        let size = all.maximum.minus(all.minimum);
        (self.minimum, self.columns, self.rows) = (all.minimum, 1, 1);
        // Items in a line have no area.
        let narrowest = max(size.x, size.y) / count as f64;
        let area = max(size.x, narrowest) * max(size.y, narrowest);
        if count <= LINEAR_SEARCH_LIMIT || !(area.is_finite() && area > 0.0) {
            self.cells_per_meter = 0.0;
            return;
        }
        self.cells_per_meter = (count as f64 / area).sqrt();
        let cells = |length: f64| max(min(length * self.cells_per_meter, count as f64), 1.0) as u32;
        (self.columns, self.rows) = (cells(size.x), cells(size.y));
    }

    fn span(&self, extent: &Extent) -> Span {
        // A float that is too low for a number becomes 0.
        let cell = |value: f64, least: f64, count: u32| {
            (((value - least) * self.cells_per_meter) as u32).min(count.saturating_sub(1))
        };
        let column = |x: f64| cell(x, self.minimum.x, self.columns);
        let row = |y: f64| cell(y, self.minimum.y, self.rows);
        Span {
            columns: (column(extent.minimum.x), column(extent.maximum.x)),
            rows: (row(extent.minimum.y), row(extent.maximum.y)),
        }
    }

    /// Visits each item once whose cells meet those of an extent.
    /// These include all that meet the extent itself.
    pub fn near(&self, extent: &Extent, mut found: impl FnMut(usize)) {
        if self.items.is_empty() {
            return;
        }
        let span = self.span(extent);
        for row in span.rows.0..=span.rows.1 {
            for column in span.columns.0..=span.columns.1 {
                let cell = (row * self.columns + column) as usize;
                for item in &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                    let own = &self.spans[*item as usize];
                    // An item of several cells is reported in the first common cell.
                    if column == own.columns.0.max(span.columns.0) && row == own.rows.0.max(span.rows.0) {
                        found(*item as usize);
                    }
                }
            }
        }
    }

    /// Returns whether [`near`](Self::near) yields all items.
    pub fn covered_by(&self, extent: &Extent) -> bool {
        let all =
            Span { columns: (0, self.columns.saturating_sub(1)), rows: (0, self.rows.saturating_sub(1)) };
        self.span(extent) == all
    }

    /// Returns the side of a cell, m; infinite for a single one.
    pub fn cell_size(&self) -> f64 {
        1.0 / self.cells_per_meter
    }
}

fn each_cell(span: Span, columns: u32, mut work: impl FnMut(usize)) {
    for row in span.rows.0..=span.rows.1 {
        for column in span.columns.0..=span.columns.1 {
            work((row * columns + column) as usize);
        }
    }
}

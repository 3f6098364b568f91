//! Paths on the costmap.

use slate_grid::Geometry;
use slate_planning::{AStar, CostGrid, GridCell, line_cost};
use slate_plugin::interfaces::{OccupancyGrid, Point2};
use slate_plugin::module::Stamp;

use crate::MOST_CELLS;
use crate::costs::from_percent;

/// Search radius for a passable start cell, m.
/// It is used where the robot's own cell is not passable.
const START_SEARCH_RADIUS: f64 = 0.5;
/// Search radius for the nearest free point to a goal, m.
const GOAL_SEARCH_RADIUS: f64 = 4.0;

/// Costmap as a grid for searches; rebuilt for each costmap.
pub struct RouteGrid {
    made_of: (Stamp, f64),
    geometry: Geometry,
    costs: CostGrid,
}

impl RouteGrid {
    /// Builds a grid from a costmap, or keeps the one built from it.
    /// `None` if the costmap is invalid.
    pub fn fit<'g>(
        grid: &'g mut Option<Self>,
        costmap: &OccupancyGrid,
        stamp: Stamp,
        cost_factor: f64,
    ) -> Option<&'g Self> {
        if grid.as_ref().is_none_or(|grid| grid.made_of != (stamp, cost_factor)) {
            *grid = None;
            let geometry = Geometry::of(costmap, MOST_CELLS)?;
            let cost = |cell: GridCell| {
                from_percent(costmap.data[geometry.index(cell.column as usize, cell.row as usize)])
            };
            let costs = CostGrid::new(costmap.width, costmap.height, cost).ok()?;
            *grid = Some(Self {
                made_of: (stamp, cost_factor),
                geometry,
                costs: costs.with_cost_factor(cost_factor),
            });
        }
        grid.as_ref()
    }

    /// Returns the point, if it is free, or the nearest free point.
    /// Free points are those at which the robot may be; `None` if that is too far away.
    pub fn nearest_free(&self, point: Point2) -> Option<Point2> {
        let cell = self.cell_near(point)?;
        if self.costs.is_passable(cell) && self.cell(point) == Some(cell) {
            return Some(point);
        }
        self.costs.nearest_passable(cell, self.cells(GOAL_SEARCH_RADIUS)).map(|cell| self.center(cell))
    }

    /// Returns whether a straight line between two points is free.
    pub fn is_line_free(&self, from: Point2, to: Point2) -> bool {
        let cells = self.start(from).zip(self.cell(to));
        cells.is_some_and(|(from, to)| line_cost(&self.costs, from, to).is_some())
    }

    /// Appends the cheapest path between two points, without its first point.
    /// Returns false, and adds nothing, if no path exists.
    pub fn extend_path(&self, search: &mut AStar, from: Point2, to: Point2, path: &mut Vec<Point2>) -> bool {
        let (Some(start), Some(goal)) = (self.start(from), self.cell(to)) else { return false };
        let Some(found) = search.search(&self.costs, start, goal) else { return false };
        let cells = found.cells();
        for triple in cells.windows(3) {
            let step = |a: GridCell, b: GridCell| {
                (i64::from(b.column) - i64::from(a.column), i64::from(b.row) - i64::from(a.row))
            };
            // Corners alone: between them the path is straight.
            if step(triple[0], triple[1]) != step(triple[1], triple[2]) {
                path.push(self.center(triple[1]));
            }
        }
        path.push(to);
        true
    }

    /// Returns the robot's cell, or the nearest one in which it may be.
    fn start(&self, point: Point2) -> Option<GridCell> {
        self.costs.nearest_passable(self.cell(point)?, self.cells(START_SEARCH_RADIUS))
    }

    /// Returns the number of cells that cover a distance in m.
    fn cells(&self, distance: f64) -> u32 {
        (distance / self.geometry.resolution).ceil() as u32
    }

    fn cell(&self, point: Point2) -> Option<GridCell> {
        let (column, row) = self.geometry.cell(point.x, point.y)?;
        Some(GridCell::new(column as u32, row as u32))
    }

    /// Returns the cell at a point, or that at the edge nearest to it.
    fn cell_near(&self, point: Point2) -> Option<GridCell> {
        let (column, row) = self.geometry.place(point.x, point.y);
        if !(column.is_finite() && row.is_finite()) {
            return None;
        }
        // The casts clamp outside points to the edge.
        let within = |place: f64, cells: usize| (place.floor() as usize).min(cells - 1) as u32;
        Some(GridCell::new(within(column, self.geometry.width), within(row, self.geometry.height)))
    }

    fn center(&self, cell: GridCell) -> Point2 {
        self.geometry.center(cell.column as usize, cell.row as usize)
    }
}

//! Costmap of layers.

use slate_grid::{DistanceTransform, Geometry, LineCells};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::cost_grid::{CostGrid, GridCell, GridSizeError, INSCRIBED, LETHAL, UNKNOWN};

/// Inflation: decay of the cost with distance to an obstacle.
/// As in Nav2's inflation layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inflation {
    /// Radius of the largest circle inside of the robot's footprint, m.
    pub inscribed_radius: f64,
    /// Distance up to which an obstacle adds cost, `inflation_radius`, m.
    pub inflation_radius: f64,
    /// Decay rate of the cost, `cost_scaling_factor`, 1/m.
    pub cost_scaling_factor: f64,
}

impl Default for Inflation {
    fn default() -> Self {
        Self { inscribed_radius: 0.2, inflation_radius: 0.55, cost_scaling_factor: 3.0 }
    }
}

impl Inflation {
    /// Returns the cost at a distance from an obstacle, m.
    /// The distance counts from the middle of the nearest obstacle's cell.
    pub fn cost(&self, distance: f64) -> u8 {
        if distance == 0.0 {
            LETHAL
        } else if distance <= self.inscribed_radius {
            INSCRIBED
        } else if distance > self.inflation_radius {
            0
        } else {
            let decay = math::exp(-self.cost_scaling_factor * (distance - self.inscribed_radius));
            (f64::from(INSCRIBED - 1) * decay) as u8
        }
    }
}

/// Layered costmap for planning.
/// The layers are a static map, obstacles that sensors see, keep-out zones, and around all of these an inflation (Lu,
/// Hershberger and Smart, 2014, *Layered costmaps for context-sensitive navigation*).
///
/// ```
/// use slate_grid::Geometry;
/// use slate_interfaces::Pose2;
/// use slate_planning::{Costmap, GridCell, Inflation, LETHAL};
///
/// let geometry = Geometry::new([0.0, 0.0], [4.0, 4.0], 0.1, 10_000).unwrap();
/// let mut costmap = Costmap::new(geometry, Inflation::default()).unwrap();
/// costmap.set_static(|_| 0);
/// // A beam from the laser at (1, 2) ends 1 m before it.
/// costmap.insert_scan(&Pose2 { x: 1.05, y: 2.05, theta: 0.0 }, &[[1.0, 0.0]], &[]);
/// let grid = costmap.update();
/// assert_eq!(grid.cost(GridCell::new(20, 20)), LETHAL);
/// assert!(grid.cost(GridCell::new(16, 20)) > 0);
/// ```
#[derive(Clone, Debug)]
pub struct Costmap {
    geometry: Geometry,
    inflation: Inflation,
    /// Cost of each cell by the static map.
    base: Vec<u8>,
    /// Observation of each cell by sensors.
    seen: Vec<CellObservation>,
    keep_out: Vec<bool>,
    distances: DistanceTransform,
    grid: CostGrid,
}

/// Observation of a cell by sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum CellObservation {
    /// No observation: the static map is valid.
    #[default]
    Unseen,
    /// Free: a beam has passed it.
    Free,
    /// Obstacle: a beam has ended in it.
    Obstacle,
}

impl Costmap {
    /// Returns a map of unknown cells.
    ///
    /// # Errors
    /// The grid is too large to search.
    pub fn new(geometry: Geometry, inflation: Inflation) -> Result<Self, GridSizeError> {
        let cells = geometry.cells();
        let size = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let grid = CostGrid::new(size(geometry.width), size(geometry.height), |_| UNKNOWN)?;
        Ok(Self {
            base: vec![UNKNOWN; cells],
            seen: vec![CellObservation::Unseen; cells],
            keep_out: vec![false; cells],
            distances: DistanceTransform::default(),
            grid,
            geometry,
            inflation,
        })
    }

    /// Returns the geometry of the cells.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Sets the static map from the occupancy of each cell in percent.
    /// From 65 on it is an obstacle; negative is unknown.
    pub fn set_static(&mut self, occupancy: impl Fn(usize) -> i8) {
        for (cell, base) in self.base.iter_mut().enumerate() {
            *base = match occupancy(cell) {
                ..0 => UNKNOWN,
                0..65 => 0,
                65.. => LETHAL,
            };
        }
    }

    /// Adds a scan from a sensor's pose in the map frame.
    /// Cells in which beams end are obstacles, those that they pass are free, unless the static map has an obstacle
    /// there.
    ///
    /// Ends of beams are in the sensor's frame, m; `clearing` has those that ended without hitting anything. A point
    /// or pose that is not a number or far from the grid is skipped. In a scan, obstacles count more than beams that go
    /// through.
    pub fn insert_scan(&mut self, sensor: &Pose2, hits: &[[f64; 2]], clearing: &[[f64; 2]]) {
        let from = self.geometry.place(sensor.x, sensor.y);
        // Lines are as long as a grid is large at most.
        let limit = 2.0 * (self.geometry.width + self.geometry.height) as f64;
        // Also false for NaN.
        if !(from.0.abs() <= limit && from.1.abs() <= limit) {
            return;
        }
        let (sine, cosine) = (math::sin(sensor.theta), math::cos(sensor.theta));
        let end = |[x, y]: [f64; 2]| {
            let point = (sensor.x + x * cosine - y * sine, sensor.y + x * sine + y * cosine);
            self.geometry.place(point.0, point.1)
        };
        let is_near = |to: &(f64, f64)| math::hypot(to.0 - from.0, to.1 - from.1) <= limit;
        let ends: Vec<(f64, f64)> =
            hits.iter().chain(clearing).map(|point| end(*point)).filter(is_near).collect();
        for to in &ends {
            for place in LineCells::new(from, *to) {
                if let Some(cell) = self.cell(place) {
                    self.seen[cell] = CellObservation::Free;
                }
            }
        }
        for point in hits {
            let to = end(*point);
            if is_near(&to)
                && let Some(cell) = self.cell((to.0.floor() as i64, to.1.floor() as i64))
            {
                self.seen[cell] = CellObservation::Obstacle;
            }
        }
    }

    /// Clears all that sensors have seen.
    pub fn clear_observations(&mut self) {
        self.seen.fill(CellObservation::Unseen);
    }

    /// Sets the zones that the robot keeps out of.
    pub fn keep_out(&mut self, is_in_zone: impl Fn(usize) -> bool) {
        for (cell, keep_out) in self.keep_out.iter_mut().enumerate() {
            *keep_out = is_in_zone(cell);
        }
    }

    /// Computes costs from the layers.
    pub fn update(&mut self) -> &CostGrid {
        let Self { geometry, inflation, base, seen, keep_out, distances, grid } = self;
        let is_obstacle = |cell: usize| match seen[cell] {
            _ if keep_out[cell] => true,
            CellObservation::Obstacle => true,
            // A beam that grazes a wall of the map does not take it away.
            CellObservation::Free | CellObservation::Unseen => base[cell] == LETHAL,
        };
        let squares = distances.squares(geometry.width, geometry.height, is_obstacle);
        for (cell, square) in squares.iter().enumerate() {
            let cost = inflation.cost((*square as f64).sqrt() * geometry.resolution);
            let is_unknown = seen[cell] == CellObservation::Unseen && base[cell] == UNKNOWN;
            // Unknown cells stay unknown, unless an obstacle is too near in any case.
            let cost = if is_unknown && cost < INSCRIBED { UNKNOWN } else { cost };
            let place = GridCell::new((cell % geometry.width) as u32, (cell / geometry.width) as u32);
            grid.set(place, cost);
        }
        grid
    }

    fn cell(&self, (column, row): (i64, i64)) -> Option<usize> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        let is_inside = column < self.geometry.width && row < self.geometry.height;
        is_inside.then(|| self.geometry.index(column, row))
    }
}

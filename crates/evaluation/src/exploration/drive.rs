//! Robot that explores a building.

use slate_exploration::{Exploration, ExplorationParameters, GoalSelection};
use slate_grid::{LineCells, OccupancyMap, UNKNOWN_CELL};
use slate_module::math;
use slate_planning::{CostGrid, Costmap, GridCell, Inflation, LETHAL, ThetaStar};

use super::building::UnknownBuilding;

/// TurtleBot3 Burger, which Explore-Bench simulates: its radius, m.
pub const ROBOT_RADIUS: f64 = 0.11;
/// Range of its laser in Explore-Bench, m.
const SENSOR_RANGE: f64 = 7.0;
/// Beams of a scan, all around.
const BEAMS: usize = 360;
/// Speed, m/s and rad/s.
const SPEED: f64 = 0.22;
const TURN_SPEED: f64 = 2.0;
/// Time between scans, s.
const PERIOD: f64 = 0.2;
/// Scans between choices of a goal.
const SCANS_PER_CHOICE: u32 = 10;
/// Time limit of a run, s.
const TIME_LIMIT: f64 = 5_000.0;

/// Result of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorationRun {
    /// Times until 90 and 99 % of the area were known, s.
    /// `None` if the run ended before.
    pub time_to_90: Option<f64>,
    /// Time until 99 % are known, as `time_to_90`.
    pub time_to_99: Option<f64>,
    /// Length of the path at the end, m.
    pub path_length: f64,
}

struct ExplorationDrive<'a> {
    building: &'a UnknownBuilding,
    map: OccupancyMap,
    costmap: Costmap,
    /// Position in cells.
    position: (f64, f64),
    heading: f64,
    time: f64,
    run: ExplorationRun,
}

/// Explores from the start of a seed until 99 % of the area are known.
/// It ends earlier if no frontier is left; `None` for a building too large to search.
pub fn explore(building: &UnknownBuilding, selection: GoalSelection, seed: u64) -> Option<ExplorationRun> {
    let mut drive = ExplorationDrive::new(building, seed)?;
    let mut exploration = Exploration::new(ExplorationParameters {
        goal_selection: selection,
        sensor_range: SENSOR_RANGE,
        ..ExplorationParameters::default()
    });
    let mut planner = ThetaStar::default();
    while drive.run.time_to_99.is_none() && drive.time < TIME_LIMIT {
        let cell = drive.cell();
        let costs = drive.costs();
        let Some(goal) = exploration.next_goal(&drive.map, &costs, cell) else { break };
        let Some(path) = planner.search(&costs, cell, goal.cell) else { break };
        let before = drive.time;
        drive.follow(path.cells());
        if drive.time <= before {
            // It is there, and sees nothing new.
            exploration.blacklist(&goal);
        }
    }
    Some(drive.run)
}

impl<'a> ExplorationDrive<'a> {
    fn new(building: &'a UnknownBuilding, seed: u64) -> Option<Self> {
        let geometry = building.map.geometry;
        let inflation = Inflation {
            inscribed_radius: ROBOT_RADIUS,
            inflation_radius: ROBOT_RADIUS,
            ..Inflation::default()
        };
        let mut drive = Self {
            building,
            map: OccupancyMap { geometry, cells: vec![UNKNOWN_CELL; geometry.cells()] },
            costmap: Costmap::new(geometry, inflation).ok()?,
            position: middle(building.start(seed)),
            heading: 0.0,
            time: 0.0,
            run: ExplorationRun { time_to_90: None, time_to_99: None, path_length: 0.0 },
        };
        drive.scan();
        Some(drive)
    }

    /// Returns the cost grid of the known map.
    /// The robot's own cell is always free, however near a wall of whole cells.
    fn costs(&mut self) -> CostGrid {
        let map = &self.map;
        self.costmap.set_static(|cell| map.cells[cell]);
        let mut costs = self.costmap.update().clone();
        let cell = self.cell();
        if costs.cost(cell) < LETHAL {
            costs.set(cell, 0);
        }
        costs
    }

    fn cell(&self) -> GridCell {
        GridCell::new(self.position.0 as u32, self.position.1 as u32)
    }

    /// Drives along a path until the next choice, and scans meanwhile.
    fn follow(&mut self, path: &[GridCell]) {
        let resolution = self.map.geometry.resolution;
        let mut left = f64::from(SCANS_PER_CHOICE) * PERIOD;
        let mut scan_in = PERIOD;
        for cell in path.iter().skip(1) {
            let to = middle(*cell);
            let (x, y) = (to.0 - self.position.0, to.1 - self.position.1);
            let length = math::hypot(x, y) * resolution;
            if length < 1e-9 {
                continue;
            }
            let heading = math::atan2(y, x);
            let turn = math::wrap_angle(heading - self.heading).abs() / TURN_SPEED;
            self.heading = heading;
            self.time += turn;
            left -= turn;
            let mut driven = 0.0;
            while driven < length && left > 0.0 {
                let step = math::min(length - driven, scan_in * SPEED);
                driven += step;
                self.time += step / SPEED;
                left -= step / SPEED;
                scan_in -= step / SPEED;
                self.run.path_length += step;
                let share = step / length;
                self.position = (self.position.0 + x * share, self.position.1 + y * share);
                if scan_in <= 1e-9 {
                    scan_in = PERIOD;
                    self.scan();
                }
            }
            if left <= 0.0 {
                return;
            }
        }
        self.scan();
    }

    /// Adds a scan to the map, and records the known share.
    fn scan(&mut self) {
        let truth = &self.building.map;
        let range = SENSOR_RANGE / truth.geometry.resolution;
        for beam in 0..BEAMS {
            let angle = std::f64::consts::TAU * beam as f64 / BEAMS as f64;
            let end =
                (self.position.0 + range * math::cos(angle), self.position.1 + range * math::sin(angle));
            for (column, row) in LineCells::new(self.position, end) {
                let is_inside = (0..truth.geometry.width as i64).contains(&column)
                    && (0..truth.geometry.height as i64).contains(&row);
                if !is_inside {
                    break;
                }
                let cell = truth.geometry.index(column as usize, row as usize);
                self.map.cells[cell] = truth.cells[cell];
                if truth.cells[cell] > 50 {
                    break;
                }
            }
        }
        let share = self.building.known_share(&self.map);
        if share >= 0.9 {
            self.run.time_to_90.get_or_insert(self.time);
        }
        if share >= 0.99 {
            self.run.time_to_99.get_or_insert(self.time);
        }
    }
}

fn middle(cell: GridCell) -> (f64, f64) {
    (f64::from(cell.column) + 0.5, f64::from(cell.row) + 0.5)
}

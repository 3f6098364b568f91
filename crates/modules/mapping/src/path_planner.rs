use serde::{Deserialize, Serialize};
use slate_grid::{DistanceTransform, Geometry, LineCells};
use slate_interfaces::{OccupancyGrid, Path, Point2, Pose2};
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::search::{BLOCKED, Search};

/// Ports of [`PathPlanner`].
#[ports]
pub struct PathPlannerIo {
    /// Occupancy grid to plan on, from Knowledge.
    map: Required<OccupancyGrid>,
    /// Pose of the robot in the map frame, from Knowledge.
    pose: Required<Pose2>,
    /// Goal in the map frame, from Knowledge.
    goal: Required<Point2>,
    /// Planned path; empty if the goal is unreachable.
    change: Change<Path>,
    /// Point on the path at the lookahead distance, or its end.
    /// The robot's position without a path.
    waypoint: Output<Point2>,
}

/// Parameters of [`PathPlanner`].
#[params]
pub struct PathPlannerParams {
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "least distance of the path to occupied cells")]
    robot_radius: f64,
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "width of the soft-cost band beyond the robot's radius")]
    inflation_margin: f64,
    #[param(default = 65, range = 1..=100, unit = "%", doc = "occupancy from which a cell is an obstacle")]
    occupied_threshold: i64,
    #[param(default = 0.8, range = 0.05..=100.0, unit = "m", doc = "distance of the waypoint along the path")]
    lookahead_distance: f64,
    #[param(default = 0.5, range = 0.02..=60.0, unit = "s", doc = "time between two plans for the same goal")]
    replan_period: f64,
    #[param(default = true, doc = "allow paths through unknown cells")]
    allow_unknown: Bool,
}

/// Largest number of cells of a map that is planned on.
pub(crate) const MOST_CELLS: usize = 1 << 20;

/// Global planner: A* on an inflated costmap, with line-of-sight smoothing.
pub struct PathPlanner;

/// State of [`PathPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct PathPlannerState {
    /// Time and goal of the newest plan.
    planned: Option<u64>,
    goal: Option<[f64; 2]>,
    #[serde(skip)]
    costs: Vec<u16>,
    #[serde(skip)]
    distances: DistanceTransform,
    #[serde(skip)]
    search: Search,
    #[serde(skip)]
    points: Vec<Point2>,
}

/// Cost of a cell at the robot's radius from an obstacle.
/// It falls linearly to 1 at the end of the inflation margin.
const HIGHEST: f64 = 8.0;

impl Analyze for PathPlanner {
    const NAME: &'static str = "path_planner";
    const DOC: &'static str = "Finds the shortest path to the goal on the map.";
    type Observed = PathPlannerIo;
    type Params = PathPlannerParams;
    type State = PathPlannerState;
    type Value = InPlace<Path>;

    fn process(
        state: &mut PathPlannerState,
        io: &PathPlannerIo,
        params: &PathPlannerParams,
        now: &Tick,
    ) -> Option<InPlace<Path>> {
        let (Some(map), Some(pose), Some(goal)) = (io.map.fresh(), io.pose.fresh(), io.goal.fresh()) else {
            return None;
        };
        let is_other = state.goal != Some([goal.x, goal.y]);
        let is_due = state.planned.is_none_or(|planned| {
            now.now().saturating_sub(planned) as f64 >= params.replan_period * 1e9 - 1.0
        });
        if !is_other && !is_due {
            return None;
        }
        (state.planned, state.goal) = (Some(now.now()), Some([goal.x, goal.y]));
        let Some(geometry) = Geometry::of(map, MOST_CELLS) else {
            now.warn(format_args!(
                "invalid map of {} by {} cells of {} m: expected 1 to 1048576 cells, and as much data",
                map.width, map.height, map.resolution
            ));
            return None;
        };
        state.plan(&geometry, map, pose, goal, params);
        let length: f64 = state.points.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
        let points = &state.points[..state.points.len().min(io.change.capacity())];
        let written = io.change.write(points.len(), |path| {
            path.length = length;
            path.points.copy_from_slice(points);
        });
        // Without a path the robot stays.
        io.waypoint
            .set(state.lookahead(params.lookahead_distance).unwrap_or(Point2 { x: pose.x, y: pose.y }));
        Some(written)
    }
}

fn distance(a: Point2, b: Point2) -> f64 {
    math::hypot(b.x - a.x, b.y - a.y)
}

impl PathPlannerState {
    /// Points of the newest path.
    pub(crate) fn points(&self) -> &[Point2] {
        &self.points
    }

    /// Plans a path into `points`.
    pub(crate) fn plan(
        &mut self,
        geometry: &Geometry,
        map: &OccupancyGrid,
        pose: &Pose2,
        goal: &Point2,
        params: &PathPlannerParams,
    ) {
        self.points.clear();
        self.points.reserve(geometry.cells() + 1);
        let (Some(start), Some(end)) = (geometry.cell(pose.x, pose.y), geometry.cell(goal.x, goal.y)) else {
            return;
        };
        self.inflate(geometry, map, start, params);
        let [from, to] = [start, end].map(|(column, row)| geometry.index(column, row));
        let path = self.search.path(geometry, &self.costs, from, to);
        let place = |cell: u32| (cell as usize % geometry.width, cell as usize / geometry.width);
        let Some((&first, rest)) = path.split_first() else { return };
        // A straight segment never crosses a cell of higher cost than the path itself.
        self.points.push(Point2 { x: pose.x, y: pose.y });
        let mut anchor = first;
        let mut last = first;
        let mut highest = self.costs[first as usize];
        for &cell in rest {
            let limit = highest.max(self.costs[cell as usize]);
            if is_straight(geometry, &self.costs, place(anchor), place(cell), limit) {
                highest = limit;
            } else {
                let (column, row) = place(last);
                self.points.push(geometry.center(column, row));
                anchor = last;
                highest = self.costs[last as usize].max(self.costs[cell as usize]);
            }
            last = cell;
        }
        self.points.push(*goal);
    }

    /// Fills the costmap from the distance transform.
    fn inflate(
        &mut self,
        geometry: &Geometry,
        map: &OccupancyGrid,
        start: (usize, usize),
        params: &PathPlannerParams,
    ) {
        let cells = |length: f64| length / geometry.resolution;
        let (radius, farthest) =
            (cells(params.robot_radius), cells(params.robot_radius + params.inflation_margin));
        let is_occupied = |cell: usize| i64::from(map.data[cell]) >= params.occupied_threshold;
        let squares = self.distances.squares(geometry.width, geometry.height, is_occupied);
        self.costs.clear();
        let allow_unknown = params.allow_unknown.get();
        self.costs.extend(squares.iter().zip(&map.data).map(|(square, occupancy)| {
            let square = *square as f64;
            if square <= radius * radius || (*occupancy < 0 && !allow_unknown) {
                BLOCKED
            } else if square < farthest * farthest {
                1 + (HIGHEST * (farthest - square.sqrt()) / (farthest - radius)) as u16
            } else {
                1
            }
        }));
        // The robot must be able to leave its own footprint, even too close to an obstacle.
        let is_footprint = |column: usize, row: usize| {
            math::hypot(column.abs_diff(start.0) as f64, row.abs_diff(start.1) as f64) <= radius
        };
        let reach = radius.ceil() as usize;
        for row in start.1.saturating_sub(reach)..(start.1 + reach + 1).min(geometry.height) {
            for column in start.0.saturating_sub(reach)..(start.0 + reach + 1).min(geometry.width) {
                let cell = geometry.index(column, row);
                let is_free = !is_occupied(cell) || (column, row) == start;
                if is_free && is_footprint(column, row) {
                    self.costs[cell] = self.costs[cell].min(4 * HIGHEST as u16);
                }
            }
        }
    }

    /// Returns the point at a distance along the path, or its end.
    fn lookahead(&self, length: f64) -> Option<Point2> {
        let mut left = length;
        for pair in self.points.windows(2) {
            let length = distance(pair[0], pair[1]);
            if length >= left {
                let share = left / length;
                let between = |a: f64, b: f64| a + share * (b - a);
                return Some(Point2 { x: between(pair[0].x, pair[1].x), y: between(pair[0].y, pair[1].y) });
            }
            left -= length;
        }
        self.points.last().copied()
    }
}

/// Returns whether a line of sight crosses no cell of higher cost.
fn is_straight(
    geometry: &Geometry,
    costs: &[u16],
    from: (usize, usize),
    to: (usize, usize),
    limit: u16,
) -> bool {
    let middle = |(column, row): (usize, usize)| (column as f64 + 0.5, row as f64 + 0.5);
    let mut cells = LineCells::new(middle(from), middle(to));
    cells.all(|(column, row)| {
        let cell = usize::try_from(column).ok().zip(usize::try_from(row).ok());
        cell.is_some_and(|(column, row)| {
            column < geometry.width && row < geometry.height && costs[geometry.index(column, row)] <= limit
        })
    })
}

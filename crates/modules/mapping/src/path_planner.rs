use serde::{Deserialize, Serialize};
use slate_interfaces::{OccupancyGrid, Path, Point2, Pose2};
use slate_module::prelude::*;

use crate::geometry::{Geometry, Line};
use crate::search::{BLOCKED, Search};

/// Ports of [`PathPlanner`].
#[ports]
pub struct PathPlannerIo {
    /// What is where.
    map: Input<OccupancyGrid>,
    /// Where the robot is.
    pose: Input<Pose2>,
    /// Where it shall go.
    goal: Input<Point2>,
    /// The way there; without points when there is none.
    path: Output<Path>,
    /// Where it shall go first: a place on the way that it can go to straight.
    next: Output<Point2>,
}

/// Parameters of [`PathPlanner`].
#[params]
pub struct PathPlannerParams {
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "nothing that is occupied is nearer to the way: the robot's radius")]
    radius: f64,
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "so much farther away it rather stays")]
    berth: f64,
    #[param(default = 65, range = 1..=100, unit = "%", doc = "from here on a cell is occupied")]
    occupied: i64,
    #[param(default = 0.8, range = 0.05..=100.0, unit = "m", doc = "how far ahead on the way the next place is at most")]
    look_ahead: f64,
    #[param(default = 0.5, range = 0.02..=60.0, unit = "s", doc = "from one plan to the next")]
    period: f64,
}

/// Plans the shortest way to a goal that keeps away from what a map has; what is not known counts as free.
pub struct PathPlanner;

/// State of [`PathPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct PathPlannerState {
    /// When it planned last, and for which goal.
    planned: Option<u64>,
    goal: Option<[f64; 2]>,
    #[serde(skip)]
    costs: Vec<u16>,
    #[serde(skip)]
    stamp: Stamp,
    #[serde(skip)]
    search: Search,
    #[serde(skip)]
    points: Vec<Point2>,
}

/// What a cell costs that is as near to something as the robot may be; one that is far from everything costs 1.
const NEAREST: f64 = 8.0;

#[module(stage = Think)]
impl Module for PathPlanner {
    type Io = PathPlannerIo;
    type Params = PathPlannerParams;
    type State = PathPlannerState;

    fn tick(
        state: &mut PathPlannerState,
        io: &PathPlannerIo,
        params: &PathPlannerParams,
        now: &Tick,
    ) -> Outcome {
        let (Some(map), Some(pose), Some(goal)) = (io.map.fresh(), io.pose.fresh(), io.goal.fresh()) else {
            return Outcome::Ok;
        };
        let is_other = state.goal != Some([goal.x, goal.y]);
        let is_due = state
            .planned
            .is_none_or(|planned| now.now().saturating_sub(planned) as f64 >= params.period * 1e9 - 1.0);
        if !is_other && !is_due {
            return Outcome::Ok;
        }
        (state.planned, state.goal) = (Some(now.now()), Some([goal.x, goal.y]));
        let Some(geometry) = Geometry::of(map) else {
            now.warn(format_args!(
                "the map is none: {} by {} cells of {} m",
                map.width, map.height, map.resolution
            ));
            return Outcome::Failed;
        };
        state.plan(&geometry, map, pose, goal, params);
        let length: f64 = state.points.windows(2).map(|pair| apart(pair[0], pair[1])).sum();
        let points = &state.points[..state.points.len().min(io.path.capacity())];
        io.path.write(points.len(), |path| {
            path.length = length;
            path.points.copy_from_slice(points);
        });
        // Without a way it stays.
        io.next.set(state.ahead(params.look_ahead).unwrap_or(Point2 { x: pose.x, y: pose.y }));
        Outcome::Ok
    }
}

fn apart(a: Point2, b: Point2) -> f64 {
    math::hypot(b.x - a.x, b.y - a.y)
}

impl PathPlannerState {
    /// Puts the way into the points.
    fn plan(
        &mut self,
        geometry: &Geometry,
        map: &OccupancyGrid,
        pose: &Pose2,
        goal: &Point2,
        params: &PathPlannerParams,
    ) {
        self.points.clear();
        let (Some(start), Some(end)) = (geometry.cell(pose.x, pose.y), geometry.cell(goal.x, goal.y)) else {
            return;
        };
        self.weigh(geometry, map, start, params);
        let [from, to] = [start, end].map(|(column, row)| geometry.index(column, row));
        let way = self.search.way(geometry, &self.costs, from, to);
        let place = |cell: u32| (cell as usize % geometry.width, cell as usize / geometry.width);
        let Some((&first, rest)) = way.split_first() else { return };
        // Straight as far as that costs no more than a cell of the way itself.
        self.points.push(Point2 { x: pose.x, y: pose.y });
        let mut anchor = first;
        let mut last = first;
        let mut dearest = self.costs[first as usize];
        for &cell in rest {
            let limit = dearest.max(self.costs[cell as usize]);
            if is_straight(geometry, &self.costs, place(anchor), place(cell), limit) {
                dearest = limit;
            } else {
                let (column, row) = place(last);
                self.points.push(geometry.middle(column, row));
                anchor = last;
                dearest = self.costs[last as usize].max(self.costs[cell as usize]);
            }
            last = cell;
        }
        self.points.push(*goal);
    }

    /// What each cell costs, by how far it is from what is occupied.
    fn weigh(
        &mut self,
        geometry: &Geometry,
        map: &OccupancyGrid,
        start: (usize, usize),
        params: &PathPlannerParams,
    ) {
        self.costs.clear();
        self.costs.resize(geometry.cells(), 1);
        self.stamp.fit(geometry, params);
        // Where the robot is already it must be able to leave.
        let radius = params.radius / geometry.resolution;
        let own = |column: usize, row: usize| {
            math::hypot(column.abs_diff(start.0) as f64, row.abs_diff(start.1) as f64) <= radius
        };
        for row in 0..geometry.height {
            for column in 0..geometry.width {
                if i64::from(map.data[geometry.index(column, row)]) < params.occupied {
                    continue;
                }
                for (across, up, cost) in &self.stamp.cells {
                    let place = column.checked_add_signed(*across).zip(row.checked_add_signed(*up));
                    let Some((column, row)) = place else { continue };
                    if column < geometry.width && row < geometry.height {
                        let cell = &mut self.costs[geometry.index(column, row)];
                        *cell = (*cell).max(*cost);
                    }
                }
            }
        }
        let reach = radius.ceil() as usize;
        for row in start.1.saturating_sub(reach)..(start.1 + reach + 1).min(geometry.height) {
            for column in start.0.saturating_sub(reach)..(start.0 + reach + 1).min(geometry.width) {
                let cell = geometry.index(column, row);
                let is_free = i64::from(map.data[cell]) < params.occupied || (column, row) == start;
                if is_free && own(column, row) {
                    self.costs[cell] = self.costs[cell].min(4 * NEAREST as u16);
                }
            }
        }
    }

    /// So far on the way, or its end.
    fn ahead(&self, length: f64) -> Option<Point2> {
        let mut left = length;
        for pair in self.points.windows(2) {
            let way = apart(pair[0], pair[1]);
            if way >= left {
                let share = left / way;
                let between = |a: f64, b: f64| a + share * (b - a);
                return Some(Point2 { x: between(pair[0].x, pair[1].x), y: between(pair[0].y, pair[1].y) });
            }
            left -= way;
        }
        self.points.last().copied()
    }
}

/// What the cells around one that is occupied cost: from there to across and up.
#[derive(Clone, Debug, Default)]
struct Stamp {
    /// The radius and the berth that it is for, in cells.
    of: (f64, f64),
    cells: Vec<(isize, isize, u16)>,
}

impl Stamp {
    /// Makes it one for these parameters, if it is not.
    fn fit(&mut self, geometry: &Geometry, params: &PathPlannerParams) {
        let cells = |length: f64| length / geometry.resolution;
        let (radius, farthest) = (cells(params.radius), cells(params.radius + params.berth));
        if self.of == (radius, farthest) && !self.cells.is_empty() {
            return;
        }
        self.of = (radius, farthest);
        self.cells.clear();
        // No cell of the map is farther away.
        let reach = (farthest.ceil() as usize).min(geometry.width.max(geometry.height)) as isize;
        for up in -reach..=reach {
            for across in -reach..=reach {
                let distance = math::hypot(across as f64, up as f64);
                if distance <= radius {
                    self.cells.push((across, up, BLOCKED));
                } else if distance <= farthest {
                    let share = (farthest - distance) / (farthest - radius);
                    self.cells.push((across, up, 1 + (NEAREST * share) as u16));
                }
            }
        }
    }
}

/// Whether a straight line goes over nothing dearer.
fn is_straight(
    geometry: &Geometry,
    costs: &[u16],
    from: (usize, usize),
    to: (usize, usize),
    limit: u16,
) -> bool {
    let middle = |(column, row): (usize, usize)| (column as f64 + 0.5, row as f64 + 0.5);
    let mut cells = Line::new(middle(from), middle(to));
    cells.all(|(column, row)| {
        let cell = usize::try_from(column).ok().zip(usize::try_from(row).ok());
        cell.is_some_and(|(column, row)| {
            column < geometry.width && row < geometry.height && costs[geometry.index(column, row)] <= limit
        })
    })
}

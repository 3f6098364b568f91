//! Exploration as a block.

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::{OccupancyGrid, Point2, Pose2};
use slate_mapek::prelude::*;
use slate_module::prelude::*;
use slate_planning::{Costmap, GridCell, Inflation};

use crate::exploration::{Exploration, ExplorationGoal};
use crate::frontier::{FREE, Frontier};
use crate::parameters::{ExplorationParameters, GoalSelection};

/// Largest number of cells of a map.
const MOST_CELLS: usize = 1 << 22;
/// Reduction of the path's cost that counts as progress, m.
const PROGRESS: f64 = 0.2;
/// Minimum distance between two different goals, m.
const OTHER_GOAL: f64 = 0.5;

/// Ports of [`FrontierExplorer`].
#[ports]
pub struct FrontierExplorerIo {
    /// Map of the known space, from Knowledge.
    map: Required<OccupancyGrid>,
    /// Pose of the robot in the map frame, from Knowledge.
    pose: Required<Pose2>,
    /// Frontiers of the map.
    #[capacity(32_768)]
    change: Change<FrontierPoints>,
    /// Next goal, in the map frame.
    /// The robot's own position when no frontier is left.
    goal: Output<Point2>,
    /// Progress.
    progress: Output<ExplorationProgress>,
}

/// Cells between free and unknown space.
#[interface]
pub struct FrontierPoints {
    /// Number of frontiers.
    pub frontiers: u32,
    /// Middles of their cells in the map frame, frontier by frontier.
    pub points: [Point2],
}

/// Progress of an exploration.
#[interface]
#[derive(PartialEq)]
pub struct ExplorationProgress {
    /// Number of frontiers.
    pub frontiers: u32,
    /// Number of goals that the robot has not reached.
    pub blacklisted: u32,
    /// Area that it would see at its goal.
    #[unit("m^2")]
    pub information_gain: f64,
    /// Cost of the path there.
    #[unit("m")]
    pub path_cost: f64,
    /// True if no frontier is left.
    pub is_done: Bool,
}

/// Parameters of [`FrontierExplorer`].
#[params]
pub struct FrontierExplorerParams {
    #[param(default = "next_best_view", doc = "nearest_frontier, information_gain or next_best_view")]
    goal_selection: Text<28>,
    #[param(default = 7.0, range = 0.1..=100.0, unit = "m", doc = "range of the sensor")]
    sensor_range: f64,
    #[param(default = 0.4, range = 0.0..=10.0, unit = "m", doc = "length below which a frontier is left out")]
    min_frontier_size: f64,
    #[param(default = 25, range = 25..=64, unit = "%", doc = "occupancy up to which a cell is free; 49 for maps that are probabilities")]
    free_threshold: i64,
    #[param(default = 1.5, range = 0.0..=10.0, doc = "exponent of the path cost that the gain is divided by")]
    path_cost_exponent: f64,
    #[param(default = 0.3, range = 0.0..=10.0, doc = "share by which another goal must be better than the current one")]
    hysteresis: f64,
    #[param(default = 0.35, range = 0.0..=5.0, unit = "m", doc = "minimum distance of goals and paths to occupied cells")]
    robot_radius: f64,
    #[param(default = 1.0, range = 0.02..=60.0, unit = "s", doc = "time between two choices")]
    choice_period: f64,
    #[param(default = 0.4, range = 0.01..=10.0, unit = "m", doc = "distance from a goal at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 3.0, range = 0.0..=600.0, unit = "s", doc = "time at a goal after which it goes on the blacklist, if it still is one")]
    dwell_time: f64,
    #[param(default = 20.0, range = 0.1..=3600.0, unit = "s", doc = "time without progress after which a goal goes on the blacklist")]
    progress_timeout: f64,
    #[param(default = 0.4, range = 0.0..=5.0, unit = "m", doc = "distance of a goal from one on the blacklist below which it counts as that")]
    blacklist_radius: f64,
    #[param(default = 1, range = 0..=100, doc = "times that the blacklist is cleared when no other goal is left")]
    retries: i64,
    #[param(default = 4.0, range = 0.0..=600.0, unit = "s", doc = "time without a goal after which nothing is left to see")]
    done_after: f64,
}

/// Frontier-based exploration: chooses goals that reveal unknown cells.
///
/// It keeps a goal until another is better by `hysteresis`, and leaves out goals that the robot does not reach.
pub struct FrontierExplorer;

/// State of [`FrontierExplorer`].
#[derive(Default, Serialize, Deserialize)]
pub struct FrontierExplorerState {
    exploration: Option<Exploration>,
    target: Option<ExplorationTarget>,
    /// Time of the last choice, ns; `idle_since` is that of the loss of a goal.
    chosen_at: Option<u64>,
    idle_since: Option<u64>,
    /// Number of times the blacklist was cleared.
    retries: i64,
    /// True if the log holds a warning of an unknown strategy.
    has_warned: bool,
    /// Costmap, and the robot's radius for which it was built.
    #[serde(skip)]
    costmap: Option<(f64, Costmap)>,
    #[serde(skip)]
    map: Option<OccupancyMap>,
}

/// Current goal of the robot.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct ExplorationTarget {
    position: [f64; 2],
    /// Least cost of the path so far, m; its time, ns.
    least_cost: f64,
    progress_at: u64,
    /// Time of arrival at the goal, ns.
    reached_at: Option<u64>,
}

impl Analyze for FrontierExplorer {
    const NAME: &'static str = "frontier_explorer";
    const DOC: &'static str = "Chooses goals that explore the unknown cells of the map.";
    type Observed = FrontierExplorerIo;
    type Params = FrontierExplorerParams;
    type State = FrontierExplorerState;
    type Value = InPlace<FrontierPoints>;

    fn process(
        state: &mut FrontierExplorerState,
        io: &FrontierExplorerIo,
        params: &FrontierExplorerParams,
        now: &Tick,
    ) -> Option<InPlace<FrontierPoints>> {
        let (map, pose) = (io.map.fresh()?, *io.pose.fresh()?);
        let since = state.chosen_at.map_or(u64::MAX, |at| now.now().saturating_sub(at));
        if (since as f64) < params.choice_period * 1e9 - 1.0 || !pose.is_known() {
            return None;
        }
        let geometry = Geometry::of(map, MOST_CELLS)?;
        let (column, row) = geometry.cell(pose.x, pose.y)?;
        state.chosen_at = Some(now.now());
        state.take(map, geometry, params)?;
        let robot = GridCell::new(column as u32, row as u32);
        let goal = state.choose(robot, &pose, params, now);
        let position = goal.as_ref().map_or(Point2 { x: pose.x, y: pose.y }, |goal| goal.position);
        io.goal.set(position);
        Some(state.publish(io, goal.as_ref(), params, now))
    }
}

impl FrontierExplorerState {
    /// Takes a map and computes its cost grid; `None` if it is too large to search.
    fn take(
        &mut self,
        map: &OccupancyGrid,
        geometry: Geometry,
        params: &FrontierExplorerParams,
    ) -> Option<()> {
        let known = self.map.get_or_insert_with(|| OccupancyMap { geometry, cells: Vec::new() });
        known.geometry = geometry;
        known.cells.clear();
        // Cells with few observations are between free and unknown, and would hide the frontier.
        let threshold = i8::try_from(params.free_threshold).unwrap_or(FREE);
        let as_free = |cell: &i8| if (FREE..=threshold).contains(cell) { FREE } else { *cell };
        known.cells.extend(map.data.iter().map(as_free));
        let inflation = Inflation {
            inscribed_radius: params.robot_radius,
            inflation_radius: params.robot_radius,
            ..Inflation::default()
        };
        let radius = params.robot_radius;
        let is_fit = |(of, costmap): &(f64, Costmap)| *of == radius && *costmap.geometry() == geometry;
        if !self.costmap.as_ref().is_some_and(is_fit) {
            self.costmap = None;
            self.costmap = Some((radius, Costmap::new(geometry, inflation).ok()?));
        }
        Some(())
    }

    /// Chooses a goal, after unreached goals were put on the blacklist.
    fn choose(
        &mut self,
        robot: GridCell,
        pose: &Pose2,
        params: &FrontierExplorerParams,
        now: &Tick,
    ) -> Option<ExplorationGoal> {
        let parameters = self.parameters(params, now);
        let ((_, costmap), map) = (self.costmap.as_mut()?, self.map.as_ref()?);
        costmap.set_static(|cell| map.cells[cell]);
        let costs = costmap.update();
        let exploration = self.exploration.get_or_insert_with(|| Exploration::new(parameters));
        exploration.set_parameters(parameters);
        if let Some(target) = self.target.filter(|target| target.is_missed(params, now)) {
            let [x, y] = target.position;
            exploration.blacklist_position(Point2 { x, y });
            self.target = None;
        }
        let mut goal = exploration.next_goal(map, costs, robot);
        if goal.is_none() && exploration.blacklisted() > 0 && self.retries < params.retries {
            // From elsewhere they may be reached.
            self.retries += 1;
            exploration.clear_blacklist();
            goal = exploration.next_goal(map, costs, robot);
        }
        self.target =
            goal.as_ref().map(|goal| ExplorationTarget::follow(self.target, goal, pose, params, now));
        match goal {
            Some(_) => self.idle_since = None,
            None => _ = self.idle_since.get_or_insert(now.now()),
        }
        goal
    }

    fn parameters(&mut self, params: &FrontierExplorerParams, now: &Tick) -> ExplorationParameters {
        let goal_selection = match params.goal_selection.as_str() {
            "nearest_frontier" => GoalSelection::NearestFrontier,
            "information_gain" => GoalSelection::InformationGain,
            "next_best_view" => GoalSelection::NextBestView,
            other => {
                if !std::mem::replace(&mut self.has_warned, true) {
                    now.warn(format_args!(
                        "unknown `goal_selection` `{other}`: expected nearest_frontier, information_gain or next_best_view, and takes the last"
                    ));
                }
                GoalSelection::NextBestView
            }
        };
        ExplorationParameters {
            goal_selection,
            sensor_range: params.sensor_range,
            min_frontier_size: params.min_frontier_size,
            path_cost_exponent: params.path_cost_exponent,
            hysteresis: params.hysteresis,
            blacklist_radius: params.blacklist_radius,
        }
    }

    fn publish(
        &self,
        io: &FrontierExplorerIo,
        goal: Option<&ExplorationGoal>,
        params: &FrontierExplorerParams,
        now: &Tick,
    ) -> InPlace<FrontierPoints> {
        let resolution = self.map.as_ref().map_or(1.0, |map| map.geometry.resolution);
        let least = (params.min_frontier_size / resolution).ceil() as usize;
        let frontiers =
            self.exploration.as_ref().map_or(Vec::new(), |exploration| exploration.frontiers(least));
        let is_done = self
            .idle_since
            .is_some_and(|since| now.now().saturating_sub(since) as f64 >= params.done_after * 1e9);
        io.progress.set(ExplorationProgress {
            frontiers: frontiers.len() as u32,
            blacklisted: self.exploration.as_ref().map_or(0, |exploration| exploration.blacklisted() as u32),
            information_gain: goal.map_or(0.0, |goal| goal.information_gain),
            path_cost: goal.map_or(0.0, |goal| goal.path_cost),
            is_done: is_done.into(),
        });
        self.write(&frontiers, &io.change)
    }

    /// Writes as many cells of the frontiers as there is room for.
    fn write(&self, frontiers: &[Frontier], change: &Change<FrontierPoints>) -> InPlace<FrontierPoints> {
        let count: usize = frontiers.iter().map(|frontier| frontier.cells.len()).sum();
        change.write(count.min(change.capacity()), |written| {
            written.frontiers = frontiers.len() as u32;
            let Some(OccupancyMap { geometry, .. }) = &self.map else { return };
            let cells = frontiers.iter().flat_map(|frontier| &frontier.cells);
            for (point, cell) in written.points.iter_mut().zip(cells) {
                *point = geometry.center(cell.column as usize, cell.row as usize);
            }
        })
    }
}

impl ExplorationTarget {
    /// Follows a goal, which may be the one before.
    fn follow(
        before: Option<Self>,
        goal: &ExplorationGoal,
        pose: &Pose2,
        params: &FrontierExplorerParams,
        now: &Tick,
    ) -> Self {
        let Point2 { x, y } = goal.position;
        let is_same =
            |before: &Self| math::hypot(before.position[0] - x, before.position[1] - y) < OTHER_GOAL;
        let fresh =
            Self { position: [x, y], least_cost: goal.path_cost, progress_at: now.now(), reached_at: None };
        let Some(before) = before.filter(is_same) else { return fresh };
        let is_near = math::hypot(pose.x - x, pose.y - y) < params.goal_tolerance;
        let reached_at = is_near.then(|| before.reached_at.unwrap_or(now.now()));
        if goal.path_cost < before.least_cost - PROGRESS {
            return Self { reached_at, ..fresh };
        }
        Self { position: [x, y], reached_at, ..before }
    }

    /// Returns true if the robot makes no progress, or the reached goal remains.
    fn is_missed(&self, params: &FrontierExplorerParams, now: &Tick) -> bool {
        let since = |time: u64| now.now().saturating_sub(time) as f64 * 1e-9;
        since(self.progress_at) > params.progress_timeout
            || self.reached_at.is_some_and(|reached| since(reached) > params.dwell_time)
    }
}

//! Navigation of the robot: observations, global path and local planner.

use slate_avoidance::Footprint;
use slate_grid::Geometry;
use slate_interfaces::{Point2, Pose2};
use slate_local_planning::{
    Dwa, FootprintPoints, MotionState, Mppi, ObservationBuffer, ObstacleField, PlanarVelocity,
    ProgressChecker, RecoveryCommand, RecoverySequence,
};
use slate_module::{Random, math};
use slate_planning::{AStar, Costmap, GridCell};

use super::LocalPlannerKind;
use super::jackal::{Jackal, corners};
use super::settings::NavigationSettings;

/// Time between two cycles, s.
pub const PERIOD: f64 = 0.05;
/// Time between two global plans, s.
const REPLAN_PERIOD: f64 = 0.5;
/// Distance around start and goal within which the robot plans, m.
const MARGIN: f64 = 4.0;
/// Edge length of the cells of costmap and local window, m.
const RESOLUTION: f64 = 0.05;
/// Cycles without a velocity after which it recovers.
const FAILURES: u32 = 10;

/// Navigation with one of the local planners.
pub struct BarnNavigation {
    settings: NavigationSettings,
    planner: ChosenPlanner,
    footprint: FootprintPoints,
    costmap: Costmap,
    search: AStar,
    path: Vec<Point2>,
    planned: Option<f64>,
    observations: ObservationBuffer,
    field: ObstacleField,
    progress: ProgressChecker,
    recovery: RecoverySequence,
    failures: u32,
    goal: Point2,
    hits: Vec<[f64; 2]>,
    clearing: Vec<[f64; 2]>,
}

enum ChosenPlanner {
    Mppi(Box<Mppi>),
    Dwa(Box<Dwa>),
}

impl BarnNavigation {
    /// Creates the navigation of a robot at a start.
    /// `None` for settings that are invalid for the planner.
    pub fn new(kind: LocalPlannerKind, seed: u64, start: &Pose2, goal: Point2) -> Option<Self> {
        let settings = NavigationSettings::of(kind);
        let footprint = Footprint::new(&corners(settings.footprint_padding)).ok()?;
        let planner = match kind {
            LocalPlannerKind::Mppi => ChosenPlanner::Mppi(Box::new(
                Mppi::new(settings.mppi, &footprint, Random::new(seed, "local planner")).ok()?,
            )),
            LocalPlannerKind::Dwa => ChosenPlanner::Dwa(Box::new(Dwa::new(settings.dwa, &footprint).ok()?)),
        };
        let low = [math::min(start.x, goal.x) - MARGIN, math::min(start.y, goal.y) - MARGIN];
        let high = [math::max(start.x, goal.x) + MARGIN, math::max(start.y, goal.y) + MARGIN];
        let size = [high[0] - low[0], high[1] - low[1]];
        let geometry = Geometry::new(low, size, RESOLUTION, 1 << 20)?;
        Some(Self {
            planner,
            footprint: FootprintPoints::new(&footprint),
            costmap: Costmap::new(geometry, settings.inflation).ok()?,
            search: AStar::default(),
            path: Vec::new(),
            planned: None,
            observations: ObservationBuffer::new(settings.observation_persistence, 0.5),
            field: ObstacleField::new(settings.field_size, RESOLUTION).ok()?,
            progress: ProgressChecker::new(0.3, settings.movement_time_allowance).ok()?,
            recovery: RecoverySequence::new(settings.recovery.clone()).ok()?,
            failures: 0,
            goal,
            hits: Vec::new(),
            clearing: Vec::new(),
            settings,
        })
    }

    /// Returns the velocity to command at a time, s.
    pub fn step(&mut self, robot: &mut Jackal<'_>, time: f64) -> PlanarVelocity {
        self.scan(robot, time);
        let state = robot.state;
        if self.planned.is_none_or(|planned| time - planned >= REPLAN_PERIOD - 1e-9) {
            self.planned = Some(time);
            self.plan_path(&state.pose);
        }
        self.field.update([state.pose.x, state.pose.y], self.observations.points());
        if self.recovery.is_running() {
            return self.recover(&state, time);
        }
        let is_moving = self.progress.check(&state.pose, time);
        let velocity = match &mut self.planner {
            ChosenPlanner::Mppi(planner) => planner.plan(&state, &self.path, None, &self.field),
            ChosenPlanner::Dwa(planner) => planner.plan(&state, &self.path, &self.field),
        };
        self.failures = if velocity.is_some() { 0 } else { self.failures + 1 };
        if !is_moving || self.failures >= FAILURES {
            self.recovery.start(&state.pose, time);
            return self.recover(&state, time);
        }
        velocity.unwrap_or(PlanarVelocity::ZERO)
    }

    /// Inserts a scan into the costmap and the local memory.
    fn scan(&mut self, robot: &mut Jackal<'_>, time: f64) {
        let laser = robot.laser();
        self.hits.clear();
        self.clearing.clear();
        for (bearing, range) in robot.scan() {
            let end = |range: f64| [range * math::cos(bearing), range * math::sin(bearing)];
            if range <= self.settings.obstacle_range && !Jackal::is_miss(range) {
                self.hits.push(end(range));
            } else {
                self.clearing.push(end(math::min(range, self.settings.raytrace_range)));
            }
        }
        self.costmap.insert_scan(&laser, &self.hits, &self.clearing);
        self.observations.insert(time, &laser, &self.hits);
    }

    /// Plans a path in the space seen by the laser; without one, the path stays.
    fn plan_path(&mut self, pose: &Pose2) {
        let geometry = *self.costmap.geometry();
        let grid = self.costmap.update().clone().allow_unknown(0);
        let grid = grid.with_cost_factor(self.settings.cost_factor);
        let cell = |x: f64, y: f64| {
            geometry.cell(x, y).map(|(column, row)| GridCell::new(column as u32, row as u32))
        };
        let (Some(start), Some(goal)) = (cell(pose.x, pose.y), cell(self.goal.x, self.goal.y)) else {
            return;
        };
        let Some(start) = grid.nearest_passable(start, (0.5 / RESOLUTION) as u32) else { return };
        let Some(found) = self.search.search(&grid, start, goal) else { return };
        self.path.clear();
        self.path.push(Point2 { x: pose.x, y: pose.y });
        let middles =
            found.cells().iter().map(|cell| geometry.center(cell.column as usize, cell.row as usize));
        self.path.extend(middles.skip(1));
        self.path.push(self.goal);
    }

    fn recover(&mut self, state: &MotionState, time: f64) -> PlanarVelocity {
        let (field, footprint) = (&self.field, &self.footprint);
        let is_free = |velocity: PlanarVelocity| {
            let distance = |seconds: f64| footprint.distance(field, &ahead(&state.pose, velocity, seconds));
            // A robot that is already too near may move, but not nearer.
            let least = math::min(0.04, distance(0.0));
            (1..=4).all(|k| distance(0.1 * f64::from(k)) >= least) && distance(0.4) > 0.0
        };
        match self.recovery.step(&state.pose, time, is_free) {
            RecoveryCommand::Move(velocity) => velocity,
            command => {
                if command == RecoveryCommand::ClearCostmap {
                    self.costmap.clear_observations();
                    self.observations.clear();
                }
                self.failures = 0;
                self.progress.reset();
                if let ChosenPlanner::Mppi(planner) = &mut self.planner {
                    planner.reset();
                }
                PlanarVelocity::ZERO
            }
        }
    }
}

/// Returns the pose after a time at a velocity.
fn ahead(pose: &Pose2, velocity: PlanarVelocity, seconds: f64) -> Pose2 {
    let theta = pose.theta + velocity.wz * seconds;
    Pose2 {
        x: pose.x + velocity.vx * seconds * math::cos(pose.theta),
        y: pose.y + velocity.vx * seconds * math::sin(pose.theta),
        theta,
    }
}

use serde::{Deserialize, Serialize};
use slate_grid::Geometry;
use slate_interfaces::{OccupancyGrid, Path, Point2, Pose2};
use slate_module::prelude::*;

use crate::path_planner::{MOST_CELLS, PathPlannerParams, PathPlannerState};

/// Ports of [`GlobalPlanner`].
#[ports]
pub struct GlobalPlannerIo {
    /// Occupancy grid to plan on.
    map: Input<OccupancyGrid>,
    /// Pose of the robot in the map frame.
    #[stale(after = "1s")]
    robot_pose: Input<Pose2>,
    /// Target in the map frame.
    target_pose: Input<Pose2>,
    /// Planned path; empty if the target is unreachable.
    #[capacity(16_384)]
    path: Output<Path>,
    /// Target for obstacle avoidance, in the robot's frame.
    /// A point on the path, or the robot itself where it stays.
    local_target: Output<Pose2>,
    /// Progress on the path.
    status: Output<PathStatus>,
}

/// Progress of a robot on its path.
#[interface]
#[derive(PartialEq)]
pub struct PathStatus {
    /// Length of the path that is left.
    #[unit("m")]
    pub distance: f64,
    /// True if the robot is at its target.
    pub has_arrived: Bool,
    /// True if the target has been unreachable for `give_up_timeout`.
    pub is_unreachable: Bool,
}

/// Parameters of [`GlobalPlanner`].
#[params]
pub struct GlobalPlannerParams {
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "least distance of the path to occupied cells")]
    robot_radius: f64,
    #[param(default = 0.3, range = 0.0..=5.0, unit = "m", doc = "width of the soft-cost band beyond the robot's radius")]
    inflation_margin: f64,
    #[param(default = 65, range = 1..=100, unit = "%", doc = "occupancy from which a cell is an obstacle")]
    occupied_threshold: i64,
    #[param(default = 0.8, range = 0.05..=100.0, unit = "m", doc = "distance of the local target along the path")]
    lookahead_distance: f64,
    #[param(default = 0.5, range = 0.02..=60.0, unit = "s", doc = "time between two plans for the same target")]
    replan_period: f64,
    #[param(default = true, doc = "whether paths cross unknown cells")]
    allow_unknown: Bool,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "distance from the target at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 3.0, range = 0.0..=600.0, unit = "s", doc = "time without a path after which a target counts as unreachable")]
    give_up_timeout: f64,
}

impl GlobalPlannerParams {
    fn search(&self) -> PathPlannerParams {
        PathPlannerParams {
            robot_radius: self.robot_radius,
            inflation_margin: self.inflation_margin,
            occupied_threshold: self.occupied_threshold,
            lookahead_distance: self.lookahead_distance,
            replan_period: self.replan_period,
            allow_unknown: self.allow_unknown,
        }
    }
}

/// Plans paths of a robot without blocks: OpenRDK's `pathPlanner`.
///
/// The path is that of [`PathPlanner`](crate::PathPlanner). The point of it that is `lookahead_distance` ahead is the
/// target of the obstacle avoidance, in the robot's frame as it moves.
pub struct GlobalPlanner;

/// State of [`GlobalPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct GlobalPlannerState {
    /// Time of the newest plan and its target.
    planned: Option<u64>,
    target: Option<[f64; 2]>,
    /// Points of the path in the map frame.
    path: Vec<[f64; 2]>,
    /// Since when there is no path, ns.
    lost_since: Option<u64>,
    #[serde(skip)]
    planner: PathPlannerState,
}

#[module(stage = WorldState)]
impl Module for GlobalPlanner {
    type Io = GlobalPlannerIo;
    type Params = GlobalPlannerParams;
    type State = GlobalPlannerState;

    fn tick(
        state: &mut GlobalPlannerState,
        io: &GlobalPlannerIo,
        params: &GlobalPlannerParams,
        now: &Tick,
    ) -> Outcome {
        let Some(target) = io.target_pose.get().filter(|target| target.x.is_finite() && target.y.is_finite())
        else {
            return Outcome::Ok;
        };
        let (Some(map), Some(pose)) = (io.map.get(), io.robot_pose.fresh().filter(|pose| pose.is_known()))
        else {
            io.local_target.set(Pose2::default());
            return Outcome::Degraded;
        };
        state.plan(io, (map, pose, target), params, now);
        state.publish(io, (pose, target), params, now);
        Outcome::Ok
    }
}

impl GlobalPlannerState {
    /// Plans when it is time, or for another target.
    fn plan(
        &mut self,
        io: &GlobalPlannerIo,
        (map, pose, target): (&OccupancyGrid, &Pose2, &Pose2),
        params: &GlobalPlannerParams,
        now: &Tick,
    ) {
        let is_other = self.target != Some([target.x, target.y]);
        let age = |planned: u64| now.now().saturating_sub(planned) as f64;
        let is_due = self.planned.is_none_or(|planned| age(planned) >= params.replan_period * 1e9 - 1.0);
        if !is_other && !is_due {
            return;
        }
        let Some(geometry) = Geometry::of(map, MOST_CELLS) else {
            now.warn(format_args!("invalid map: expected 1 to {MOST_CELLS} cells, and as much data"));
            return;
        };
        if is_other {
            self.lost_since = None;
        }
        (self.planned, self.target) = (Some(now.now()), Some([target.x, target.y]));
        let goal = Point2 { x: target.x, y: target.y };
        self.planner.plan(&geometry, map, pose, &goal, &params.search());
        let points = self.planner.points();
        self.path.clear();
        self.path.extend(points.iter().map(|point| [point.x, point.y]));
        match points.is_empty() {
            true => _ = self.lost_since.get_or_insert(now.now()),
            false => self.lost_since = None,
        }
        let shown = &points[..points.len().min(io.path.capacity())];
        io.path.write(shown.len(), |path| {
            path.length =
                points.windows(2).map(|pair| between(&[pair[0].x, pair[0].y], &[pair[1].x, pair[1].y])).sum();
            path.points.copy_from_slice(shown);
        });
    }

    /// Writes where the robot goes now.
    fn publish(
        &self,
        io: &GlobalPlannerIo,
        (pose, target): (&Pose2, &Pose2),
        params: &GlobalPlannerParams,
        now: &Tick,
    ) {
        let has_arrived = math::hypot(target.x - pose.x, target.y - pose.y) <= params.goal_tolerance;
        let robot = [pose.x, pose.y];
        let (ahead, distance) = match self.path.len() {
            0 => (robot, 0.0),
            _ => lookahead(&self.path, &robot, params.lookahead_distance),
        };
        let ahead = if has_arrived { robot } else { ahead };
        let (dx, dy) = (ahead[0] - pose.x, ahead[1] - pose.y);
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let (x, y) = (cosine * dx + sine * dy, cosine * dy - sine * dx);
        io.local_target.set(Pose2 {
            x,
            y,
            theta: if dx == 0.0 && dy == 0.0 { 0.0 } else { math::atan2(y, x) },
        });
        let lost = self.lost_since.map_or(0.0, |since| now.now().saturating_sub(since) as f64 * 1e-9);
        let is_unreachable = self.lost_since.is_some() && lost >= params.give_up_timeout && !has_arrived;
        let (has_arrived, is_unreachable) = (has_arrived.into(), is_unreachable.into());
        io.status.set(PathStatus { distance, has_arrived, is_unreachable });
    }
}

fn between(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    math::hypot(b[0] - a[0], b[1] - a[1])
}

/// Returns the lookahead point of a path, and the length beyond it.
/// The distance is counted from the point nearest to the robot.
fn lookahead(path: &[[f64; 2]], robot: &[f64; 2], distance: f64) -> ([f64; 2], f64) {
    let mut nearest = (f64::INFINITY, 0, path[0]);
    for (at, pair) in path.windows(2).enumerate() {
        let (across, up) = (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
        let square = across * across + up * up;
        let along = (robot[0] - pair[0][0]) * across + (robot[1] - pair[0][1]) * up;
        let share = if square > 0.0 { math::clamp(along / square, 0.0, 1.0) } else { 0.0 };
        let point = [pair[0][0] + share * across, pair[0][1] + share * up];
        let away = between(&point, robot);
        if away < nearest.0 {
            nearest = (away, at, point);
        }
    }
    let (_, segment, mut start) = nearest;
    let (mut left, mut length, mut ahead) = (distance, 0.0, None);
    for end in &path[(segment + 1).min(path.len() - 1)..] {
        let own = between(&start, end);
        if ahead.is_none() && own >= left && own > 0.0 {
            let share = left / own;
            ahead = Some([start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])]);
        }
        left -= own;
        length += own;
        start = *end;
    }
    (ahead.unwrap_or(path[path.len() - 1]), length)
}

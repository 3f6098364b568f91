//! Plan: paths and actions for the goals of the mission.

mod grid;
mod places;
mod progress;

use std::fmt::Write;

use serde::{Deserialize, Serialize};
use slate_planning::AStar;
use slate_plugin::interfaces::{OccupancyGrid, Path, Pose2};
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::WheeledModel;

use crate::actions::{Dock, DockArguments, GoalPose, NavigateTo, NavigateToArguments};
use crate::frames::distance;
use crate::mission::{NavigationMission, NavigationState, NavigationStatus};
use grid::RouteGrid;
use places::KnownPlaces;
use progress::{MissionProgress, ResolvedGoal};

/// Ports of [`RoutePlanner`].
#[ports]
pub struct RoutePlannerIo {
    /// Mission, from Knowledge.
    mission: Input<NavigationMission>,
    /// Costs of the map, as of a `global_costmap`.
    #[stale(after = "5s")]
    costmap: Input<OccupancyGrid>,
    /// Robot model with the pose, from Knowledge.
    #[stale(after = "500ms")]
    robot: Input<WheeledModel>,
    /// Path to the goal in the map frame, for Execute.
    #[capacity(4096)]
    path: Output<Path>,
    /// Status of navigation.
    status: Output<NavigationStatus>,
}

/// Parameters of [`RoutePlanner`].
#[params]
pub struct RoutePlannerParams {
    #[param(default = "", doc = "file of the navigation graph with the named places; empty for none")]
    graph_filename: Text<252>,
    #[param(default = 1.0, range = 0.05..=60.0, unit = "s", doc = "time between two plans for the same goal")]
    replan_period: f64,
    #[param(default = 3.0, range = 0.0..=100.0, doc = "relative extra cost of a step near an obstacle")]
    cost_factor: f64,
    #[param(default = 0.25, range = 0.0..=10.0, unit = "m", doc = "distance from a goal in an obstacle up to which the nearest free point takes its place")]
    tolerance: f64,
    #[param(default = 4.0, range = 0.0..=100.0, unit = "m", doc = "distance beyond which an obstacle at a goal is one of the map, so that the goal is given up at once")]
    seen_distance: f64,
    #[param(default = 30.0, range = 0.0..=1e6, unit = "s", doc = "time without a path after which a goal is given up")]
    give_up_timeout: f64,
    #[param(default = 3, range = 1..=1000, doc = "failed actions after which a goal is given up")]
    max_failures: u32,
    #[param(default = 0.0, range = 0.0..=3600.0, unit = "s", doc = "time that the robot stays at a goal")]
    dwell_time: f64,
    #[param(default = 0.6, range = 0.1..=5.0, unit = "m", doc = "distance before a pose to dock at from which docking begins")]
    dock_distance: f64,
    #[param(default = 0.1, range = 0.01..=1.0, unit = "m/s", doc = "velocity of docking")]
    dock_velocity: f64,
}

/// Plans a path to each goal, and requests the actions that follow it.
/// Goals are those of the mission; the path leads through the nodes of a navigation graph where the goal is one of its
/// places.
///
/// It plans again after a period, when an action has failed, after a reflex, and when the goal changes.
pub struct RoutePlanner;

/// State of [`RoutePlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct RoutePlannerState {
    progress: MissionProgress,
    /// Reason in the newest status, so that the log has each once.
    #[serde(skip)]
    status: Option<NavigationStatus>,
    #[serde(skip)]
    places: KnownPlaces,
    #[serde(skip)]
    grid: Option<RouteGrid>,
    #[serde(skip)]
    search: AStar,
    #[serde(skip)]
    route: Vec<Point2>,
    #[serde(skip)]
    points: Vec<Point2>,
}

impl Plan for RoutePlanner {
    const NAME: &'static str = "route_planner";
    const DOC: &'static str = "Plans paths and actions for the goals of the mission.";
    type Noticed = RoutePlannerIo;
    type Params = RoutePlannerParams;
    type State = RoutePlannerState;

    fn run(
        state: &mut RoutePlannerState,
        io: &RoutePlannerIo,
        situation: &Situation<'_>,
        params: &RoutePlannerParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.places.read(params.graph_filename.as_str(), now);
        let Some(mission) = io.mission.get() else { return };
        if state.progress.begin(mission) {
            plan.clear();
        }
        let resolved = state
            .progress
            .goal(mission)
            .map(|goal| ResolvedGoal::of(goal, &state.places, params.dock_distance));
        let docks = matches!(&resolved, Some(Ok(resolved)) if resolved.docks());
        state.progress.take_endings(situation, docks, params.dwell_time, now);
        let mut status = NavigationStatus { mission: mission.number, ..NavigationStatus::default() };
        let cycle = PlanningCycle { io, mission, situation, params, now };
        let end = state.step(&cycle, plan, &mut status);
        state.report(io, status, now);
        if end.is_err() {
            plan.clear();
            state.progress.give_up();
        }
    }
}

/// Inputs of a run of the Plan.
struct PlanningCycle<'a> {
    io: &'a RoutePlannerIo,
    mission: &'a NavigationMission,
    situation: &'a Situation<'a>,
    params: &'a RoutePlannerParams,
    now: &'a Tick,
}

/// Time from the start on in which inputs may be missing, s.
const STARTUP: f64 = 1.0;

/// Failure of a goal; the status has the reason.
struct GivenUp;

/// Sets state and reason of a status.
fn say(status: &mut NavigationStatus, state: NavigationState, reason: std::fmt::Arguments<'_>) {
    (status.state, status.reason) = (state, Text::default());
    // A text that does not fit is cut.
    let _ = status.reason.write_fmt(reason);
}

impl RoutePlannerState {
    /// Plans for the present goal.
    fn step(
        &mut self,
        cycle: &PlanningCycle<'_>,
        plan: &mut Agenda<'_>,
        status: &mut NavigationStatus,
    ) -> Result<(), GivenUp> {
        let PlanningCycle { io, mission, params, now, .. } = *cycle;
        let Some(goal) = self.progress.goal(mission) else {
            self.finish(mission, status);
            return Ok(());
        };
        if mission.is_paused.get() {
            if !std::mem::replace(&mut self.progress.is_paused, true) {
                plan.clear();
            }
            say(status, NavigationState::PAUSED, format_args!("paused"));
            return Ok(());
        }
        self.progress.is_paused = false;
        if self.progress.dwells(now.seconds()) {
            say(status, NavigationState::NAVIGATING, format_args!("at the goal"));
            return Ok(());
        }
        let pose = match self.inputs(io, params) {
            Ok(pose) => pose,
            Err(reason) => {
                say(status, NavigationState::WAITING_FOR_INPUT, format_args!("{reason}"));
                return Ok(());
            }
        };
        let place = goal.place.as_str();
        let resolved = ResolvedGoal::of(goal, &self.places, params.dock_distance).map_err(|near| {
            let near = near.as_deref().unwrap_or("one of the graph's places");
            say(status, NavigationState::BLOCKED, format_args!("no place `{place}`: expected {near}"));
            GivenUp
        })?;
        status.nearest_free = resolved.position();
        if self.progress.failures >= params.max_failures {
            let (count, Point2 { x, y }) = (self.progress.failures, resolved.position());
            let reason = format_args!("{count} actions to ({x:.2}, {y:.2}) have failed");
            say(status, NavigationState::BLOCKED, reason);
            return Err(GivenUp);
        }
        if self.progress.is_due(params.replan_period, now) {
            self.plan_path((&pose, &resolved, place), cycle, status)?;
        } else if let Some(before) = self.status.filter(|_| self.progress.is_blocked()) {
            (status.state, status.reason, status.nearest_free) =
                (before.state, before.reason, before.nearest_free);
        }
        if !self.progress.is_blocked() {
            say(status, NavigationState::NAVIGATING, format_args!("on the way"));
        }
        self.request(&resolved, cycle, plan);
        Ok(())
    }

    /// Sets the status of a mission without a goal.
    /// The reason why the last goal was given up stays.
    fn finish(&self, mission: &NavigationMission, status: &mut NavigationStatus) {
        let was_last = |before: &NavigationStatus| {
            let is_end = matches!(before.state, NavigationState::BLOCKED | NavigationState::FINISHED);
            is_end && before.mission == mission.number
        };
        match self.status.filter(was_last) {
            _ if mission.goals.is_empty() => say(status, NavigationState::IDLE, format_args!("no goal")),
            Some(before) => {
                say(status, NavigationState::FINISHED, format_args!("{}", before.reason.as_str()));
                status.nearest_free = before.nearest_free;
            }
            None => say(status, NavigationState::FINISHED, format_args!("all goals are done")),
        }
    }

    /// Reads pose and costmap.
    ///
    /// # Errors
    /// Which of them is missing, old or invalid.
    fn inputs(&mut self, io: &RoutePlannerIo, params: &RoutePlannerParams) -> Result<Pose2, &'static str> {
        let pose = io.robot.fresh().map(|robot| robot.robot.pose).filter(Pose2::is_known);
        let pose = pose.ok_or("the pose is unknown or stale")?;
        let costmap =
            io.costmap.fresh().ok_or("`costmap` is missing or stale: check the block that computes it")?;
        RouteGrid::fit(&mut self.grid, costmap, io.costmap.stamp(), params.cost_factor)
            .map(|_| pose)
            .ok_or("`costmap` is not a valid map")
    }

    /// Plans a path to a goal and publishes it.
    fn plan_path(
        &mut self,
        (pose, resolved, place): (&Pose2, &ResolvedGoal, &str),
        cycle: &PlanningCycle<'_>,
        status: &mut NavigationStatus,
    ) -> Result<(), GivenUp> {
        let PlanningCycle { io, params, now, .. } = *cycle;
        let from = Point2 { x: pose.x, y: pose.y };
        let wanted = resolved.approach();
        let nearest = self.grid.as_ref().and_then(|grid| grid.nearest_free(wanted));
        let end = nearest.filter(|nearest| distance(*nearest, wanted) <= params.tolerance);
        if let Some(end) = end.filter(|end| self.find_path(from, *end, place)) {
            self.progress.set_planned(end, now);
            let length: f64 = self.points.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
            status.distance = length;
            let points = &self.points[..self.points.len().min(io.path.capacity())];
            io.path.write(points.len(), |path| {
                path.length = length;
                path.points.copy_from_slice(points);
            });
            return Ok(());
        }
        status.nearest_free = nearest.unwrap_or(wanted);
        let Point2 { x, y } = wanted;
        let state = NavigationState::BLOCKED;
        match (end, nearest) {
            (Some(_), _) => say(status, state, format_args!("no path to ({x:.2}, {y:.2}) at present")),
            (None, Some(free)) => say(
                status,
                state,
                format_args!(
                    "the goal ({x:.2}, {y:.2}) is too near to an obstacle: nearest free point ({:.2}, {:.2})",
                    free.x, free.y
                ),
            ),
            (None, None) => {
                say(
                    status,
                    state,
                    format_args!("the goal ({x:.2}, {y:.2}) is outside of the map's free space"),
                );
            }
        }
        let blocked = self.progress.set_blocked(now);
        // Unseen obstacles are part of the map, and stay.
        let stays = end.is_none() && distance(from, wanted) > params.seen_distance;
        if stays || blocked >= params.give_up_timeout { Err(GivenUp) } else { Ok(()) }
    }

    /// Computes the path through the nodes on the route to a place.
    /// It leads straight to a goal that is no place.
    fn find_path(&mut self, from: Point2, end: Point2, place: &str) -> bool {
        let Self { grid, places, search, route, points, .. } = self;
        let Some(grid) = grid else { return false };
        route.clear();
        if !place.is_empty() {
            places.route(from, place, grid, route);
        }
        // The place itself is the end.
        route.pop();
        points.clear();
        points.push(from);
        let mut here = from;
        for node in route.iter() {
            // A node that something stands on is left out.
            if grid.extend_path(search, here, *node, points) {
                here = *node;
            }
        }
        grid.extend_path(search, here, end, points)
    }

    /// Requests the action for the goal, unless it runs.
    fn request(&mut self, resolved: &ResolvedGoal, cycle: &PlanningCycle<'_>, plan: &mut Agenda<'_>) {
        let PlanningCycle { situation, params, .. } = *cycle;
        let Some([x, y]) = self.progress.end else { return };
        let runs = self.progress.is_requested && !situation.needs_plan();
        if runs || situation.is_reactive() {
            return;
        }
        let GoalPose { x: goal_x, y: goal_y, heading } = resolved.goal;
        let theta = heading.unwrap_or_default();
        let action = if self.progress.is_docking {
            Dock::request(DockArguments { x: goal_x, y: goal_y, theta, speed: params.dock_velocity })
        } else {
            let has_heading = if heading.is_some() { 1.0 } else { 0.0 };
            NavigateTo::request(NavigateToArguments { x, y, theta, has_heading })
        };
        if let Some(ticket) = plan.replace(action) {
            self.progress.set_requested(ticket);
        }
    }

    /// Publishes the status, and logs a new reason.
    fn report(&mut self, io: &RoutePlannerIo, mut status: NavigationStatus, now: &Tick) {
        self.progress.write(&mut status);
        let before = self.status.as_ref();
        if status.distance == 0.0 {
            status.distance = before.map_or(0.0, |before| before.distance);
        }
        let is_other = before.is_none_or(|before| (before.state, before.goal) != (status.state, status.goal));
        // Devices take a while to begin.
        let is_early = now.seconds() < STARTUP && status.state == NavigationState::WAITING_FOR_INPUT;
        if is_other
            && !is_early
            && matches!(status.state, NavigationState::BLOCKED | NavigationState::WAITING_FOR_INPUT)
        {
            now.warn(format_args!("{}", status.reason.as_str()));
        }
        if before != Some(&status) {
            io.status.set(status);
            self.status = Some(status);
        }
    }
}

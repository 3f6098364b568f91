//! Plan: to the goal, round the obstacles of a local map.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Avoider, Decision, Footprint, Other, Parameters};
use slate_plugin::interfaces::{Point2, Twist2, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{SetWheelSpeed, Speeds};
use crate::go_to_origin::{GoToOriginParams, GoToOriginPorts, GoToOriginState};
use crate::knowledge::WheeledModel;
use crate::local_map::LocalObstacles;

/// Obstacles and knowledge for the local planner.
/// A [`GoToOriginPlanner`](crate::go_to_origin::GoToOriginPlanner) does not have them.
#[ports]
pub struct LocalPlannerPorts {
    obstacles: Noticed<LocalObstacles>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`LocalPlanner`].
#[params]
pub struct LocalPlannerParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in free space")]
    max_linear_velocity: f64,
    #[param(default = 0.3, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in crowded space or near another robot")]
    careful_linear_velocity: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.05, range = 0.001..=1.0, unit = "m", doc = "distance from the goal at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 0.15, range = 0.001..=10.0, unit = "m", doc = "distance from the goal that triggers a new plan (hysteresis)")]
    replan_distance: f64,
    #[param(default = 0.025, range = 0.0..=1.0, unit = "m", doc = "minimum clearance from static obstacles")]
    min_clearance: f64,
    #[param(default = 4.0, range = 0.0..=1e6, unit = "s", doc = "time without progress after which it accepts less clearance")]
    progress_timeout: f64,
    #[param(default = 1e6, range = 0.0..=1e6, unit = "m", doc = "half the side of a known square room about the origin")]
    room_half_width: f64,
}

/// State of [`LocalPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct LocalPlannerState {
    /// Straight path.
    #[serde(alias = "go")]
    straight: GoToOriginState,
    avoider: Option<Avoider>,
    /// Newest wheel speeds round an obstacle (rad/s), and their time (s).
    /// `None` on the straight path.
    round: Option<([f64; 2], f64)>,
    /// Time of the newest map, seconds.
    mapped: Option<f64>,
}

/// Duration of wheel speeds unless they are renewed, seconds.
const COMMAND_DURATION: f64 = 0.2;
/// Age at which they are renewed, seconds.
const RENEWAL: f64 = 0.1;
/// Age of the map above which the robot stops, seconds.
const MAP_TIMEOUT: f64 = 0.3;

/// Sends the robot to its goal.
/// It drives straight where that is free, and round obstacles elsewhere.
pub struct LocalPlanner;

impl Plan for LocalPlanner {
    const NAME: &'static str = "local_planner";
    const DOC: &'static str = "Sends the robot to its goal round the obstacles of a local map.";
    type Noticed = (GoToOriginPorts, LocalPlannerPorts);
    type Params = LocalPlannerParams;
    type State = LocalPlannerState;

    fn run(
        memory: &mut LocalPlannerState,
        (noticed, local): &Self::Noticed,
        situation: &Situation<'_>,
        params: &LocalPlannerParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let (Some(goal), Some(robot)) = (noticed.goal.fresh(), local.robot.fresh()) else { return };
        let time = now.seconds();
        let decision = memory.decide(local, *goal, robot, params, time);
        let is_lost =
            memory.mapped.is_none_or(|mapped| time - mapped > MAP_TIMEOUT) || robot.has_lost_odometry();
        let was_round = memory.round.is_some();
        let stop = is_lost.then_some(Decision::Avoid(Twist2::ZERO));
        match stop.or(decision) {
            Some(Decision::Avoid(twist)) => memory.avoid(robot, twist, time, plan),
            Some(Decision::Clear) => memory.round = None,
            None => {}
        }
        if memory.round.is_some() {
            memory.straight.update(noticed);
            return;
        }
        let replans = memory.straight.run(noticed, situation, &params.straight(), was_round, plan);
        if was_round && !replans {
            plan.clear();
        }
    }
}

impl LocalPlannerState {
    /// Decides by the newest map whether the straight path is free.
    /// `None` without a new map or a valid outline.
    fn decide(
        &mut self,
        local: &LocalPlannerPorts,
        goal: Point2,
        robot: &WheeledModel,
        params: &LocalPlannerParams,
        time: f64,
    ) -> Option<Decision> {
        let obstacles = local.obstacles.newest()?;
        let avoider = match &mut self.avoider {
            Some(avoider) => avoider,
            none => none.insert(Avoider::new(Footprint::of(&robot.chassis.outline).ok()?)),
        };
        let marks = obstacles.obstacles.iter().map(|mark| (mark.x, mark.y, mark.since));
        avoider.set_obstacles(marks, time);
        if obstacles.sees_robots.get() {
            let others = obstacles.robots.iter().map(|robot| Other {
                x: robot.x,
                y: robot.y,
                radius: robot.radius,
                velocity: [robot.velocity_x, robot.velocity_y],
            });
            avoider.set_others(others, time);
        }
        self.mapped = Some(time);
        let parameters = parameters(params, robot);
        Some(avoider.guard(obstacles.pose, obstacles.twist, goal, None, &parameters, time))
    }

    /// Plans a twist round an obstacle.
    /// It does not if the newest one is the same and still lasts.
    fn avoid(&mut self, robot: &WheeledModel, twist: Twist2, time: f64, plan: &mut Agenda<'_>) {
        let WheelSpeeds { left, right } = robot.wheels_for(twist.linear, twist.angular);
        let speeds = [left, right];
        if !self.round.is_some_and(|(last, at)| last == speeds && time - at < RENEWAL) {
            self.round = Some((speeds, time));
            plan.replace(SetWheelSpeed::request(Speeds { left, right, duration: COMMAND_DURATION }));
        }
    }
}

impl LocalPlannerParams {
    /// Parameters of the straight path.
    fn straight(&self) -> GoToOriginParams {
        GoToOriginParams {
            max_linear_velocity: self.max_linear_velocity,
            careful_linear_velocity: self.careful_linear_velocity,
            goal_tolerance: self.goal_tolerance,
            replan_distance: self.replan_distance,
        }
    }
}

fn parameters(params: &LocalPlannerParams, robot: &WheeledModel) -> Parameters {
    let usual = Parameters::default();
    let deceleration = robot.deceleration();
    Parameters {
        max_linear_velocity: params.max_linear_velocity,
        max_angular_velocity: params.max_angular_velocity,
        min_clearance: params.min_clearance,
        progress_timeout: params.progress_timeout,
        // The present motion of a robot that stops at once makes no difference.
        sides: robot.sides().filter(|sides| sides.acceleration < usual.deceleration),
        room_half_width: (params.room_half_width < 1e6).then_some(params.room_half_width),
        deceleration,
        angular_deceleration: math::min(usual.angular_deceleration, 2.0 * deceleration / robot.chassis.track),
        ..usual
    }
}

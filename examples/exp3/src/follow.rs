//! Behavior of R3: follows R2 at a safe distance and out of its path.
//! It uses R2's position and course (section 6.5 of the paper).

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;
use slate_wheeled::actions::{GoToOrigin, Leg, SetWheelSpeed, Speeds};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

/// Percepts and knowledge of the Plan.
#[ports]
pub struct FollowPorts {
    leader: Noticed<Located>,
    /// Kinematics of the robot, from its knowledge.
    robot: Required<WheeledModel>,
}

/// Parameters of [`FollowPlanner`].
#[params]
pub struct FollowParams {
    #[param(default = 1.4, range = 0.1..=100.0, unit = "m", doc = "distance to keep from the leader")]
    following_distance: f64,
    #[param(default = 1.1, range = 0.0..=100.0, unit = "m", doc = "distance below which it backs off")]
    min_distance: f64,
    #[param(default = 0.4, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 0.2, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity backwards")]
    max_reverse_velocity: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "maximum distance backwards, where no sensor looks, until it drives forward again")]
    max_reverse_distance: f64,
    #[param(default = 1.5, range = 0.0..=10.0, unit = "1/s", doc = "linear velocity backwards per meter below that distance")]
    distance_gain: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "angular velocity per radian of bearing error")]
    bearing_gain: f64,
    #[param(default = 1.2, range = 0.0..=3.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.8, range = 0.0..=1.5, unit = "rad", doc = "bearing error above which it turns on the spot")]
    max_bearing_error: f64,
    #[param(default = 0.6, range = 0.0..=10.0, unit = "m", doc = "distance from the leader's course within which the robot makes way; 0: never")]
    passing_distance: f64,
    #[param(default = 0.1, range = 0.01..=100.0, unit = "m", doc = "travel of the leader over which its course is measured")]
    course_distance: f64,
    #[param(default = 0.4, range = 0.01..=100.0, unit = "m", doc = "the same, if the detector of robots errs")]
    error_course_distance: f64,
    #[param(default = 1.6, range = 0.1..=100.0, unit = "m", doc = "distance to keep from an approaching leader")]
    waiting_distance: f64,
    #[param(default = 0.12, range = 0.0..=1.5, unit = "m/s", doc = "linear velocity while it clears the leader's course")]
    evasion_velocity: f64,
    #[param(default = 0.25, range = 0.0..=1.5, unit = "m/s", doc = "linear velocity round obstacles on the way to the leader")]
    detour_velocity: f64,
    #[param(default = 0.6, range = 0.0..=3.0, unit = "rad/s", doc = "angular velocity while it looks around for a leader that it does not detect")]
    search_velocity: f64,
    #[param(default = 3.0, range = 0.1..=1e6, unit = "s", doc = "time without coming nearer to a leader that is too far away, after which it drives a detour, for as long")]
    progress_timeout: f64,
}

/// Duration of a plan unless it is renewed, seconds.
const PLAN_DURATION: f64 = 0.5;
/// Distance behind the leader that still counts as beside it, meters.
/// It is measured along the leader's course.
const BESIDE_DISTANCE: f64 = 0.3;
/// Bearing error above which it turns in place before it makes way, radians.
const TURN_FIRST: f64 = 0.4;
/// Angle between a detour and the direction to the leader, radians.
const DETOUR: f64 = 0.9;
/// Distance above the waiting distance that is too far, meters.
const POSITION_TOLERANCE: f64 = 0.15;
/// Less than this is not nearer, meters.
const NEARER: f64 = 0.1;

/// State of [`FollowPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct FollowPlannerState {
    /// Newest report of the leader.
    leader: Option<LeaderReport>,
    /// Newest plan.
    planned: PlannedDrive,
    /// Distance backwards that was planned since it drove forward, meters.
    reversed: f64,
    #[serde(default)]
    course: LeaderCourse,
    #[serde(default)]
    progress: ApproachProgress,
}

/// Report of the leader.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct LeaderReport {
    /// Position in the map frame, meters.
    x: f64,
    y: f64,
    /// Distance, meters.
    range: f64,
    /// Bearing, radians.
    bearing: f64,
    /// True if the leader is detected; else the position is the last known one.
    is_seen: bool,
}

impl LeaderReport {
    fn of(located: &Located) -> Self {
        let Located { x, y, range, bearing, seen } = *located;
        Self { x, y, range, bearing, is_seen: seen.get() }
    }
}

/// Drive of a plan.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct PlannedDrive {
    /// Linear velocity, m/s.
    velocity: f64,
    /// Time of the plan, seconds.
    time: f64,
}

/// Course of the leader.
#[derive(Default, Serialize, Deserialize)]
struct LeaderCourse {
    /// Start of the present part of the leader's path, meters.
    start: Option<(f64, f64)>,
    /// Direction of the last part, of length 1.
    direction: Option<(f64, f64)>,
}

/// Position of this robot relative to the leader's course.
struct CourseOffset {
    /// Distance ahead of the leader, meters.
    ahead: f64,
    /// Distance beside the course, meters.
    aside: f64,
    /// Direction away from the course, radians.
    away: f64,
}

/// Progress in approaching a leader that is too far away.
#[derive(Default, Serialize, Deserialize)]
struct ApproachProgress {
    /// Nearest distance, meters, and its time, seconds.
    nearest: Option<(f64, f64)>,
    /// End of the present detour, seconds.
    until: f64,
    /// True if the next detour is to the right.
    to_right: bool,
}

/// Follows another robot and makes way for it; knows no obstacles.
pub struct FollowPlanner;

impl Plan for FollowPlanner {
    const NAME: &'static str = "follow_planner";
    const DOC: &'static str = "Follows another robot at a safe distance.";
    type Noticed = FollowPorts;
    type Params = FollowParams;
    type State = FollowPlannerState;

    fn run(
        state: &mut FollowPlannerState,
        noticed: &FollowPorts,
        situation: &Situation<'_>,
        params: &FollowParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.advance(now.seconds(), situation.is_reactive());
        let report = noticed.leader.newest();
        if let Some(leader) = &report {
            state.leader = Some(LeaderReport::of(leader));
            if leader.seen.get() {
                state.course.update(leader.x, leader.y, params.course_distance(&noticed.robot));
            }
        }
        // A reflex is not interrupted.
        if situation.is_reactive() || (report.is_none() && !situation.needs_plan()) {
            return;
        }
        let Some(LeaderReport { x, y, range, bearing, is_seen }) = state.leader else {
            return state.turn(params.search_velocity, noticed, now, plan);
        };
        let pose = noticed.robot.robot.pose;
        if !pose.is_known() {
            return;
        }
        let (dx, dy) = (x - pose.x, y - pose.y);
        let detour = state.progress.detour(math::hypot(dx, dy), params, now.seconds());
        if !is_seen && math::hypot(dx, dy) < params.following_distance {
            let side = if bearing < 0.0 { -1.0 } else { 1.0 };
            return state.turn(side * params.search_velocity, noticed, now, plan);
        }
        if !is_seen && detour.is_none() {
            // To where it was last.
            let (speed, tolerance) = (params.max_linear_velocity, params.following_distance);
            plan.replace(GoToOrigin::request(Leg { x, y, speed, tolerance }));
            state.planned = PlannedDrive { velocity: 0.0, time: now.seconds() };
            return;
        }
        let deceleration = noticed.robot.deceleration();
        let (linear, angular) = match (detour, state.course.offset(-dx, -dy)) {
            (Some(angle), _) => {
                let direction = math::angle_between(pose.theta, math::atan2(dy, dx) + angle);
                params.drive(params.detour_velocity, direction)
            }
            // The leader comes, or passes.
            (None, Some(offset)) if params.passing_distance > 0.0 && offset.ahead > -BESIDE_DISTANCE => {
                if offset.aside < params.passing_distance && range < params.waiting_distance {
                    params.drive(params.evasion_velocity, math::angle_between(pose.theta, offset.away))
                } else {
                    params.twist(range, bearing, params.waiting_distance, deceleration)
                }
            }
            _ => params.twist(range, bearing, params.following_distance, deceleration),
        };
        let linear =
            if state.reversed > params.max_reverse_distance { math::max(linear, 0.0) } else { linear };
        state.planned = PlannedDrive { velocity: linear, time: now.seconds() };
        let wheels = noticed.robot.wheels_for(linear, angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            duration: PLAN_DURATION,
        }));
    }
}

impl FollowPlannerState {
    /// Plans a turn on the spot, at an angular velocity (rad/s).
    fn turn(&mut self, angular: f64, noticed: &FollowPorts, now: &Tick, plan: &mut Agenda<'_>) {
        let wheels = noticed.robot.wheels_for(0.0, angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            duration: PLAN_DURATION,
        }));
        self.planned = PlannedDrive { velocity: 0.0, time: now.seconds() };
    }

    /// Notes how far the robot has driven backwards by its plan until a time, seconds.
    fn advance(&mut self, time: f64, is_reactive: bool) {
        let PlannedDrive { velocity, time: since } = self.planned;
        let way = if is_reactive { 0.0 } else { velocity * math::clamp(time - since, 0.0, PLAN_DURATION) };
        // Forward, it leaves free space behind.
        self.reversed = math::max(self.reversed - way, 0.0);
        self.planned = PlannedDrive { velocity, time };
    }
}

impl LeaderCourse {
    /// Updates the leader's position, meters.
    /// Its course is that of the last part of its path, of a length (m).
    fn update(&mut self, x: f64, y: f64, length: f64) {
        let (from_x, from_y) = *self.start.get_or_insert((x, y));
        let (dx, dy) = (x - from_x, y - from_y);
        let way = math::hypot(dx, dy);
        if way >= length {
            self.start = Some((x, y));
            self.direction = Some((dx / way, dy / way));
        }
    }

    /// Returns the offset from the course of a robot relative to the leader (m).
    /// `None` before the leader has moved.
    fn offset(&self, x: f64, y: f64) -> Option<CourseOffset> {
        let (east, north) = self.direction?;
        let left = east * y - north * x;
        let side = if left < 0.0 { -1.0 } else { 1.0 };
        let away = math::atan2(side * east, -side * north);
        Some(CourseOffset { ahead: east * x + north * y, aside: left.abs(), away })
    }
}

impl ApproachProgress {
    /// Returns the angle of the present detour, if there is one.
    /// It is relative to the direction of a leader at a distance (m).
    fn detour(&mut self, distance: f64, params: &FollowParams, time: f64) -> Option<f64> {
        if distance < params.waiting_distance + POSITION_TOLERANCE {
            *self = Self { to_right: self.to_right, ..Self::default() };
            return None;
        }
        let (nearest, since) = *self.nearest.get_or_insert((distance, time));
        if distance < nearest - NEARER {
            self.nearest = Some((distance, time));
        } else if time - since > params.progress_timeout {
            self.to_right = !self.to_right;
            self.until = time + params.progress_timeout;
            self.nearest = Some((distance, self.until));
        }
        (time < self.until).then_some(if self.to_right { -DETOUR } else { DETOUR })
    }
}

impl FollowParams {
    /// Returns the travel over which the leader's course is measured, meters.
    /// Errors of a short one are great.
    fn course_distance(&self, robot: &WheeledModel) -> f64 {
        let errs = robot.accuracy.sighting_range_stddev > 0.0;
        if errs { self.error_course_distance } else { self.course_distance }
    }

    /// Returns linear (m/s) and angular (rad/s) velocity into a direction (rad).
    fn drive(&self, velocity: f64, direction: f64) -> (f64, f64) {
        let linear = if direction.abs() > TURN_FIRST { 0.0 } else { velocity * math::cos(direction) };
        let limit = self.max_angular_velocity;
        (linear, math::clamp(self.bearing_gain * direction, -limit, limit))
    }

    /// Returns linear (m/s) and angular (rad/s) velocity towards a leader.
    /// The leader is at a range (m) and bearing (rad); the robot approaches up to a distance (m).
    fn twist(&self, range: f64, bearing: f64, distance: f64, deceleration: f64) -> (f64, f64) {
        let ahead = range - distance;
        let wanted = if ahead > 0.0 {
            // Low enough to stop in time, should the leader stop.
            math::min(self.max_linear_velocity, (2.0 * deceleration * ahead).sqrt())
        } else {
            math::clamp(self.distance_gain * (range - self.min_distance), -self.max_reverse_velocity, 0.0)
        };
        let linear = if bearing.abs() > self.max_bearing_error { 0.0 } else { wanted * math::cos(bearing) };
        let limit = self.max_angular_velocity;
        (linear, math::clamp(self.bearing_gain * bearing, -limit, limit))
    }
}

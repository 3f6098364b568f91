//! R3's behaviour: after R2 at a safe distance, by how far and how misaligned it is (section 6.5 of the paper).

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;
use slate_wheeled::actions::{GoToOrigin, Leg, SetWheelSpeed, Speeds};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

/// Percepts and knowledge of the Plan.
#[ports]
pub struct FollowNoticing {
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
    #[param(default = 0.9, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 0.2, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity backwards")]
    max_reverse_velocity: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "maximum distance backwards, where no sensor looks, until it drives forward again")]
    max_reverse_distance: f64,
    #[param(default = 1.5, range = 0.0..=10.0, unit = "1/s", doc = "linear velocity backwards per metre below that distance")]
    distance_gain: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "angular velocity per radian of bearing error")]
    bearing_gain: f64,
    #[param(default = 1.2, range = 0.0..=3.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.8, range = 0.0..=1.5, unit = "rad", doc = "bearing error above which it turns on the spot")]
    max_bearing_error: f64,
}

/// Duration of a plan unless it is renewed, seconds.
const HOLD: f64 = 0.5;

/// State of [`FollowPlanner`].
#[derive(Default, Serialize, Deserialize)]
pub struct FollowPlannerState {
    /// The newest report of the leader: x, y, range, bearing, and whether it is seen.
    leader: Option<(f64, f64, f64, f64, bool)>,
    /// Velocity of the newest plan, m/s, and its time, seconds.
    planned: (f64, f64),
    /// Distance backwards that was planned since it drove forward, metres.
    reversed: f64,
}

/// Follows another robot, as if nothing stood in the way.
pub struct FollowPlanner;

impl Plan for FollowPlanner {
    const NAME: &'static str = "follow_planner";
    const DOC: &'static str = "Follows another robot at a safe distance.";
    type Noticed = FollowNoticing;
    type Params = FollowParams;
    type State = FollowPlannerState;

    fn run(
        state: &mut FollowPlannerState,
        noticed: &FollowNoticing,
        situation: &Situation<'_>,
        params: &FollowParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.advance(now.seconds(), situation.is_reactive());
        let report = noticed.leader.newest();
        if let Some(leader) = &report {
            state.leader = Some((leader.x, leader.y, leader.range, leader.bearing, leader.seen.get()));
        }
        let Some((x, y, range, bearing, seen)) = state.leader else { return };
        // A reflex is not interrupted.
        if situation.is_reactive() || (report.is_none() && !situation.needs_plan()) {
            return;
        }
        if !seen {
            // To where it was last.
            let (speed, tolerance) = (params.max_linear_velocity, params.following_distance);
            plan.replace(GoToOrigin::request(Leg { x, y, speed, tolerance }));
            state.planned = (0.0, now.seconds());
            return;
        }
        let (linear, angular) = params.twist(range, bearing, noticed.robot.deceleration());
        let linear =
            if state.reversed > params.max_reverse_distance { math::max(linear, 0.0) } else { linear };
        state.planned = (linear, now.seconds());
        let wheels = noticed.robot.wheels_for(linear, angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            duration: HOLD,
        }));
    }
}

impl FollowPlannerState {
    /// Notes how far the robot has driven backwards by its plan until a time, seconds.
    fn advance(&mut self, time: f64, is_reactive: bool) {
        let (linear, since) = self.planned;
        let way = if is_reactive { 0.0 } else { linear * math::clamp(time - since, 0.0, HOLD) };
        // Forward, it leaves free space behind.
        self.reversed = math::max(self.reversed - way, 0.0);
        self.planned = (linear, time);
    }
}

impl FollowParams {
    /// Linear (m/s) and angular (rad/s) velocity towards a leader at that distance (m) and bearing (rad).
    fn twist(&self, range: f64, bearing: f64, deceleration: f64) -> (f64, f64) {
        let ahead = range - self.following_distance;
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
